"""Robots that differ from the mission's description: clutter at targets, wrong dimensions, sensors that die."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from sim_backend.scenarios.effects import SONAR_PORT
from sim_backend.scenarios.room_builder import LOW_BOX_MM, ROBOT, RoomBuilder, RoomGenerator, point_from
from sim_backend.scenarios.rooms import ROOMS, furnished

NARROW_HFOV_DEG = 51.0
"""Field of view of a camera that has 60 degrees in the mission: it sees everything 17 % too near."""
WRONG_PERCENT = (3.0, 8.0)
"""Errors of a wheel's diameter and of the track, measured with a ruler. A guess."""
SLOW_LINK_MS = 300.0
"""Round-trip time of a Bluetooth link that saves power or shares its radio. A guess."""


def _before(random: Random) -> RoomBuilder:
    builder = furnished(random, 2600.0, 3600.0)
    for name, picture in list(builder.pictures.items()):
        for i in range(random.randint(1, 2)):
            ahead, aside = builder.between(260, 480), builder.between(-200, 200)
            at_mm = point_from(picture["at_mm"], picture["facing_deg"], ahead, aside)
            low = random.random() < 0.6
            builder.add_box(
                f"clutter{i} before {name}",
                at_mm,
                (builder.between(60, 160), builder.between(60, 160)),
                builder.between(*(LOW_BOX_MM if low else (120.0, 260.0))),
                facing_deg=builder.between(0, 90),
            )
    return builder


def _mismeasured(random: Random) -> RoomBuilder:
    builder = furnished(random)
    builder.tables["camera"] = {"hfov_deg": NARROW_HFOV_DEG}
    for key in ("wheel_diameter_mm", "track_mm"):
        error = random.choice((-1, 1)) * random.uniform(*WRONG_PERCENT) / 100.0
        builder.robot[key] = round(getattr(ROBOT, key) * (1.0 + error), 2)
    return builder


def _slow_link(random: Random) -> RoomBuilder:
    builder = ROOMS["narrow_door"](random)
    builder.conditions = replace(builder.conditions, latency_ms=SLOW_LINK_MS)
    return builder


def _dead_sonar(random: Random) -> RoomBuilder:
    builder = ROOMS["clutter"](random)
    when = {"at_s": 0.0 if random.random() < 0.5 else builder.between(3, 30)}
    fault = random.choice(("no_echo", "stuck", "unplugged"))
    builder.add_event("the sonar dies", when, sensor=SONAR_PORT, fault=fault)
    return builder


REALITIES: dict[str, RoomGenerator] = {
    "before": _before,
    "mismeasured": _mismeasured,
    "slow_link": _slow_link,
    "dead_sonar": _dead_sonar,
}
"""A function per class of the suite `reality`; see docs/reality.md."""
