"""What the driver's hands want: direction, speed, and above all a stop.

A terminal reports keys going down, again and again while they are held, and never one going up. So a key counts for a
moment only: whoever lets go, falls asleep or loses the connection stops the robot. A gamepad says where its sticks are,
as often as it is asked.
"""

from __future__ import annotations

from enum import Enum

DEAD_MAN_S = 0.5
"""For so long a key counts."""
SLOWEST_PERCENT, STEP_PERCENT = 20, 10
"""Of the highest speeds."""


_Held = tuple[float, float, float]
"""Parts of the highest speed and turn rate, and when they were reported."""


class Direction(Enum):
    """Where to: parts of the highest speed and of the highest turn rate, positive right."""

    FORWARD = (1.0, 0.0)
    BACK = (-1.0, 0.0)
    LEFT = (0.0, -1.0)
    RIGHT = (0.0, 1.0)
    FORWARD_LEFT = (1.0, -0.5)
    FORWARD_RIGHT = (1.0, 0.5)


class Controls:
    """Keys and sticks in, speeds out; may be used by the thread that sees them and the one that drives.

    A stick that is moved wins over a key. A stick counts as long as somebody reports it, and for a moment longer. After
    every stop that is not the stick's own doing, and at first, it drives only when it has been in the middle: whoever
    ends an emergency or plugs a gamepad in does not drive by that.

    Args:
        speed_mm_s: Highest speed.
        turn_deg_s: Highest turn rate.

    Attributes:
        stopped: Whether the emergency stop holds; then nothing drives until `release`.
        percent: Of the highest speeds.
    """

    def __init__(self, speed_mm_s: float, turn_deg_s: float) -> None:
        self._speed_mm_s, self._turn_deg_s = speed_mm_s, turn_deg_s
        self._key: _Held | None = None
        self._stick: _Held | None = None
        self._stick_free = False
        self.stopped = False
        self.percent = 60

    def press(self, direction: Direction, now_s: float) -> None:
        """A key is down."""
        if not self.stopped:
            self._key = (*direction.value, now_s)

    def steer(self, ahead: float, aside: float, now_s: float) -> None:
        """A stick is there: parts of the highest speed and turn rate, -1..1, positive right; zeros are its middle."""
        moved = bool(ahead or aside)
        self._stick_free = self._stick_free or not moved
        self._stick = (ahead, aside, now_s) if moved and self._stick_free and not self.stopped else None

    def let_go_of_keys(self) -> None:
        """Nobody's hand is on the keys."""
        self._key = None

    def let_go(self) -> None:
        """Stop, without an emergency."""
        self._key = self._stick = None
        self._stick_free = False

    def emergency_stop(self) -> None:
        """Stop, and stay so."""
        self.stopped = True
        self.let_go()

    def release(self) -> None:
        """End the emergency; what is pressed or moved meanwhile does not count."""
        self.let_go()
        self.stopped = False

    def faster(self, step_percent: int = STEP_PERCENT) -> None:
        """Change the speed, also of what is held."""
        self.percent = min(100, max(SLOWEST_PERCENT, self.percent + step_percent))

    def wanted(self, now_s: float) -> tuple[float, float]:
        """Speed in mm/s and turn rate in deg/s, positive right, wanted at `now_s`; zeros are a stop."""
        for held in (self._stick, self._key):
            if held is not None and now_s - held[2] <= DEAD_MAN_S and not self.stopped:
                part = self.percent / 100
                return held[0] * self._speed_mm_s * part, held[1] * self._turn_deg_s * part
        return 0.0, 0.0
