"""The simulation's true room, as a layer of the map: for people who watch; never read by code that drives the robot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from nxtdrive.mission.truth import simulated_room_of

from .hub import Hub

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

EVERY_S = 0.5
"""Minimum time between two messages, by the robot's clock."""


class TrueRoom:
    """Shows where everything really is, in the frame of the robot's odometry; shows nothing for a real robot.

    Args:
        brick: Its odometry begins now.
        hub: Gets messages while there are clients.
    """

    def __init__(self, brick: Brick, hub: Hub) -> None:
        self._brick = brick
        self._hub = hub
        self._room = simulated_room_of(brick)
        self._shown_s = -math.inf

    def show(self) -> None:
        """Send the room and the robot's true pose, if some time has passed since the last time."""
        now_s = self._brick.now()
        if self._room is None or not self._hub.watched or now_s - self._shown_s < EVERY_S:
            return
        self._shown_s = now_s
        self._hub.show(
            "true_room", {"pose": list(self._room.pose()), "lines": [list(each) for each in self._room.outlines()]}
        )
