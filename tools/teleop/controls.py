"""Input state of teleoperation: direction, speed and stops.

A terminal reports key presses, repeated while the key is held, but no releases. So a key counts for a moment only:
the robot stops when the operator lets go or the connection is lost. A gamepad reports the positions of its sticks
whenever it is polled.
"""

from __future__ import annotations

from enum import Enum

DEAD_MAN_S = 0.5
"""How long a key press counts."""
SLOWEST_PERCENT, STEP_PERCENT = 20, 10
"""Of the highest speeds."""


_Held = tuple[float, float, float]
"""Shares of the highest speed and turn rate, and when they were reported."""


class Direction(Enum):
    """Directions as shares of the highest speed and of the highest turn rate, positive right."""

    FORWARD = (1.0, 0.0)
    BACK = (-1.0, 0.0)
    LEFT = (0.0, -1.0)
    RIGHT = (0.0, 1.0)
    FORWARD_LEFT = (1.0, -0.5)
    FORWARD_RIGHT = (1.0, 0.5)


class Controls:
    """Converts keys and sticks to speeds; may be used by the input thread and the driving thread.

    A deflected stick takes precedence over a key. A stick counts while it is reported, and for a moment longer. At
    first, and after every stop that the stick did not cause, it must return to its centre before it drives: releasing
    an emergency stop or plugging in a gamepad must not start the robot.

    Args:
        speed_mm_s: Highest speed.
        turn_deg_s: Highest turn rate.

    Attributes:
        stopped: Whether the emergency stop is active; then nothing drives until `release`.
        percent: Percentage of the highest speeds.
    """

    def __init__(self, speed_mm_s: float, turn_deg_s: float) -> None:
        self._speed_mm_s, self._turn_deg_s = speed_mm_s, turn_deg_s
        self._key: _Held | None = None
        self._stick: _Held | None = None
        self._stick_free = False
        self.stopped = False
        self.percent = 60

    @property
    def awaits_centre(self) -> bool:
        """Whether a stick must return to its centre before it drives."""
        return not self._stick_free

    def press(self, direction: Direction, now_s: float) -> None:
        """Note that a key is pressed."""
        if not self.stopped:
            self._key = (*direction.value, now_s)

    def steer(self, ahead: float, turn: float, now_s: float) -> None:
        """Note a stick's position: shares of the highest speed and turn rate, -1..1, positive right; zeros: centred."""
        moved = bool(ahead or turn)
        self._stick_free = self._stick_free or not moved
        self._stick = (ahead, turn, now_s) if moved and self._stick_free and not self.stopped else None

    def release_keys(self) -> None:
        """Forget the pressed key."""
        self._key = None

    def set_neutral(self) -> None:
        """Set all controls to neutral, which stops the robot; no emergency stop."""
        self._key = self._stick = None
        self._stick_free = False

    def emergency_stop(self) -> None:
        """Stop, and stay stopped until `release`."""
        self.stopped = True
        self.set_neutral()

    def release(self) -> None:
        """End the emergency stop; keys and sticks used during it do not count."""
        self.set_neutral()
        self.stopped = False

    def faster(self, step_percent: int) -> None:
        """Change the speed, even of a held key or stick."""
        self.percent = min(100, max(SLOWEST_PERCENT, self.percent + step_percent))

    def wanted(self, now_s: float) -> tuple[float, float]:
        """Return the wanted speed in mm/s and turn rate in deg/s, positive right, at `now_s`; zeros are a stop."""
        for held in (self._stick, self._key):
            if held is not None and now_s - held[2] <= DEAD_MAN_S and not self.stopped:
                limit = self.percent / 100
                return held[0] * self._speed_mm_s * limit, held[1] * self._turn_deg_s * limit
        return 0.0, 0.0
