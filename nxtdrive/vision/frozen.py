"""Detection of a camera that hangs and repeats its last frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from behaviors.ports import Pose
from nxtdrive.vision.camera import Frame
from nxtdrive.vision.detection import Image

FROZEN_S = 0.5
"""A camera that repeats its frame for this time after the robot began to move hangs; single ones are usual."""
MOVED_MM, MOVED_DEG = 20.0, 5.0
"""A robot that drove or turned farther than this has moved: a new frame would differ in more than the noise."""
SAMPLED = 8, 40
"""Rows and columns that are compared first, since it takes less time; the noise of a sensor changes some of them."""


class FrozenFrames:
    """Detects frames that stay the same, bit by bit, while the wheels turn.

    The noise of a sensor makes each frame different. A rendered or overexposed view of a robot at rest may stay the
    same, so frames count only while it moves.

    Args:
        pose: Returns the robot's pose by the latest reading of its wheels.
        latency_s: Time from the exposure of a frame to its arrival.
    """

    def __init__(self, pose: Callable[[], Pose], latency_s: float = 0.0) -> None:
        self._pose = pose
        self._within_s = FROZEN_S + latency_s
        self._image: Image | None = None
        self._start = Pose()
        self._moved_s: float | None = None

    def repeats(self, frame: Frame) -> bool:
        """Return whether the camera hangs, by its next frame; it does until a frame differs."""
        if self._image is None or not _same(frame.image, self._image):
            self._image, self._start, self._moved_s = frame.image, self._pose(), None
            return False
        if self._moved_s is None and not self._start.is_near(self._pose(), MOVED_MM, MOVED_DEG):
            self._moved_s = frame.time_s
        return self._moved_s is not None and frame.time_s - self._moved_s >= self._within_s


def _same(one: Image, other: Image) -> bool:
    if one.shape != other.shape:
        return False
    rows, columns = (max(1, side // number) for side, number in zip(one.shape, SAMPLED, strict=False))
    sampled = slice(None, None, rows), slice(None, None, columns)
    return np.array_equal(one[sampled], other[sampled]) and np.array_equal(one, other)
