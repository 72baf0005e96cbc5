"""The detectors, by the name a mission file gives them.

A new detector is one module here with a class that has ``detect(image)`` and a function ``from_spec(spec)`` that
makes it, and one line in `DETECTORS`. Installed packages offer such functions by entry points (docs/detectors.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import TargetDetector
from nxtdrive.vision.detectors.foreign import make_foreign
from nxtdrive.vision.detectors.spec import DetectorSpec
from nxtdrive.vision.geometry import A4_HEIGHT_MM
from nxtdrive.vision.opencv import configure

DETECTORS = {
    "picture": "nxtdrive.vision.detectors.picture",
    "haar": "nxtdrive.vision.detectors.haar",
    "marker": "nxtdrive.vision.detectors.marker",
    "qr": "nxtdrive.vision.detectors.qr",
    "color": "nxtdrive.vision.detectors.color",
    "onnx": "nxtdrive.vision.detectors.onnx",
}
"""Kind -> module; imported when used."""

ENTRY_POINTS = "nxtdrive.detectors"
"""Group of the entry points by which installed packages offer detectors."""


def make_detector(spec: Mapping[str, object], folder: Path = Path()) -> TargetDetector:
    """Make a detector from its specification.

    Args:
        spec: ``detector`` is the kind, ``height_mm`` the target's real height (an A4 sheet's if left out), the rest the
            options of the kind: ``{"detector": "marker", "id": 3, "height_mm": 158}``,
            ``{"detector": "picture", "pictures": ["lena.jpg"]}``.
        folder: Where relative paths start.

    Raises:
        ConfigError: The specification has a mistake or names a missing file; the message says which.
    """
    configure()
    values = dict(spec)
    kind = values.pop("detector", None)
    others = {entry.name: entry for entry in entry_points(group=ENTRY_POINTS)}
    if not isinstance(kind, str) or kind not in DETECTORS | others:
        names = ", ".join([*DETECTORS, *sorted(set(others) - set(DETECTORS))])
        raise ConfigError(f"There is no detector {kind!r}.", remedy=f"Use one of: {names}.")
    remaining = DetectorSpec(kind, values, folder)
    height_mm = remaining.take("height_mm", float, A4_HEIGHT_MM)
    if not 1 <= height_mm <= 10_000:
        raise ConfigError(f"height_mm = {height_mm:g} is not a valid height.", remedy="An A4 sheet is 297 mm high.")
    detector = (
        import_module(DETECTORS[kind]).from_spec(remaining)
        if kind in DETECTORS
        else make_foreign(others[kind], remaining)
    )
    remaining.finish()
    return TargetDetector(detector, height_mm)
