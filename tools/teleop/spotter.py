"""Look for a target while the operator drives."""

from __future__ import annotations

import threading

from behaviors.ports import Sighting, Vision
from firmware_protocol.errors import CameraError

EVERY_S = 0.5
"""Time between looks that block driving."""


class Spotter:
    """Looks between steps of driving, in the same thread, as a simulation needs.

    Args:
        vision: The robot's camera and detectors.
        target: What to look for.

    Attributes:
        target: As given.
        sighting: Sighting of the last look, or None.
        trouble: What is wrong with the camera, or an empty string.
    """

    def __init__(self, vision: Vision, target: str) -> None:
        self._vision, self.target = vision, target
        self.sighting: Sighting | None = None
        self.trouble = ""
        self._due_s = 0.0

    def look(self, now_s: float) -> None:
        """Look once per `EVERY_S`, waiting for the camera's next frame; raises whatever a detector raises."""
        if now_s >= self._due_s:
            self._due_s = now_s + EVERY_S
            self._look()

    def close(self) -> None:
        """Stop looking."""

    def _look(self) -> None:
        try:
            self.sighting, self.trouble = self._vision.look(self.target), ""
        except CameraError as error:
            self.sighting, self.trouble = None, str(error)


class ThreadedSpotter(Spotter):
    """Looks in a thread of its own: a hanging webcam must not delay a stop."""

    def __init__(self, vision: Vision, target: str) -> None:
        super().__init__(vision, target)
        self._defect: Exception | None = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="teleop spotter", daemon=True)
        self._thread.start()

    def look(self, now_s: float) -> None:  # noqa: ARG002 - the thread looks as often as it can
        """Raise what has ended the thread, which looks by itself: what it saw last is old then."""
        if self._defect is not None:
            raise self._defect

    def close(self) -> None:
        """Wait for the current look to end; the camera has a timeout of its own."""
        self._closed.set()
        self._thread.join()

    def _run(self) -> None:
        try:
            while not self._closed.is_set():
                self._look()
        except Exception as defect:  # noqa: BLE001 - of a detector; the driving thread raises it
            self._defect = defect
