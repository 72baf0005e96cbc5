"""The one way in which every profile reports to the chart what the safety stop does."""

from __future__ import annotations

from collections.abc import Callable

from behaviors.events import Event, Fact, Measured, Reason
from behaviors.ports import Body, StopReason


class ObstacleWatch:
    """Reports to the chart when the safety stop holds or releases the robot, and when the robot touches something.

    Args:
        body: The robot; its sensors are read when something newly holds it.
        report: Reports a fact to the chart.
    """

    def __init__(self, body: Body, report: Callable[[Fact], None]) -> None:
        self._body = body
        self._report = report
        self._stop: StopReason | None = None

    def update(self, stop: StopReason | None, measured: Measured | None = None) -> None:
        """Update with the reason why the last motion stopped; only obstacle and contact hold the robot.

        Args:
            stop: The reason.
            measured: What the sensors ahead measured; None to ask them if the robot is newly held.
        """
        held = stop in (StopReason.OBSTACLE, StopReason.CONTACT)
        if held and not self._stop:
            measured = surroundings(self._body) if measured is None else measured
            self._report(Fact(Event.OBSTACLE, Reason.OBSTACLE_AHEAD, {"stop": stop, **measured}))
        elif self._stop and not held:
            self._report(Fact(Event.OBSTACLE_GONE, Reason.WAY_CLEAR))
        if stop is StopReason.CONTACT and self._stop is not StopReason.CONTACT:
            self._report(Fact(Event.CONTACT, Reason.CONTACT))
        self._stop = stop if held else None


def surroundings(body: Body) -> dict[str, float | bool | None]:
    """Return what the sensors ahead measure, as plain values."""
    return {"range_mm": body.range_mm(), "touching": body.touching()}
