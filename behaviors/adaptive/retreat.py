"""The state retreat: backing off from what the robot touched, or from what holds its wheels."""

from __future__ import annotations

from behaviors.adaptive.perception import Perception
from behaviors.events import Event, Fact, Reason
from behaviors.motions import ResumableStraight
from behaviors.ports import StopReason


class Retreat:
    """One retreat; reports to the chart that it begins.

    Args:
        perception: What to work with.
        distance_mm: How far to back off.
        stop: Why the robot was stopped.
    """

    def __init__(self, perception: Perception, distance_mm: float, stop: StopReason) -> None:
        self._context = perception.context
        self._straight = ResumableStraight(self._context.body, -distance_mm, perception.world.pose)
        reason = Reason.CONTACT if stop is StopReason.CONTACT else Reason.STALLED
        self._context.report(Fact(Event.BACKING_OFF, reason, {"distance_mm": distance_mm}))

    def call(self) -> None:
        """Back off; called again after an outage, by what is left."""
        self._context.watch.update(self._straight.call().stop, {})
