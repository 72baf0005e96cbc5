"""Warnings about the values of a mission: valid, but probably not intended."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

from behaviors.mission.robot import Table
from behaviors.mission.tables import AdaptiveParameters, Mission, ThesisParameters
from behaviors.mission.targets import ColorTarget
from behaviors.profile_names import ADAPTIVE, THESIS

MIN_HEIGHT_MM, MAX_HEIGHT_MM = 40.0, 2500.0
"""Heights outside are rarely intended: smaller ones are found from less than a metre, or are centimetres."""
WHEEL_DEG_S = 855.0
"""An NXT motor's speed at full power and 8 V. Source: docs/firmware.md section 0.2."""

USED_BY_ADAPTIVE = {"continue_every_s"}
"""Keys of [thesis] that the adaptive profile also uses."""
USED_BY_FIXED_MOVES = {"advances", "advance_mm"}
"""Keys of [thesis] that it uses only if it does not choose where to look from."""


def value_warnings(mission: Mission) -> Iterator[str]:
    """Yield the warnings, one sentence or two each."""
    table = mission.mission
    for name, count in Counter(table.targets).items():
        if count > 1:
            yield f"mission.targets: {name!r} is listed {count} times; the robot goes there {count} times."
    for name in mission.target:
        if name not in table.targets:
            yield f"target.{name}: no effect, since targets = [...] in [mission] does not list it."
    unused = unused_keys(mission)
    for name, keys in unused.items():
        other: Table = getattr(mission, name)
        own = mission.thesis if other is mission.adaptive else mission.adaptive
        # a key that is set for both profiles is meant for either
        if idle := sorted(other.model_fields_set & keys - own.model_fields_set):
            yield f"{name}: {', '.join(idle)} has no effect: the mission's profile is {table.profile!r}."
    for name in sorted(mission.guessed_heights) if table.profile == THESIS else ():
        yield (
            f"target.{name}: height_mm is missing, and the profile 'thesis' does not measure it by driving: "
            f"{mission.target[name].height_mm:g} mm counts. Measure it and set height_mm."
        )
    for name in dict.fromkeys(table.targets):
        yield from _odd_height(name, mission.target[name].height_mm)
        yield from _color_of_wood(name, mission)
    yield from _same_targets(mission)
    yield from _odd_robot(mission)


def unused_keys(mission: Mission) -> dict[str, set[str]]:
    """Return the keys of the other profile's table that the mission's profile does not use, by table.

    An external profile may use all keys of both.
    """
    profile = mission.mission.profile
    if profile == ADAPTIVE:
        used = USED_BY_ADAPTIVE if mission.adaptive.chooses_viewpoints else USED_BY_ADAPTIVE | USED_BY_FIXED_MOVES
        return {"thesis": set(ThesisParameters.model_fields) - used}
    return {"adaptive": set(AdaptiveParameters.model_fields)} if profile == THESIS else {}


def _odd_height(name: str, height_mm: float) -> Iterator[str]:
    if height_mm < MIN_HEIGHT_MM:
        yield (
            f"target.{name}: height_mm = {height_mm:g} is small; all distances are computed from it. "
            f"Is it in centimetres? Then it is {10 * height_mm:g} mm."
        )
    elif height_mm > MAX_HEIGHT_MM:
        most_m = MAX_HEIGHT_MM / 1000
        yield f"target.{name}: height_mm = {height_mm:g} is more than {most_m:g} m; all distances are computed from it."


def _color_of_wood(name: str, mission: Mission) -> Iterator[str]:
    target = mission.target[name]
    if isinstance(target, ColorTarget) and target.color == "orange" and target.color not in mission.color:
        yield (
            f"target.{name}: wood, cardboard and skin look orange to a camera. Where there are any, "
            "`nxtdrive calibrate colors --color orange` learns a stronger orange, or use another detector."
        )


def _same_targets(mission: Mission) -> Iterator[str]:
    """Yield warnings of targets that no detector can distinguish; `mission check` compares the pictures themselves."""
    first: dict[str, str] = {}
    for name in dict.fromkeys(mission.mission.targets):
        target = mission.target[name]
        same = first.setdefault(target.model_dump_json(exclude={"height_mm"}), name)
        if same != name and target.detector != "picture":
            yield f"target.{name}: target.{same} has the same detector and keys, so one will be taken for the other."


def _odd_robot(mission: Mission) -> Iterator[str]:
    robot, parameters, table = mission.robot, mission.parameters, mission.parameters_name
    nearest_mm = robot.stop_distance_mm + mission.sonar_ahead_mm
    if robot.ultrasonic and nearest_mm >= parameters.arrive_mm:
        yield (
            f"robot.stop_distance_mm: the safety stop ends an approach {nearest_mm:g} mm from the target, before "
            f"{table}.arrive_mm = {parameters.arrive_mm:g}; make that larger or the stop distance smaller."
        )
    fastest_mm_s = WHEEL_DEG_S / 360 * math.pi * robot.wheel_diameter_mm
    if parameters.cruise_mm_s > fastest_mm_s:
        yield (
            f"robot.wheel_diameter_mm: wheels of {robot.wheel_diameter_mm:g} mm drive {fastest_mm_s:.0f} mm/s at most, "
            f"slower than {table}.cruise_mm_s = {parameters.cruise_mm_s:g}. Is that their diameter?"
        )
    if robot.axle_track_mm < robot.wheel_diameter_mm / 2:
        yield (
            f"robot.axle_track_mm: wheels of {robot.wheel_diameter_mm:g} mm are unlikely to be only "
            f"{robot.axle_track_mm:g} mm apart; measure between their centres."
        )
