"""Looks for a target while the operator drives."""

from __future__ import annotations

import threading
from typing import Protocol

from behaviors.ports import Eyes, Sighting
from firmware_protocol.errors import CameraError

EVERY_S = 0.5
"""Time between looks that block driving."""


class Spotter(Protocol):
    """Reports what the eyes saw last.

    Attributes:
        target: Name of the target.
        sighting: Sighting of the last look, or None.
        trouble: What is wrong with the camera, or an empty string.
    """

    target: str
    sighting: Sighting | None
    trouble: str

    def look(self, now_s: float) -> None:
        """Look if it is time to; called between two steps of driving. Raises whatever a detector raises."""
        ...

    def close(self) -> None:
        """Stop looking."""
        ...


class TurnSpotter:
    """Looks between steps of driving, in the same thread, as a simulation needs."""

    def __init__(self, eyes: Eyes, target: str) -> None:
        self._eyes, self.target = eyes, target
        self.sighting: Sighting | None = None
        self.trouble = ""
        self._due_s = 0.0

    def look(self, now_s: float) -> None:
        """Look once per `EVERY_S`; wait for the camera's next frame."""
        if now_s >= self._due_s:
            self._due_s = now_s + EVERY_S
            self.sighting, self.trouble = _look(self._eyes, self.target)

    def close(self) -> None:
        """Do nothing: there is no thread."""


class ThreadSpotter:
    """Looks in a thread of its own: a hanging webcam must not delay a stop."""

    def __init__(self, eyes: Eyes, target: str) -> None:
        self._eyes, self.target = eyes, target
        self.sighting: Sighting | None = None
        self.trouble = ""
        self._defect: Exception | None = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._go_on, name="teleop eyes", daemon=True)
        self._thread.start()

    def look(self, now_s: float) -> None:  # noqa: ARG002 - the thread looks as often as it can
        """Raise what has ended the thread, which looks by itself: what it saw last is old then."""
        if self._defect is not None:
            raise self._defect

    def close(self) -> None:
        """Wait for the current look to end; the camera has a timeout of its own."""
        self._closed.set()
        self._thread.join()

    def _go_on(self) -> None:
        try:
            while not self._closed.is_set():
                self.sighting, self.trouble = _look(self._eyes, self.target)
        except Exception as defect:  # noqa: BLE001 - of a detector; the driving thread raises it
            self._defect = defect


def _look(eyes: Eyes, target: str) -> tuple[Sighting | None, str]:
    try:
        return eyes.look(target), ""
    except CameraError as error:
        return None, str(error)
