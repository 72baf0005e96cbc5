"""The detectors, by the name a mission file gives them.

A new detector is one module here with a class that has ``detect(image)`` and a function ``from_spec(spec)`` that
makes it; `behaviors.detector_names` has its name. Installed packages offer such functions by entry points
(docs/detectors.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from behaviors.detector_names import BUILT_IN_DETECTORS, detector_names, installed_detectors
from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import TargetDetector
from nxtdrive.vision.detectors.external import make_external
from nxtdrive.vision.detectors.spec import DetectorSpec
from nxtdrive.vision.geometry import A4_HEIGHT_MM
from nxtdrive.vision.opencv import configure


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
    if not isinstance(kind, str) or kind not in detector_names():
        raise ConfigError(f"there is no detector {kind!r}.", remedy=f"Use one of: {', '.join(detector_names())}.")
    remaining = DetectorSpec(kind, values, folder)
    height_mm = remaining.take("height_mm", float, A4_HEIGHT_MM)
    if not 1 <= height_mm <= 10_000:
        raise ConfigError(f"height_mm = {height_mm:g} is not a valid height.", remedy="An A4 sheet is 297 mm high.")
    detector = (
        import_module(f"{__name__}.{kind}").from_spec(remaining)
        if kind in BUILT_IN_DETECTORS
        else make_external(installed_detectors()[kind], remaining)
    )
    remaining.finish()
    return TargetDetector(detector, height_mm)
