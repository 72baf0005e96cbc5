"""Live cameras: a thread per camera keeps only the latest frame.

A camera that is read less often than it delivers queues old frames, and the robot would steer by outdated frames. So a
thread takes every frame at once and keeps the last. It also bounds what OpenCV cannot: a webcam whose driver hangs
blocks only the thread. When the camera goes away, the thread keeps reopening it, and `read` raises an error until then.
"""

from __future__ import annotations

import atexit
import logging
import threading
from collections.abc import Callable
from typing import Protocol

import cv2

from behaviors.ports import Clock
from firmware_protocol.errors import CameraError
from nxtdrive.vision.camera import Frame
from nxtdrive.vision.frames import as_frame

log = logging.getLogger(__name__)

REOPEN_AFTER_S = 0.5
STALE_S = 3.0
"""A frame of this age does not show what the camera sees now, even if none has arrived since: its driver hangs."""
CLOSE_WITHIN_S = 2.0
END_WITHIN_S = 3.0
"""How long the program's end waits for a driver that hangs."""


class Capture(Protocol):
    """The part of ``cv2.VideoCapture`` that is used here."""

    def isOpened(self) -> bool:  # noqa: N802
        """Return whether the device delivers frames."""
        ...

    def read(self) -> tuple[bool, cv2.typing.MatLike]:
        """Wait for the next frame; return whether there was one, and the frame."""
        ...

    def release(self) -> None:
        """Close the device."""
        ...


class LiveCamera:
    """A webcam or network stream.

    Args:
        name: For messages, e.g. "camera 0".
        remedy: What to do when it gives nothing.
        open_capture: Opens the device; called in the camera's own thread.
        clock: The mission's time; read in the camera's own thread.
        open_timeout_s: Longest wait for the first frame.

    Raises:
        CameraError: There was no frame in that time.
    """

    def __init__(
        self, name: str, remedy: str, open_capture: Callable[[], Capture], clock: Clock, open_timeout_s: float
    ) -> None:
        self._name = name
        self._remedy = remedy
        self._open_capture = open_capture
        self._clock = clock
        self._changed = threading.Condition()
        self._closing = threading.Event()
        self._latest: Frame | None = None
        self._given = -1
        self._failed = False
        self._observers: list[Callable[[Frame], None]] = []
        self._ended = threading.Event()
        # OpenCV aborts a process if one of its calls returns while Python is being finalised; registered before the
        # thread starts, because a signal may interrupt anything after that
        atexit.register(self._end, END_WITHIN_S)
        threading.Thread(target=self._run, name=f"nxtdrive {name}", daemon=True).start()
        try:
            with self._changed:
                self._changed.wait_for(lambda: self._latest is not None or self._failed, open_timeout_s)
                first = self._latest
            if first is None:
                raise CameraError(f"{name} gives no frames.", remedy=remedy)
        except BaseException:
            self.close()
            raise
        self._size: tuple[int, int] = (first.image.shape[1], first.image.shape[0])

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the first frame in pixels."""
        return self._size

    def read(self, timeout_s: float) -> Frame:
        """Return the latest frame, none from before a stall; see `Camera.read`."""
        oldest_s = self._clock.now() - STALE_S
        with self._changed:
            frame = self._changed.wait_for(lambda: self._fresh(oldest_s), timeout_s)
            if frame is None:
                raise CameraError(f"{self._name} gave no frame for {timeout_s:g} s.", remedy=self._remedy)
            self._given = frame.index
            return frame

    def on_frame(self, observer: Callable[[Frame], None]) -> None:
        """Call `observer` with every further frame, in the camera's own thread; it must return quickly.

        An observer that raises an exception is reported once and left out.
        """
        self._observers.append(observer)

    def close(self) -> None:
        """Stop the thread and release the device; a hanging driver is left alone until the program ends."""
        if self._end(CLOSE_WITHIN_S):
            atexit.unregister(self._end)

    def _end(self, within_s: float) -> bool:
        """Ask the thread to end; return whether it did so within this time."""
        self._closing.set()
        return self._ended.wait(within_s)

    def _fresh(self, oldest_s: float) -> Frame | None:
        """Return the latest frame if it has not been given yet and is not older than that."""
        frame = self._latest
        return frame if frame is not None and frame.index > self._given and frame.time_s >= oldest_s else None

    def _run(self) -> None:
        try:
            while not self._closing.is_set():
                self._open_and_grab()
                with self._changed:
                    self._failed = True
                    self._changed.notify_all()
                self._closing.wait(REOPEN_AFTER_S)
        finally:
            self._ended.set()

    def _open_and_grab(self) -> None:
        try:
            capture = self._open_capture()
            try:
                self._grab(capture)
            finally:
                capture.release()
        except Exception:  # whatever a driver raises, the camera may work again later
            log.debug("%s failed", self._name, exc_info=True)

    def _grab(self, capture: Capture) -> None:
        """Take frames until there are no more."""
        while capture.isOpened() and not self._closing.is_set():
            there, read = capture.read()
            image = as_frame(read) if there else None
            if image is None:
                return
            with self._changed:
                index = 0 if self._latest is None else self._latest.index + 1
                self._latest = frame = Frame(image, self._clock.now(), index)
                self._changed.notify_all()
            self._show(frame)

    def _show(self, frame: Frame) -> None:
        for observer in list(self._observers):
            try:
                observer(frame)
            except Exception:
                log.exception("an observer of %s failed and is left out", self._name)
                self._observers.remove(observer)
