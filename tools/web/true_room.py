"""The simulation's true room, as a layer of the map: for people who watch; nothing that drives the robot reads it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from nxtdrive.mission.truth import truth_of

from .hub import Hub

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

EVERY_S = 0.5


class TrueRoom:
    """Shows where everything really is, in the frame of the robot's odometry; shows nothing for a real robot.

    Args:
        brick: Its odometry begins now.
        hub: Told while there are clients.
    """

    def __init__(self, brick: Brick, hub: Hub) -> None:
        self._brick = brick
        self._hub = hub
        self._truth = truth_of(brick)
        self._origin: tuple[float, float, float] = self._truth.pose if self._truth else (0.0, 0.0, 0.0)
        self._shown_s = -math.inf

    def show(self) -> None:
        """Send the room and the robot's true pose, if some time has passed since the last time."""
        now_s = self._brick.now()
        if self._truth is None or not self._hub.watched or now_s - self._shown_s < EVERY_S:
            return
        self._shown_s = now_s
        x, y, heading_deg = self._truth.pose
        pose = [*self._from_start(x, y), round(heading_deg - self._origin[2], 1)]
        lines = [[*self._from_start(x0, y0), *self._from_start(x1, y1)] for x0, y0, x1, y1 in self._truth.lines()]
        self._hub.show("true_room", {"pose": pose, "lines": lines})

    def _from_start(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Turn a place on the world's map into one of the start's frame: x forward, y to the right."""
        x0, y0, heading_deg = self._origin
        angle = math.radians(heading_deg)
        dx, dy = x_mm - x0, y_mm - y0
        forward, right = dx * math.cos(angle) + dy * math.sin(angle), dy * math.cos(angle) - dx * math.sin(angle)
        return round(forward, 1), round(right, 1)
