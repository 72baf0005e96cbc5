"""What the driver's hands want: direction, speed, and above all a stop.

A terminal reports keys going down, again and again while they are held, and never one going up. So a key counts for a
moment only: whoever lets go, falls asleep or loses the connection stops the robot.
"""

from __future__ import annotations

from enum import Enum

DEAD_MAN_S = 0.5
"""For so long a key counts."""
SLOWEST_PERCENT, STEP_PERCENT = 20, 10
"""Of the highest speeds."""


class Direction(Enum):
    """Where to: parts of the highest speed and of the highest turn rate, positive right."""

    FORWARD = (1.0, 0.0)
    BACK = (-1.0, 0.0)
    LEFT = (0.0, -1.0)
    RIGHT = (0.0, 1.0)
    FORWARD_LEFT = (1.0, -0.5)
    FORWARD_RIGHT = (1.0, 0.5)


class Controls:
    """Keys in, speeds out; may be used by the thread that sees the keys and the one that drives.

    Args:
        speed_mm_s: Highest speed.
        turn_deg_s: Highest turn rate.

    Attributes:
        stopped: Whether the emergency stop holds; then no key drives until `release`.
        percent: Of the highest speeds.
    """

    def __init__(self, speed_mm_s: float, turn_deg_s: float) -> None:
        self._speed_mm_s, self._turn_deg_s = speed_mm_s, turn_deg_s
        self._held: tuple[Direction, float] | None = None
        self.stopped = False
        self.percent = 60

    def press(self, direction: Direction, now_s: float) -> None:
        """A key is down."""
        self._held = (direction, now_s)

    def let_go(self) -> None:
        """Stop, without an emergency."""
        self._held = None

    def emergency_stop(self) -> None:
        """Stop, and stay so."""
        self.stopped, self._held = True, None

    def release(self) -> None:
        """End the emergency; keys pressed meanwhile do not count."""
        self._held, self.stopped = None, False

    def faster(self, step_percent: int = STEP_PERCENT) -> None:
        """Change the speed, also of the key that is down."""
        self.percent = min(100, max(SLOWEST_PERCENT, self.percent + step_percent))

    def wanted(self, now_s: float) -> tuple[float, float]:
        """Speed in mm/s and turn rate in deg/s, positive right, wanted at `now_s`; zeros are a stop."""
        held = self._held
        if self.stopped or held is None or now_s - held[1] > DEAD_MAN_S:
            return 0.0, 0.0
        ahead, aside = held[0].value
        return ahead * self._speed_mm_s * self.percent / 100, aside * self._turn_deg_s * self.percent / 100
