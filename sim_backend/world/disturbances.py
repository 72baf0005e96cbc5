"""Effects of events on the robot itself: devices that fail, wheels that slip, a turned camera, and being lifted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, cast

from sim_backend.world.event_tables import CameraFault, Event, Fault, Wheel
from sim_backend.world.robot import RobotBody

LIFT_MS = 2000
"""How long the robot is in the air by default. A guess."""

_Part = int | Wheel | Literal["camera", "mounting", "robot"]
"""Input port of a sensor, wheel, camera, how that is mounted, or the robot."""


@dataclass(slots=True)
class Disturbances:
    """The disturbances that last.

    Attributes:
        robot: The robot.
        faults: How the sensors fail now, by input port.
        camera: How the camera fails now; None if it works.
        yaw_deg: How far the camera is turned now from where it was mounted, positive right.
    """

    robot: RobotBody
    faults: dict[int, Fault] = field(default_factory=dict)
    camera: CameraFault | None = None
    yaw_deg: float = 0.0
    # by what an event disturbs, so that a later one takes the place of an earlier one
    _running: dict[_Part, tuple[Event, int | None]] = field(default_factory=dict)

    def begin(self, event: Event, stays_ms: int | None, now_ms: int) -> None:
        """Begin the disturbance of a sensor's, wheel's, the camera's or the robot's event."""
        if event.sensor is not None:
            self.faults[event.sensor] = cast("Fault", event.fault)
        elif event.wheel is not None:
            self._disturb_wheel(event.wheel, (event.slip_percent or 0.0) / 100.0, plugged=event.fault is None)
        elif event.yaw_deg is not None:
            self.yaw_deg = event.yaw_deg
        elif event.camera:
            self.camera = cast("CameraFault", event.fault)
        elif event.to_mm is not None:
            stays_ms = LIFT_MS if stays_ms is None else stays_ms
            self.robot.lift(event.to_mm, event.facing_deg, now_ms, stays_ms)
        for part in _parts(event):
            self._running[part] = event, None if stays_ms is None else now_ms + stays_ms

    def _end(self, part: _Part) -> None:
        if isinstance(part, int):
            self.faults.pop(part, None)
        elif part == "camera":
            self.camera = None
        elif part == "mounting":
            self.yaw_deg = 0.0
        elif part == "robot":
            self.robot.put_down()
        else:
            self._disturb_wheel(part, 0.0, plugged=True)

    def _disturb_wheel(self, wheel: Wheel, slip: float, *, plugged: bool) -> None:
        self.robot.slip_wheels(slip if wheel != "right" else None, slip if wheel != "left" else None)
        for side, motor in (("left", self.robot.left), ("right", self.robot.right)):
            if wheel in (side, "both"):
                motor.plugged = plugged

    def advance(self, now_ms: int) -> None:
        """End disturbances that have lasted long enough."""
        for part, (_, ends_ms) in list(self._running.items()):
            if ends_ms is not None and now_ms >= ends_ms:
                del self._running[part]
                self._end(part)

    def ended(self, event: Event) -> bool:
        """Return whether the disturbance is over."""
        return all(running.name != event.name for running, _ in self._running.values())


def _parts(event: Event) -> Sequence[_Part]:
    """Return what an event disturbs."""
    if event.wheel == "both":
        return "left", "right"
    if event.camera:
        return ("camera" if event.fault else "mounting",)
    return (event.sensor or event.wheel or "robot",)
