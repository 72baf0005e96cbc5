"""Writes ``camera.mp4``: the camera's frames with boxes, state and time."""

from __future__ import annotations

import errno
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from firmware_protocol.errors import ConfigError

Image = npt.NDArray[np.uint8]

VIDEO_FPS = 5
"""Frames per second of mission time: every second or third frame of a webcam, enough for a slow robot."""


class VideoRecorder:
    """A video with a constant frame rate in mission time.

    Args:
        path: The file to write.
        fps: Frames per second of mission time.
    """

    def __init__(self, path: Path, fps: int = VIDEO_FPS) -> None:
        self._path = path
        self._fps = fps
        self._writer: cv2.VideoWriter | None = None
        self._start_s = 0.0
        self._slot = 0
        self._shown: Image | None = None

    def add(self, image: Image, time_s: float, *, instead: bool = False) -> None:
        """Show `image` from `time_s` until the next one; of two in the same slot the first stays.

        Args:
            image: Shape (height, width, 3), dtype uint8, BGR; all of one size.
            time_s: Mission time; must not decrease.
            instead: Replace an image that is in this slot already.

        Raises:
            ConfigError: The file cannot be written.
        """
        if self._shown is None:
            self._open(image)
            self._start_s = time_s
        slot = int((time_s - self._start_s) * self._fps + 1e-6)
        later = slot > self._slot
        if later:
            self._write(slot - self._slot)
            self._slot = slot
        if later or instead or self._shown is None:
            self._shown = image

    def close(self) -> None:
        """Finish the file; may be called again.

        Raises:
            OSError: It is damaged, as on a full disk, and removed; OpenCV does not say so earlier.
        """
        if self._writer is not None:
            self._write(1)
            self._writer.release()
            self._writer = None
            if not cv2.VideoCapture(str(self._path)).isOpened():
                self._path.unlink(missing_ok=True)  # which makes room for the rest of a run's folder
                raise OSError(errno.EIO, "the video is incomplete, as on a full disk", str(self._path))

    def _open(self, image: Image) -> None:
        height, width = image.shape[:2]
        code = cv2.VideoWriter.fourcc(*"mp4v")
        self._writer = cv2.VideoWriter(str(self._path), code, self._fps, (width, height))
        if not self._writer.isOpened():
            raise ConfigError(f"{self._path}: the video cannot be written.", remedy="Choose another folder with --out.")

    def _write(self, times: int) -> None:
        if self._writer is not None and self._shown is not None:
            for _ in range(times):
                self._writer.write(self._shown)
