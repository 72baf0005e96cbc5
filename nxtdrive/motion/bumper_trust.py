"""Whether a bumper that is pressed can be: what presses it stays where it is when the robot backs off or turns."""

from __future__ import annotations

from dataclasses import replace

from behaviors.ports import Pose

BACKED_MM = 60.0
TURNED_DEG = 150.0
"""A robot that has backed off or turned this far is clear of what it touched, unless its wheels slip."""
RETREATS = 2
"""A bumper that has stayed pressed over this many such retreats and turns sticks."""


class BumperTrust:
    """Decides from the readings of a bumper and the poses there whether it sticks."""

    def __init__(self) -> None:
        self._start: Pose | None = None
        self._retreats = 0

    def sticks(self, pressed: bool, pose: Pose) -> bool:
        """Add a reading; return whether the bumper sticks, which it does until it is released."""
        if not pressed:
            self._start, self._retreats = None, 0
            return False
        start = self._start = self._start or pose
        forward_mm, turned_deg = start.forward_mm_to(pose), abs(pose.heading_deg - start.heading_deg)
        clear = forward_mm <= -BACKED_MM or turned_deg >= TURNED_DEG
        self._retreats += clear
        if clear or forward_mm > 0.0:
            self._start = replace(pose, heading_deg=pose.heading_deg if clear else start.heading_deg)
        return self._retreats >= RETREATS
