"""What events do to the robot itself: sensors that fail, wheels that slip, hands that lift it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from sim_backend.world.event_tables import Event, Fault
from sim_backend.world.robot import RobotBody

LIFT_MS = 2000
"""How long the robot is in the air by default. A guess."""


@dataclass(slots=True)
class _Running:
    ends_ms: int | None
    undo: Callable[[], None]


@dataclass(slots=True)
class Disturbances:
    """The disturbances that last.

    Attributes:
        robot: The robot.
        faults: How the sensors fail now, by input port.
    """

    robot: RobotBody
    faults: dict[int, Fault] = field(default_factory=dict)
    _running: dict[str, _Running] = field(default_factory=dict)

    def begin(self, event: Event, stays_ms: int | None, now_ms: int) -> None:
        """Begin what a sensor's, wheel's or the robot's event describes."""
        if event.robot:
            stays_ms = LIFT_MS if stays_ms is None else stays_ms
        undo = self._undo(event, stays_ms or 0, now_ms)
        self._running[event.name] = _Running(None if stays_ms is None else now_ms + stays_ms, undo)

    def _undo(self, event: Event, stays_ms: int, now_ms: int) -> Callable[[], None]:
        """Begin it and return what ends it."""
        robot, faults = self.robot, self.faults
        if event.sensor is not None and event.fault is not None:
            port = event.sensor
            faults[port] = event.fault
            return lambda: faults.pop(port, None) and None
        if event.to_mm is not None:
            robot.lift(event.to_mm, event.facing_deg, now_ms, stays_ms)
            return robot.put_down
        slip = (event.slip_percent or 0.0) / 100.0
        left, right = event.wheel != "right", event.wheel != "left"
        robot.slip_wheels(slip if left else None, slip if right else None)
        return lambda: robot.slip_wheels(0.0 if left else None, 0.0 if right else None)

    def advance(self, now_ms: int) -> None:
        """End what has lasted long enough."""
        for name, running in list(self._running.items()):
            if running.ends_ms is not None and now_ms >= running.ends_ms:
                del self._running[name]
                running.undo()

    def ended(self, event: Event) -> bool:
        """Whether the disturbance is over."""
        return event.name not in self._running
