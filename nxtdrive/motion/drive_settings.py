"""How fast a rover moves, and what its wheels allow."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from firmware_protocol.errors import LocalProtocolError
from nxtdrive.motion.lease import LEASE_RANGE_S, LEASE_S
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S
from nxtdrive.ports import in_range

FASTEST_WHEEL_DEG_S = 0.75 * FULL_SPEED_DEG_S
"""Highest speed of a wheel: regulation needs a margin, and at 7.2 V the motor reaches only 770 deg/s."""


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """How fast the rover moves; in `straight`, `turn` and `curve` the faster wheel turns at 10 deg/s or more.

    Attributes:
        speed_mm_s: Highest speed of `straight` and `curve`, above 0; at most that of wheels at `FASTEST_WHEEL_DEG_S`,
            362 with the NXT set's.
        acceleration_mm_s2: Of `straight` and `curve`, speeding up and slowing down; above 0.
        turn_deg_s: Highest turn rate of `turn` and `curve`, above 0; at most that of turning on the spot at that speed,
            371 with the NXT set's wheels and a track of 112 mm.
        turn_acceleration_deg_s2: Of `turn` and `curve`, speeding up and slowing down; above 0.
        lease_s: About how long the robot drives on after the program or the link has died, or `drive` is not called
            again (on a slow link see there), 0.3..10. A wheel's limit is what it turns in this time, at least 20
            degrees.
    """

    speed_mm_s: float = 200.0
    acceleration_mm_s2: float = 400.0
    turn_deg_s: float = 120.0
    turn_acceleration_deg_s2: float = 300.0
    lease_s: float = LEASE_S


USUAL = DriveSettings()
"""Those of a rover with the NXT set's wheels."""


def checked_settings(wheel_diameter_mm: float, axle_track_mm: float, settings: DriveSettings | None) -> DriveSettings:
    """Check sizes and settings of a rover; for None, return the usual settings, as fast as such wheels allow.

    Raises:
        LocalProtocolError: One is not a number, not positive, infinite, or faster than the wheels can turn.
    """
    for name, value in (("wheel_diameter_mm", wheel_diameter_mm), ("axle_track_mm", axle_track_mm)):
        if not 0 < in_range(name, value, -math.inf, math.inf) < math.inf:
            raise LocalProtocolError(f"{name} must be positive and finite, not {value!r}.")
    fastest_mm_s = FASTEST_WHEEL_DEG_S * math.pi * wheel_diameter_mm / 360
    fastest_deg_s = math.degrees(2 * fastest_mm_s / axle_track_mm)
    if settings is None:
        speed_mm_s, turn_deg_s = min(USUAL.speed_mm_s, fastest_mm_s), min(USUAL.turn_deg_s, fastest_deg_s)
        return replace(USUAL, speed_mm_s=speed_mm_s, turn_deg_s=turn_deg_s)
    _check_setting("speed_mm_s", settings.speed_mm_s, fastest_mm_s)
    _check_setting("turn_deg_s", settings.turn_deg_s, fastest_deg_s)
    in_range("lease_s", settings.lease_s, *LEASE_RANGE_S)
    _check_setting("acceleration_mm_s2", settings.acceleration_mm_s2)
    _check_setting("turn_acceleration_deg_s2", settings.turn_acceleration_deg_s2)
    return settings


def _check_setting(name: str, value: float, limit: float = math.inf) -> None:
    if in_range(name, value, -math.inf, math.inf) <= 0 or value > limit:
        most = f" and at most {math.floor(limit)} with these wheels" if math.isfinite(limit) else ""
        raise LocalProtocolError(f"{name} must be above 0{most}, not {value!r}.")
