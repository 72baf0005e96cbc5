"""Looking for a target while somebody drives."""

from __future__ import annotations

import threading
from typing import Protocol

from behaviors.ports import Eyes, Sighting
from firmware_protocol.errors import CameraError

EVERY_S = 0.5
"""Between two looks that stop everything else meanwhile."""


class Spotter(Protocol):
    """Says what the eyes saw last.

    Attributes:
        target: Name of the target.
        sighting: The last look's, or None.
        trouble: What is wrong with the camera, or an empty string.
    """

    target: str
    sighting: Sighting | None
    trouble: str

    def look(self, now_s: float) -> None:
        """Have a moment to look; called between two steps of driving."""
        ...

    def close(self) -> None:
        """Look no more."""
        ...


class TurnSpotter:
    """Looks in turn with driving: a simulation has one thread."""

    def __init__(self, eyes: Eyes, target: str) -> None:
        self._eyes, self.target = eyes, target
        self.sighting: Sighting | None = None
        self.trouble = ""
        self._due_s = 0.0

    def look(self, now_s: float) -> None:
        """Take a frame every now and then; lasts until the camera has one."""
        if now_s >= self._due_s:
            self._due_s = now_s + EVERY_S
            self.sighting, self.trouble = _look(self._eyes, self.target)

    def close(self) -> None:
        """Nothing goes on."""


class ThreadSpotter:
    """Looks in a thread of its own: a webcam that hangs must not keep anybody from stopping."""

    def __init__(self, eyes: Eyes, target: str) -> None:
        self._eyes, self.target = eyes, target
        self.sighting: Sighting | None = None
        self.trouble = ""
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._go_on, name="teleop eyes", daemon=True)
        self._thread.start()

    def look(self, now_s: float) -> None:
        """The thread does."""

    def close(self) -> None:
        """Wait for the look that is under way; a camera gives up after its own time limit."""
        self._closed.set()
        self._thread.join()

    def _go_on(self) -> None:
        while not self._closed.is_set():
            self.sighting, self.trouble = _look(self._eyes, self.target)


def _look(eyes: Eyes, target: str) -> tuple[Sighting | None, str]:
    try:
        return eyes.look(target), ""
    except CameraError as error:
        return None, str(error)
