"""The camera's latest frame with what was detected, small enough for a terminal; older frames are dropped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from behaviors.ports import Sighting
from nxtdrive.vision.annotate import CONFIRMED, UNCONFIRMED
from nxtdrive.vision.camera import Frame
from nxtdrive.vision.detection import Detection, Image

FPS = 10.0
"""Frames a second asked of a simulated camera, and shown at most."""
BOXES_LAST_S = 1.0
"""Boxes of a look are drawn into the frames after it for this long."""
STALE_S = 1.0
"""A frame of this age is too old to drive by."""


@dataclass(frozen=True, slots=True)
class Look:
    """The result of one look; its frame may be older than the latest one."""

    frame: Frame
    boxes: tuple[tuple[tuple[int, int, int, int], tuple[int, int, int]], ...]


class LatestFrame:
    """Takes frames from the camera's thread and looks from the spotter's, and keeps the latest for the screen."""

    def __init__(self) -> None:
        self._frame: Frame | None = None
        self._look: Look | None = None

    def frame(self, frame: Frame) -> None:
        """Note the latest frame."""
        self._frame = frame

    def look(self, frame: Frame, _target: str, sighting: Sighting | None, detections: Sequence[Detection]) -> None:
        """Keep the result of a look; see `nxtdrive.vision.target_vision.OnLook`."""
        boxes = [(detection.box, UNCONFIRMED) for detection in detections]
        if sighting is not None:
            boxes = [(box, color) for box, color in boxes if box != sighting.box] + [(sighting.box, CONFIRMED)]
        self._look = Look(frame, tuple(boxes))

    @property
    def aspect(self) -> float:
        """Height of the latest frame by its width; of a common webcam before the first one."""
        newest = self._newest()
        return 0.75 if newest is None else newest.image.shape[0] / newest.image.shape[1]

    def age_s(self, now_s: float) -> float | None:
        """Return the age of the latest frame, or None before the first one."""
        newest = self._newest()
        return None if newest is None else max(0.0, now_s - newest.time_s)

    def fitted(self, width: int, height: int) -> Image | None:
        """Return the latest frame, reduced or enlarged to fit, with the boxes of the last look; BGR.

        Args:
            width: Most pixels in a row.
            height: Most rows.
        """
        frame, look = self._newest(), self._look
        if frame is None or width < 1 or height < 1:
            return None
        rows, columns = frame.image.shape[:2]
        scale = min(width / columns, height / rows)
        size = max(1, round(columns * scale)), max(1, round(rows * scale))
        small = cv2.resize(frame.image, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)
        if look is not None and frame.time_s - look.frame.time_s <= BOXES_LAST_S:
            scale = size[0] / look.frame.image.shape[1]
            for box, color in look.boxes:
                left, top, wide, high = (round(part * scale) for part in box)
                cv2.rectangle(small, (left, top), (left + wide, top + high), color, 1)
        return small

    def _newest(self) -> Frame | None:
        """Return the latest frame, of the camera or of a look: a recording is only read by looks."""
        frame, look = self._frame, self._look
        if frame is None or (look is not None and look.frame.time_s > frame.time_s):
            return None if look is None else look.frame
        return frame
