"""A frame that several detectors look at: what depends on the frame alone is computed once for all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar, runtime_checkable

from nxtdrive.vision.detection import Detection, Detector, Image

T = TypeVar("T")


class SharedFrame:
    """A frame, and what was computed of it.

    Args:
        image: The BGR frame.
    """

    def __init__(self, image: Image) -> None:
        self.image = image
        self._computed: dict[Callable[[Image], Any], Any] = {}

    def once(self, compute: Callable[[Image], T]) -> T:
        """Return what a function computes of the frame; it is called once, however many detectors ask."""
        if compute not in self._computed:
            self._computed[compute] = compute(self.image)
        computed: T = self._computed[compute]
        return computed


@runtime_checkable
class SharingDetector(Protocol):
    """A detector that shares work with others of its kind."""

    def detect_in(self, frame: SharedFrame) -> list[Detection]:
        """Return what `detect` would return for the frame's image."""
        ...


def detect_each(detectors: Mapping[str, Detector], image: Image) -> dict[str, list[Detection]]:
    """Return what each detector finds in the BGR `image`; they share the work that depends on the frame alone."""
    frame = SharedFrame(image)
    return {
        name: detector.detect_in(frame) if isinstance(detector, SharingDetector) else detector.detect(image)
        for name, detector in detectors.items()
    }
