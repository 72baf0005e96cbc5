"""Write WebM videos (VP8) with a constant frame rate, and ``camera.webm`` from the camera's frames of a run."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import cv2

from behaviors.journal import Record
from firmware_protocol.errors import ConfigError
from nxtdrive.recording.camera_index import RecordedFrame, RecordedFrames
from nxtdrive.recording.output_file import check_replaceable, draft_path
from nxtdrive.vision.camera import frame_number
from nxtdrive.vision.detection import Image
from nxtdrive.vision.opencv import configure, opencv_name

VIDEO_FPS = 5
"""Frames per second of mission time: every second or third frame of a webcam, enough for a slow robot."""
_SEGMENT = b"\x18\x53\x80\x67"
"""Begins the segment, the rest of a Matroska file after its head; eight bytes of its size follow, 56 bits of which
count."""
_MATROSKA, _WEBM = b"\x42\x82\x88matroska", b"\x42\x82\x84webm\xec\x82\x00\x00"
"""The document type of a Matroska file and, of the same length, of a WebM file. Source: RFC 8794 and RFC 9559."""
_HEAD_BYTES = 64
ELSEWHERE = "Choose a file in another folder."


class VideoRecorder:
    """A WebM video (VP8) with a constant frame rate in mission time; the file appears when it is complete.

    Args:
        path: The file to write.
        fps: Frames per second of mission time.
    """

    def __init__(self, path: Path, fps: int = VIDEO_FPS) -> None:
        self._path = path
        self._part: Path | None = None
        self._fps = fps
        self._writer: cv2.VideoWriter | None = None
        self._slot = 0
        self._shown: Image | None = None

    def add(self, image: Image, time_s: float) -> None:
        """Show `image` from `time_s` until the next one; of two in the same slot the first stays.

        Args:
            image: Shape (height, width, 3), dtype uint8, BGR; all of one size.
            time_s: Time from the video's start, where the first image is shown; must not decrease.

        Raises:
            ConfigError: The file cannot be written.
        """
        slot = frame_number(time_s, self._fps)
        if self._shown is None:
            self._open(image)
            self._shown = image
        elif slot <= self._slot:
            return
        self._write(slot - self._slot)
        self._slot, self._shown = slot, image

    def close(self) -> None:
        """Finish the file; may be called again.

        Raises:
            OSError: It is damaged, as on a full disk, and removed; OpenCV does not say so earlier.
        """
        if self._writer is not None and self._part is not None:
            try:
                self._write(1)
                self._writer.release()
                if not _is_whole(self._part):
                    raise OSError(errno.EIO, "the video is incomplete, as on a full disk", str(self._path))
                _make_webm(self._part)
                os.replace(self._part, self._path)
            finally:
                self.abandon()  # which makes room for the rest of a run folder

    def abandon(self) -> None:
        """Remove the file, unless it is finished."""
        if self._writer is not None:
            self._writer.release()
            self._writer = None
        if self._part is not None:
            self._part.unlink(missing_ok=True)
            self._part = None

    def _open(self, image: Image) -> None:
        try:
            check_replaceable(self._path)
        except OSError as error:
            raise ConfigError(
                f"{self._path}: the video cannot be written ({error.strerror}).", remedy=ELSEWHERE
            ) from None
        configure()
        opencv_name(self._path, ConfigError)  # the draft is in the same folder
        height, width = image.shape[:2]
        self._part = draft_path(self._path, ".mkv")  # Ctrl-C may come between the file and the writer
        self._writer = cv2.VideoWriter(str(self._part), cv2.VideoWriter.fourcc(*"VP80"), self._fps, (width, height))
        if not self._writer.isOpened():
            self.abandon()  # else `close` would report another error than this one
            raise ConfigError(f"{self._path}: the video cannot be written.", remedy=ELSEWHERE)

    def _write(self, times: int) -> None:
        if self._writer is not None and self._shown is not None:
            for _ in range(times):
                self._writer.write(self._shown)


def _is_whole(path: Path) -> bool:
    """Return whether a video is complete; a full disk may lose its middle between beginning and end."""
    with open(path, "rb") as file:
        head = file.read(_HEAD_BYTES)
        end = head.find(_SEGMENT) + len(_SEGMENT) + 8
        return file.seek(0, os.SEEK_END) == end + int.from_bytes(head[end - 7 : end], "big")


Follow = Callable[[Sequence[RecordedFrame]], Iterable[RecordedFrame]]
"""Passes frames on, such as to show progress."""


def write_webm(camera: RecordedFrames, records: Sequence[Record], path: Path, follow: Follow = iter) -> None:
    """Write the frames as a video with boxes, state and time; it appears when it is complete.

    The video's time is the mission's: a frame is shown until the next one was taken.

    Args:
        camera: The frames; those that cannot be read are left out.
        records: The run's journal, for the caption.
        path: The file to write.
        follow: Passes the frames on.

    Raises:
        ConfigError: The file cannot be written, or there is no frame.
        OSError: There is no room for it.
    """
    video, shown = VideoRecorder(path), False
    try:
        for frame, caption in _captioned(follow(camera.frames), records):
            image = camera.drawn(frame, caption)
            if image is not None:
                video.add(image, frame.t)
                shown = True
        if not shown:
            raise ConfigError(f"{camera.folder} contains no picture that can be read.", remedy="Choose another run.")
        video.close()
    finally:
        video.abandon()


def _captioned(frames: Iterable[RecordedFrame], records: Sequence[Record]) -> Iterator[tuple[RecordedFrame, str]]:
    """Add state, target and time to each frame."""
    now, state = 0, ""
    for frame in frames:
        while now < len(records) and records[now].time_s <= frame.t:
            state = f"{records[now].state}  {records[now].target}"
            now += 1
        yield frame, f"{state}  {frame.t:.1f} s"


def _make_webm(path: Path) -> None:
    """Make the Matroska file a WebM file; OpenCV prints a warning for each WebM file that it writes itself."""
    with open(path, "r+b") as file:
        head = file.read(_HEAD_BYTES)
        file.seek(0)
        file.write(head.replace(_MATROSKA, _WEBM))
