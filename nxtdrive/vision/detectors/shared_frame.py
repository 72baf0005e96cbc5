"""Look for several targets in a frame at once: detectors of a kind share the work that depends on the frame alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

from nxtdrive.vision.detection import Detection, Detector, Image


@runtime_checkable
class SharingDetector(Protocol):
    """A detector that shares work with others of its kind."""

    @classmethod
    def detect_all(cls, detectors: Sequence[Any], image: Image) -> list[list[Detection]]:
        """Return what each of several detectors of this class finds in the BGR `image`, best first."""
        ...


def detect_each(detectors: Mapping[str, Detector], image: Image) -> dict[str, list[Detection]]:
    """Return what each detector finds in the BGR `image`."""
    found: dict[str, list[Detection]] = {}
    sharing: dict[type[SharingDetector], list[str]] = {}
    for name, detector in detectors.items():
        if isinstance(detector, SharingDetector):
            sharing.setdefault(type(detector), []).append(name)
        else:
            found[name] = detector.detect(image)
    for kind, names in sharing.items():
        found |= zip(names, kind.detect_all([detectors[name] for name in names], image), strict=True)
    return found
