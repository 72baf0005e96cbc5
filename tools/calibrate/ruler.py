"""Calibrate the wheels with a ruler: a straight drive and turns on the spot, which a person measures."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from typing import TYPE_CHECKING

from pydantic import ValidationError

from behaviors.mission.mistakes import mistakes
from behaviors.mission.robot import RobotFile, RobotTable
from nxtdrive.mission.body import build_rover

from .course import CalibrationRefused
from .session import CalibrationResult, ReportLine, identified
from .verdict import described, measured

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

STRAIGHT_MM, TURNS = 1000.0, 5
RULER_MM, RULER_DEG, RADIUS_MM = 2.0, 3.0, 5.0
"""Standard errors of distances, turns and the robot's radius as people measure them."""
RADIUS_QUESTION = (
    "How many millimetres is the farthest point of the robot from the middle between its wheels (0: as it was)?"
)
MAX_CORRECTION = 0.3
"""A larger correction is a slip of the pen, or wheels of another size."""
AGAIN = "Measure again; if it is right, end this, and correct the wheels' diameter and track in the robot file first."

DROVE_BACK = (
    "the robot drove back.",
    "Set left_reversed and right_reversed in [robot] of the robot file to the other value, true or false.",
)
TURNED_LEFT = "the robot turned to the left.", "Exchange the ports left and right in [robot] of the robot file."


def _correction(
    ask: Callable[[str], float], question: str, counted: float, backwards: tuple[str, str], beyond: float = 0.0
) -> float:
    """Ask until the answer is plausible: a slip of the pen, or another unit, must not cost the drives so far.

    Args:
        ask: Asks for a number.
        question: What a person measured.
        counted: What the wheels counted.
        backwards: What it means that the robot moved the other way, and what to do then.
        beyond: What the answer is measured from.

    Returns:
        The ratio of what was measured to what the wheels counted.

    Raises:
        CalibrationRefused: The robot moved the other way.
    """
    text = question
    while True:
        really = beyond + ask(text)
        if really < 0:
            raise CalibrationRefused(backwards[0], remedy=backwards[1])
        ratio = really / counted
        if abs(ratio - 1) <= MAX_CORRECTION:
            return ratio
        text = f"That is {ratio:.0%} of what the wheels counted. {AGAIN} {question}"


def _ask_radius(ask: Callable[[str], float], track_mm: float) -> float:
    """Ask until the robot's radius is plausible; 0 for that of the robot file."""
    text = RADIUS_QUESTION
    while radius_mm := ask(text):
        if radius_mm < track_mm / 2:
            wrong = f"A radius of {radius_mm:g} mm does not reach the wheels, which are {track_mm:g} mm apart."
        else:
            try:
                return RobotTable(radius_mm=round(radius_mm, 1)).radius_mm
            except ValidationError as error:
                wrong = f"{'; '.join(mistakes(error, RobotTable))}."
        text = f"{wrong} {RADIUS_QUESTION}"
    return 0.0


def calibrate_by_ruler(
    brick: Brick,
    before: RobotFile,
    today: datetime.date,
    ready: Callable[[str], None],
    ask: Callable[[str], float],
) -> CalibrationResult:
    """Drive and turn, ask how far, and return the resulting robot file.

    Args:
        brick: The brick.
        before: The robot file so far.
        today: The date for the file.
        ready: Called with what to do; returns when that is done.
        ask: Asks for a number.

    Raises:
        CalibrationRefused: The measurement is impossible, or something stopped the robot.
    """
    robot, identity = before.robot, identified(brick, before)
    values = _measure(brick, robot, ready, ask)
    errors = {
        "wheel_diameter_mm": values["wheel_diameter_mm"] * RULER_MM / STRAIGHT_MM,
        "axle_track_mm": values["axle_track_mm"] * (RULER_MM / STRAIGHT_MM + RULER_DEG / 360 / TURNS),
        "radius_mm": RADIUS_MM,
    }
    wheels = measured("ruler", {key: errors[key] for key in values}, today)
    tables: dict[str, dict[str, object]] = {
        "robot": {**values, "turn_slip_percent": 0.0},
        "calibration": {**identity, "wheels": wheels},
    }
    file = described(before, tables, "Measure again, in millimetres.")
    lines = [ReportLine(f"robot.{key}", getattr(robot, key), value, errors[key]) for key, value in values.items()]
    return CalibrationResult(file, lines, None, 0)


def _measure(
    brick: Brick, robot: RobotTable, ready: Callable[[str], None], ask: Callable[[str], float]
) -> dict[str, float]:
    """Return diameter and track, and the radius if there is another one."""
    rover = build_rover(brick, robot)
    ready("Mark where the wheels stand. Then the robot drives one metre ahead.")
    straight = rover.straight(STRAIGHT_MM)
    if not straight.done:
        raise CalibrationRefused(f"the drive was ended: {straight.stop}.", remedy="Clear the floor and start again.")
    longer = _correction(
        ask, "How many millimetres did it drive (negative: backwards)?", straight.distance_mm, DROVE_BACK
    )
    ready(f"Mark where it points. Then it turns {TURNS} times to the right.")
    turn = rover.turn(360.0 * TURNS)
    if not turn.done:
        raise CalibrationRefused(f"the turn was ended: {turn.stop}.", remedy="Clear the floor and start again.")
    question = f"How many degrees beyond {TURNS} full turns did it turn to the right (negative: fewer)?"
    turned_more = _correction(ask, question, turn.turned_deg, TURNED_LEFT, beyond=360.0 * TURNS)
    diameter_mm = round(robot.wheel_diameter_mm * longer, 2)
    track_mm = round(robot.turning_track_mm * longer / turned_more, 1)  # by which the turns were counted
    values = {"wheel_diameter_mm": diameter_mm, "axle_track_mm": track_mm}
    if radius_mm := _ask_radius(ask, track_mm):
        values["radius_mm"] = radius_mm
    return values
