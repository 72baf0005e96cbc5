"""The camera's frames for the pages, and the map's layers as images."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.recording.camera_folder import jpeg
from nxtdrive.recording.video import VIDEO_FPS

from .hub import FRAME, Hub

if TYPE_CHECKING:
    from nxtdrive.vision.camera import Frame

CLASSROOM_FPS, SMALL_FPS = 10, 2
"""Pictures a second of a simulated robot of a classroom, without a mission: while its own page is open, and while only
the classroom's page is."""


class PictureFeed:
    """Sends each of the camera's frames to the hub, and to the recording of a mission.

    Args:
        hub: Where frames go, while there are clients.

    Attributes:
        fps: Frames a second asked of a simulated camera.
        latest: The latest frame's image, if there is one.
    """

    fps = 20

    def __init__(self, hub: Hub) -> None:
        self.latest: NDArray[np.uint8] | None = None
        self._hub = hub
        self._observer: Callable[[Frame], None] | None = None

    def watch(self, observer: Callable[[Frame], None] | None) -> None:
        """Call `observer` with each frame; None ends that."""
        self._observer = observer

    def needs(self, number: int) -> bool:
        """Return whether the frame with a number is needed."""
        if self._observer is not None:
            return number % (self.fps // VIDEO_FPS) == 0
        if self._hub.watched:
            return number % (self.fps // CLASSROOM_FPS) == 0
        return self._hub.small_pictures and number % (self.fps // SMALL_FPS) == 0

    def frame(self, frame: Frame) -> None:
        """Take a frame; for a webcam in its own thread."""
        self.latest = frame.image
        if self._hub.watched:
            self._hub.show_image(FRAME, frame.index, frame.time_s, jpeg(frame.image))
        if (observer := self._observer) is not None:
            observer(frame)


def layer(values: NDArray[np.floating], lowest: float, highest: float) -> bytes:
    """Return a layer of the map as a PNG with one grey channel: black is `lowest`, white `highest`.

    Args:
        values: Indexed [x, y] as in the world model; the image has the farthest x on top and y to the right.
        lowest: Value shown black.
        highest: Value shown white.
    """
    grey = np.clip((values - lowest) / (highest - lowest) * 255.0, 0.0, 255.0).astype(np.uint8)
    _, png = cv2.imencode(".png", np.ascontiguousarray(grey[::-1]))
    return png.tobytes()
