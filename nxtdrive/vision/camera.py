"""Where frames come from: the protocol of a camera, and the cameras that follow a clock.

Live cameras, which follow nothing but themselves, are in `nxtdrive.vision.live`; `nxtdrive.vision.sources` opens any.
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

ALMOST = 1e-6
"""What rounding may take from a whole number of frames, milliseconds or seconds."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One picture of a camera.

    Attributes:
        image: (height, width, 3), uint8, in the order blue, green, red; nobody writes into it.
        time_s: When it was taken, on the mission's clock.
        index: Counts the camera's frames from 0; gaps are frames that nobody asked for in time.
    """

    image: Image
    time_s: float
    index: int


class Camera(Protocol):
    """Something that gives frames."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames in pixels."""
        ...

    def read(self, timeout_s: float) -> Frame:
        """The freshest frame, newer than the one given last; waits for it at most `timeout_s`.

        Raises:
            CameraError: none came in time, or there will be no more (`EndOfFrames`).
        """
        ...

    def close(self) -> None:
        """Give the device back; may be called again."""
        ...


class EndOfFrames(CameraError):
    """A video or an image folder came to its end."""


class FrameSource(Protocol):
    """What a simulated camera needs of its simulation.

    Attributes:
        fps: Frames per second.
        hfov_deg: Horizontal view.
    """

    fps: float
    hfov_deg: float

    def frame(self) -> Image | None:
        """What the camera sees now, BGR; None while it is unplugged."""
        ...


def frame_number(now_s: float, fps: float) -> int:
    """Number of the freshest frame at `now_s` of a camera that takes frame n at ``n / fps``."""
    return math.floor(now_s * fps + ALMOST)


def next_tick(now_s: float, fps: float) -> float:
    """When that camera takes its next frame, rounded up to whole milliseconds: in these a simulation counts time."""
    return math.ceil((frame_number(now_s, fps) + 1) / fps * 1000 - ALMOST) / 1000


class SimulatedCamera:
    """The camera of a simulation; waiting for the next frame lets the simulation run.

    Args:
        source: The simulation's side.
        clock: The simulation's time.
        size: Width and height of its frames.
    """

    def __init__(self, source: FrameSource, clock: Clock, size: tuple[int, int] = (320, 240)) -> None:
        self._source = source
        self._clock = clock
        self._size = size
        self._given = -1

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames in pixels."""
        return self._size

    def read(self, timeout_s: float) -> Frame:
        """The freshest frame, or the next one if that was given before; see `Camera.read`."""
        fps = self._source.fps
        deadline_s = self._clock.now() + timeout_s
        while True:
            now_s = self._clock.now()
            number = frame_number(now_s, fps)
            image = self._source.frame() if number > self._given else None
            if image is not None:
                self._given = number
                return Frame(image, number / fps, number)
            if now_s >= deadline_s - ALMOST:
                raise CameraError(f"The simulated camera gave no frame for {timeout_s:g} s.", remedy="Plug it in.")
            self._clock.sleep(min(next_tick(now_s, fps), deadline_s) - now_s)

    def close(self) -> None:
        """Nothing to give back: the simulation owns the camera."""


class ReplayCamera:
    """Recorded pictures at their own pace: a video, the images of a folder, or one image for ever.

    Args:
        name: Of the recording, for messages.
        images: The pictures in order; read one by one.
        fps: At which they follow each other on `clock`; frames that fall due while nobody reads are skipped, as a
            live camera would. None gives every picture to the reader, one per call, without waiting.
        clock: The mission's time.
        close: Gives the file back.

    Raises:
        CameraError: there is not one picture.
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
            raise CameraError(f"{name} holds no pictures.", remedy="Check the file.")
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
        """Width and height of the first picture in pixels."""
        return self._size

    def read(self, timeout_s: float) -> Frame:
        """The picture that is due; see `Camera.read`."""
        wanted = self._index + 1 if self._fps is None else self._wait_for_due(self._fps, timeout_s)
        image = next(islice(self._images, wanted - self._index - 1, None), None)
        if image is None:
            raise EndOfFrames(f"{self._name} is at its end.", remedy="Open it again to start over.")
        self._index = wanted
        return Frame(image, self._clock.now(), wanted)

    def close(self) -> None:
        """Give the file back."""
        self._images = iter(())
        self._close()

    def _wait_for_due(self, fps: float, timeout_s: float) -> int:
        """Wait for the next picture's time; the number of the picture that is due then."""
        now_s = self._clock.now()
        if self._started_s is None:
            self._started_s = now_s
        due = frame_number(now_s - self._started_s, fps)
        if due > self._index:
            return due
        wait_s = self._started_s + (self._index + 1) / fps - now_s
        self._clock.sleep(min(wait_s, timeout_s))
        if wait_s > timeout_s:
            raise CameraError(f"{self._name} has no new picture within {timeout_s:g} s.", remedy="Wait longer.")
        return self._index + 1
