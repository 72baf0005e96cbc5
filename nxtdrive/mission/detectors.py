"""Make the detectors of a mission's targets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from behaviors.mission import Mission
from behaviors.mission.targets import ColorTarget, Target
from firmware_protocol.errors import ConfigError

if TYPE_CHECKING:
    from behaviors.mission.robot import ColorName, ColorTable
    from nxtdrive.vision.detection import Detector, Image, TargetDetector


def build_detectors(mission: Mission) -> dict[str, TargetDetector]:
    """Return a detector for each target of a mission.

    Raises:
        ConfigError: A picture or a cascade cannot be used; one line for each such target.
    """
    targets = {name: mission.target[name] for name in mission.mission.targets}
    detectors, mistakes = make_detectors(targets, mission.color)
    if mistakes:
        raise ConfigError("\n  ".join(mistakes))
    return detectors


def detector_spec(target: Target, colors: Mapping[ColorName, ColorTable]) -> dict[str, object]:
    """Return the options of a target's detector; of a colour also how it looks, if the robot file says so."""
    shade = colors.get(target.color) if isinstance(target, ColorTarget) else None
    height_mm = {"height_mm": target.height_mm}  # also one that is guessed, which is in no dump
    return {**target.model_dump(exclude_none=True), **height_mm, **(shade.model_dump() if shade else {})}


def make_detectors(
    targets: Mapping[str, Target], colors: Mapping[ColorName, ColorTable]
) -> tuple[dict[str, TargetDetector], list[str]]:
    """Make a detector for each target; returns those that can be made, and a line for each that cannot."""
    from nxtdrive.vision.detectors import make_detector

    detectors, mistakes = {}, []
    for name, target in targets.items():
        try:
            detectors[name] = make_detector(detector_spec(target, colors))
        except ConfigError as error:
            mistakes.append(f"target.{name}: {error}")
    return detectors, mistakes


def codes_in(image: Image, detector: Detector) -> list[str]:
    """Return in words the QR codes or markers that a detector of these reads in an image, whichever it looks for."""
    from nxtdrive.vision.detectors.marker import MarkerDetector
    from nxtdrive.vision.detectors.qr import QrDetector

    match detector:
        case QrDetector():
            return sorted({f"QR code {text!r}" for text, _ in detector.codes(image)})
        case MarkerDetector():
            return sorted({f"marker {number}" for number, _ in detector.markers(image)})
    return []
