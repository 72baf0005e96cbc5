"""Writes ``camera.mp4``: what the camera saw, with boxes, state and time drawn in."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from firmware_protocol.errors import ConfigError

Image = npt.NDArray[np.uint8]

VIDEO_FPS = 5
"""Frames per second of mission time; every third or second frame of a webcam, enough to follow a slow robot."""


class VideoRecorder:
    """A film at a constant rate of mission time.

    Args:
        path: The file to write.
        fps: Frames per second of mission time.
    """

    def __init__(self, path: Path, fps: int = VIDEO_FPS) -> None:
        self._path = path
        self._fps = fps
        self._writer: cv2.VideoWriter | None = None
        self._written = 0
        self._start_s: float | None = None

    def due(self, time_s: float) -> bool:
        """Whether a frame of this time would be written, so that nobody draws for nothing."""
        return self._start_s is None or self._slot(time_s) >= self._written

    def add(self, image: Image, time_s: float) -> None:
        """Show `image` from `time_s` on; times between two frames repeat the earlier one.

        Args:
            image: Shape (height, width, 3), dtype uint8, BGR; all of one size.
            time_s: Mission time; must not go back.

        Raises:
            ConfigError: The file cannot be written.
        """
        if self._writer is None:
            self._open(image)
            self._start_s = time_s
        elif not self.due(time_s):
            return
        # a stretch without frames repeats the new one; the film keeps the mission's time either way
        for _ in range(self._slot(time_s) - self._written + 1):
            self._write(image)

    def close(self) -> None:
        """Finish the file; may be called again."""
        if self._writer is not None:
            self._writer.release()
            self._writer = None

    def _slot(self, time_s: float) -> int:
        return int((time_s - (self._start_s or 0.0)) * self._fps + 1e-6)

    def _open(self, image: Image) -> None:
        height, width = image.shape[:2]
        code = cv2.VideoWriter.fourcc(*"mp4v")
        self._writer = cv2.VideoWriter(str(self._path), code, self._fps, (width, height))
        if not self._writer.isOpened():
            raise ConfigError(f"{self._path}: the video cannot be written.", remedy="Choose another folder with --out.")

    def _write(self, image: Image) -> None:
        if self._writer is not None:
            self._writer.write(image)
            self._written += 1
