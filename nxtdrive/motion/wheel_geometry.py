"""Conversion between the counts of two driven wheels and the robot's motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from firmware_protocol.errors import LocalProtocolError
from nxtdrive.ports import in_range

Pair = tuple[float, float]
"""Of the left and of the right wheel."""


def mm_per_degree(wheel_diameter_mm: float, mismatch_percent: float) -> Pair:
    """Return the distance of each wheel per degree.

    Args:
        wheel_diameter_mm: Mean of both wheels.
        mismatch_percent: How much larger the right wheel is than the left one.
    """
    mean, share = math.pi * wheel_diameter_mm / 360.0, mismatch_percent / 200.0
    return mean * (1 - share), mean * (1 + share)


def motor_signs(reversed: bool | tuple[bool, bool]) -> tuple[int, int]:
    """Return 1 for each motor that positive power turns forward, -1 for one that it turns backwards.

    Args:
        reversed: Whether positive power drives the wheels backwards, both or each.

    Raises:
        LocalProtocolError: `reversed` says something else.
    """
    match reversed:
        case bool():
            left = right = reversed
        case [bool(left), bool(right)]:
            pass
        case _:
            raise LocalProtocolError(f"reversed must be True, False or one of these for each wheel, not {reversed!r}.")
    return -1 if left else 1, -1 if right else 1


@dataclass(frozen=True, slots=True)
class WheelGeometry:
    """Two driven wheels.

    Attributes:
        mm_per_deg: Distance each wheel rolls per degree, millimetres, forward positive.
        signs: 1 for each wheel that positive power drives forward, -1 for one that it drives backwards.
        track_mm: Distance between the wheels that fits how far the robot turns.
    """

    mm_per_deg: Pair
    signs: tuple[int, int]
    track_mm: float

    @classmethod
    def of(
        cls,
        wheel_diameter_mm: float,
        axle_track_mm: float,
        *,
        reversed: bool | tuple[bool, bool],
        mismatch_percent: float = 0.0,
        turn_slip_percent: float = 0.0,
    ) -> WheelGeometry:
        """Return the geometry of a robot as it was measured.

        Args:
            wheel_diameter_mm: Mean of both wheels.
            axle_track_mm: Distance between the points where they touch the floor.
            reversed: Whether positive power drives the wheels backwards, both or each.
            mismatch_percent: How much larger the right wheel is than the left one, -20..20.
            turn_slip_percent: Share of each turn that is lost, -20..50.

        Raises:
            LocalProtocolError: One of the percentages is out of range, or `reversed` is neither of these.
        """
        in_range("wheel_mismatch_percent", mismatch_percent, -20, 20)
        in_range("turn_slip_percent", turn_slip_percent, -20, 50)
        track_mm = axle_track_mm / (1 - turn_slip_percent / 100)
        return cls(mm_per_degree(wheel_diameter_mm, mismatch_percent), motor_signs(reversed), track_mm)

    @property
    def mm_per_count(self) -> Pair:
        """Distance of each wheel per degree counted."""
        return self.signs[0] * self.mm_per_deg[0], self.signs[1] * self.mm_per_deg[1]

    def wheels_deg(self, distance_mm: float, turn_deg: float) -> Pair:
        """Return by how many degrees each wheel turns for a distance and a turn, positive right; also speeds."""
        sideways_mm = math.radians(turn_deg) * self.track_mm / 2
        left, right = self.mm_per_deg
        return distance_mm / left + sideways_mm / left, distance_mm / right - sideways_mm / right
