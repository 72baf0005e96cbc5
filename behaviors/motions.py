"""Motions that an outage may interrupt: called again, they complete the rest, by odometry."""

from __future__ import annotations

from dataclasses import replace

from behaviors.ports import Body, MotionResult, Pose


class ResumableTurn:
    """A turn on the spot.

    Args:
        body: The robot.
        angle_deg: How far, positive right.
        begin: Where the robot is now.

    Attributes:
        done: Whether it is over, for any reason.
    """

    def __init__(self, body: Body, angle_deg: float, begin: Pose) -> None:
        self.done = False
        self._body = body
        self._angle_deg = angle_deg
        self._goal_deg = begin.heading_deg + angle_deg
        self._begun = False

    def call(self) -> MotionResult:
        """Turn by the remaining angle; the result is that of the whole turn."""
        left_deg = self._goal_deg - self._body.pose().heading_deg if self._begun else self._angle_deg
        self._begun = True
        result = self._body.turn(left_deg)
        self.done = True
        return replace(result, turned_deg=self._angle_deg - left_deg + result.turned_deg)


class ResumableStraight:
    """A drive along the heading.

    Args:
        body: The robot.
        distance_mm: How far, negative: back.
        begin: Where the robot is now.
    """

    def __init__(self, body: Body, distance_mm: float, begin: Pose) -> None:
        self._body = body
        self._distance_mm = distance_mm
        self._begin = begin
        self._begun = False

    def call(self) -> MotionResult:
        """Drive the remaining distance; the result is that of the whole drive."""
        driven_mm = self._begin.forward_mm_to(self._body.pose()) if self._begun else 0.0
        left_mm = self._distance_mm - driven_mm
        self._begun = True
        result = self._body.straight(left_mm)
        return replace(result, distance_mm=driven_mm + result.distance_mm)
