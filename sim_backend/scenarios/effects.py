"""One effect of real robots per class, each in the same room for a seed, so that `plain` shows the cost of the effect.

The ranges are those of docs/reality.md, which names their sources. The mission does not get these values.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from random import Random

from sim_backend.scenarios.room_builder import FREE_START_MM, ROBOT_RADIUS_MM, RoomBuilder, point_from
from sim_backend.scenarios.rooms import add_boxes, furnished

PLAIN = "plain"
BUMPER_PORT, SONAR_PORT = 1, 4

Effect = Callable[[RoomBuilder], None]
"""Switches the effect on in a room, drawing from the room's random generator."""


def generate_plain(random: Random) -> RoomBuilder:
    """Generate a room with both targets near its walls and a few boxes."""
    builder = furnished(random, 2600.0, 3600.0)
    add_boxes(builder, random.randint(2, 4))
    return builder


def _plain(_builder: RoomBuilder) -> None:
    """Switch nothing on."""


def _camera(**ranges: tuple[float, float]) -> Effect:
    """Return the effect of a camera whose values are drawn from ranges."""

    def switch_on(builder: RoomBuilder) -> None:
        builder.tables["camera"] = {key: round(builder.random.uniform(*ends), 3) for key, ends in ranges.items()}

    return switch_on


def _any_height(builder: RoomBuilder) -> None:
    builder.tables["camera"] = {"height_mm": builder.between(100, 250)}
    for picture in builder.pictures.values():
        picture["centre_height_mm"] = builder.between(80, 450)


def _changing_light(builder: RoomBuilder) -> None:
    random = builder.random
    builder.tables["camera"] = {"auto_exposure_s": builder.between(0.5, 2.0)}
    builder.tables["light"] = {"drift_percent": builder.between(30, 80), "drift_s": builder.between(10, 60)}
    builder.tables["shades"] = [
        {
            "at_mm": builder.place(300.0),
            "radius_mm": builder.between(300, 900),
            "exposure": round(random.choice((random.uniform(0.03, 0.2), random.uniform(4, 10))), 2),
        }
        for _ in range(2)
    ]


def _slow_computer(builder: RoomBuilder) -> None:
    builder.tables["computer"] = {"look_s": builder.between(0.3, 1.0)}


def _backlash(builder: RoomBuilder) -> None:
    builder.robot["backlash_deg"] = builder.between(4, 12)


def _carpets(builder: RoomBuilder) -> None:
    random = builder.random
    builder.tables["carpets"] = [
        {
            "at_mm": builder.place(400.0),
            "size_mm": (builder.between(600, 1400), builder.between(600, 1400)),
            "facing_deg": builder.between(0, 90),
            "grip": round(random.uniform(0.4, 0.8), 2),
            "drag_nm": round(random.uniform(0.002, 0.02), 4),
            "slip": {
                "distance_percent": builder.between(2, 12),
                "turn_percent": builder.between(5, 30),
                "veer_deg_per_m": builder.between(-10, 10),
                "jitter_percent": builder.between(3, 10),
            },
        }
        for _ in range(3)
    ]


def _wheel_slips(builder: RoomBuilder) -> None:
    wheel, slip_percent = builder.random.choice(("left", "right")), builder.between(15, 70)
    when = {"at_s": 0, "delay_s": (3, 15)}
    builder.add_event("a wheel slips", when, times=0, wheel=wheel, slip_percent=slip_percent, stays_s=(20, 120))


def _weak_battery(builder: RoomBuilder) -> None:
    random = builder.random
    builder.robot |= {
        "battery_mv": random.randint(6300, 7400),
        "battery_ohm": round(random.uniform(0.9, 2.0), 2),
        "battery_drain_mv_per_min": builder.between(20, 150),
        "dead_zone_percent": random.randint(8, 15),
    }


def _kidnapped(builder: RoomBuilder) -> None:
    plan = builder.plan()
    for target in builder.targets:
        to_mm = builder.start_mm
        for _ in range(100):
            to_mm = builder.place(300.0)
            far = math.dist(to_mm, builder.pictures[target]["at_mm"]) > 1000.0
            if far and plan.is_free(to_mm, ROBOT_RADIUS_MM + FREE_START_MM):
                break
        builder.add_event(
            f"carried away from {target}",
            {"sees": target, "for_s": builder.between(1, 3)},
            robot=True,
            to_mm=to_mm,
            facing_deg=builder.between(0, 360),
            stays_s=builder.between(1, 4),
        )


def _soft_things(builder: RoomBuilder) -> None:
    for box in builder.boxes:
        box["absorbs"] = builder.random.random() < 0.7
    at, along_deg = builder.place(850.0), builder.between(0, 180)
    half_mm = builder.between(300, 600)
    builder.add_wall(*(point_from(at, along_deg, side * half_mm) for side in (-1, 1)), absorbs=True)


def _fails(port: int, *faults: str) -> Effect:
    """Return the effect of a sensor that fails after a while."""

    def switch_on(builder: RoomBuilder) -> None:
        when = {"at_s": builder.between(0, 20)}
        builder.add_event("a sensor fails", when, sensor=port, fault=builder.random.choice(faults))

    return switch_on


EFFECTS: dict[str, Effect] = {
    PLAIN: _plain,
    "mounted": _camera(right_mm=(-30, 30), yaw_deg=(-5, 5), tilt_deg=(-6, 6), roll_deg=(-5, 5)),
    "any_height": _any_height,
    "late_frames": _camera(latency_s=(0.1, 0.4)),
    "lens": _camera(distortion_k1=(-0.25, 0.1)),
    "rolling_shutter": _camera(readout_s=(0.03, 0.06)),
    "lost_frames": _camera(drop_rate=(0.2, 0.6)),
    "changing_light": _changing_light,
    "slow_computer": _slow_computer,
    "backlash": _backlash,
    "carpets": _carpets,
    "wheel_slips": _wheel_slips,
    "weak_battery": _weak_battery,
    "kidnapped": _kidnapped,
    "soft_things": _soft_things,
    "loose_sonar": _fails(SONAR_PORT, "error"),
    "dead_bumper": _fails(BUMPER_PORT, "stuck", "unplugged"),
}
"""A function per class, which switches its effect on; see docs/reality.md."""
