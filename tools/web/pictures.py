"""The camera's frames for the pages, and the map's layers as images."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.recording.video import VIDEO_FPS

from .hub import FRAME, Hub

if TYPE_CHECKING:
    from nxtdrive.recording.recording import Recording
    from nxtdrive.vision.camera import Frame

JPEG_QUALITY = 80


class PictureFeed:
    """Sends each of the camera's frames to the hub, and some of them to a mission's recording.

    Args:
        hub: Where frames go, while there are clients.

    Attributes:
        fps: Frames a second asked of a simulated camera.
        caption: The running mission's recording, if there is one.
        latest: The latest frame's image, if there is one.
    """

    fps = 20

    def __init__(self, hub: Hub) -> None:
        self.caption: Recording | None = None
        self._hub = hub
        self.latest: NDArray[np.uint8] | None = None

    def frame(self, frame: Frame) -> None:
        """Take a frame; for a webcam in its own thread."""
        self.latest = frame.image
        if self._hub.watched:
            _, jpeg = cv2.imencode(".jpg", frame.image, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
            self._hub.show_image(FRAME, frame.index, frame.time_s, jpeg.tobytes())
        recording = self.caption
        if recording is not None and frame.index % (self.fps // VIDEO_FPS) == 0:
            recording.frame(frame)


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
