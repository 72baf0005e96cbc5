"""Keep the camera's frames of a run as JPEG files with an index."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import cv2
from pydantic import BaseModel

from nxtdrive.recording.camera_index import INDEX, Header, Look, RecordedFrame
from nxtdrive.recording.output_file import write_file
from nxtdrive.recording.video import VIDEO_FPS
from nxtdrive.vision.camera import frame_number
from nxtdrive.vision.detection import Image

JPEG_QUALITY = 80


@dataclass(slots=True)
class _Pending:
    """The frame of the current slot, which a later look may replace or complete."""

    image: Image
    time_s: float
    slot: int
    looks: list[Look] = field(default_factory=list)


class CameraFolder:
    """Writes at most `VIDEO_FPS` frames for each second of mission time; holds one of them in memory.

    Args:
        path: The folder to make, at the first frame.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._pending: _Pending | None = None
        self._count = 0

    def add(self, image: Image, time_s: float, look: Look | None = None) -> None:
        """Keep `image` if it is the first of its slot of time, or the first that a look used.

        Args:
            image: BGR.
            time_s: When it was taken, mission time, 0 or more.
            look: The result of a look at it.

        Raises:
            OSError: A file cannot be written.
        """
        slot = frame_number(time_s, VIDEO_FPS)
        pending = self._pending
        if pending is not None and slot > pending.slot:
            self._write(pending)
            pending = None
        if pending is None or (look and pending.time_s != time_s and not pending.looks):
            pending = self._pending = _Pending(image, time_s, slot)
        if look and pending.time_s == time_s:
            pending.looks.append(look)

    def close(self) -> None:
        """Write the last frame; may be called again.

        Raises:
            OSError: It cannot be written.
        """
        pending, self._pending = self._pending, None
        if pending is not None:
            self._write(pending)

    def _write(self, pending: _Pending) -> None:
        if not self._count:
            self._path.mkdir(exist_ok=True)
            height, width = pending.image.shape[:2]
            self._write_line(Header(version=1, width=width, height=height, fps=VIDEO_FPS), "wb")
        self._count += 1
        name = f"{self._count:06d}.jpg"
        write_file(self._path / name, jpeg(pending.image))
        self._write_line(RecordedFrame(t=round(pending.time_s, 3), file=name, looks=tuple(pending.looks)), "ab")

    def _write_line(self, line: BaseModel, mode: Literal["wb", "ab"]) -> None:
        with open(self._path / INDEX, mode) as index:
            index.write(line.model_dump_json(exclude_defaults=True).encode() + b"\n")


def jpeg(image: Image) -> bytes:
    """Return a frame of the camera, BGR, as a JPEG file."""
    _, encoded = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
    return encoded.tobytes()
