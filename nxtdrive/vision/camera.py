"""The protocol of a camera, and the cameras that run on a given clock.

Live cameras, which run on their own clock, are in `nxtdrive.vision.live`; `nxtdrive.vision.sources` opens any camera.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain, islice
from typing import Protocol

from behaviors.ports import Clock
from firmware_protocol.errors import CameraError
from nxtdrive.vision.detection import Image

ROUNDING_TOLERANCE = 1e-6
"""Tolerance for rounding errors in numbers of frames, milliseconds or seconds."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One image of a camera.

    Attributes:
        image: (height, width, 3), uint8, in the order blue, green, red; not to be modified.
        time_s: When it was taken, on the mission's clock.
        index: Number of the frame, from 0; gaps are frames that were not read in time.
    """

    image: Image
    time_s: float
    index: int


class Camera(Protocol):
    """A source of frames."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames in pixels."""
        ...

    def read(self, timeout_s: float) -> Frame:
        """Return the latest frame that has not been returned before; wait for it at most `timeout_s`.

        Raises:
            CameraError: No frame arrived in time, or there are no more (`EndOfFrames`).
        """
        ...

    def close(self) -> None:
        """Release the device; may be called again."""
        ...


class EndOfFrames(CameraError):
    """A video or an image folder has ended."""


class FrameSource(Protocol):
    """What a simulated camera needs from its simulation.

    Attributes:
        fps: Frames per second.
        size: Width and height of its frames in pixels.
        detector_s: Computing time of the detectors per frame.
    """

    fps: float
    size: tuple[int, int]
    detector_s: float

    def frame(self) -> Image | None:
        """Return the camera's current view, BGR; None while it is unplugged, or if the frame is lost."""
        ...


def frame_number(now_s: float, fps: float) -> int:
    """Return the number of the latest frame at a time, where frame n is taken at ``n / fps``."""
    return math.floor(now_s * fps + ROUNDING_TOLERANCE)


def next_tick(now_s: float, fps: float) -> float:
    """Return when that camera takes its next frame, rounded up to the simulation's whole milliseconds."""
    return math.ceil((frame_number(now_s, fps) + 1) / fps * 1000 - ROUNDING_TOLERANCE) / 1000


class SimulatedCamera:
    """The camera of a simulation; waiting for the next frame runs the simulation.

    Args:
        source: The simulation's side of the camera.
        clock: The simulation's time.
    """

    def __init__(self, source: FrameSource, clock: Clock) -> None:
        self._source = source
        self._clock = clock
        self._given = -1

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames in pixels."""
        return self._source.size

    def read(self, timeout_s: float) -> Frame:
        """Return the latest frame, or the next one if that was returned before; see `Camera.read`."""
        fps = self._source.fps
        deadline_s = self._clock.now() + timeout_s
        while True:
            now_s = self._clock.now()
            number = frame_number(now_s, fps)
            image = self._source.frame() if number > self._given else None
            if image is not None:
                self._given = number
                if self._source.detector_s:
                    self._clock.sleep(self._source.detector_s)
                return Frame(image, number / fps, number)
            if now_s >= deadline_s - ROUNDING_TOLERANCE:
                raise CameraError(
                    f"the simulated camera gave no frame for {timeout_s:g} s.",
                    remedy="Has an event unplugged it, or is drop_rate high?",
                )
            self._clock.sleep(min(next_tick(now_s, fps), deadline_s) - now_s)

    def close(self) -> None:
        """Do nothing: the simulation owns the camera."""


class ReplayCamera:
    """Recorded frames at their own pace: a video, the images of a folder, or one image forever.

    Args:
        name: Name of the recording, for messages.
        images: The frames in order; read one by one.
        fps: Frame rate on `clock`; frames that are not read in time are skipped, as a live camera would do. None
            returns every frame, one per call, without waiting.
        clock: The mission's time.
        close: Releases the file.

    Raises:
        CameraError: There are no frames.
    """

    def __init__(
        self,
        name: str,
        images: Iterator[Image],
        fps: float | None,
        clock: Clock,
        close: Callable[[], None] = lambda: None,
    ) -> None:
        first = next(images, None)
        if first is None:
            raise CameraError(f"{name} contains no pictures.", remedy="Check the file.")
        self._name = name
        self._images: Iterator[Image] = chain([first], images)
        self._size = (first.shape[1], first.shape[0])
        self._fps = fps
        self._clock = clock
        self._close = close
        self._index = -1
        self._started_s: float | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the first frame in pixels."""
        return self._size

    def read(self, timeout_s: float) -> Frame:
        """Return the next frame, at its time; see `Camera.read`."""
        wanted = self._index + 1 if self._fps is None else self._await_next(self._fps, timeout_s)
        image = next(islice(self._images, wanted - self._index - 1, None), None)
        if image is None:
            raise EndOfFrames(f"{self._name} is at its end.", remedy="Open it again to start over.")
        self._index = wanted
        return Frame(image, self._clock.now(), wanted)

    def close(self) -> None:
        """Release the file."""
        self._images = iter(())
        self._close()

    def _await_next(self, fps: float, timeout_s: float) -> int:
        """Wait for the time of the next frame and return its number."""
        now_s = self._clock.now()
        if self._started_s is None:
            self._started_s = now_s
        number = frame_number(now_s - self._started_s, fps)
        if number > self._index:
            return number
        wait_s = self._started_s + (self._index + 1) / fps - now_s
        self._clock.sleep(min(wait_s, timeout_s))
        if wait_s > timeout_s:
            raise CameraError(f"{self._name} has no new picture within {timeout_s:g} s.", remedy="Wait longer.")
        return self._index + 1
