"""Find the object in a photograph: the detector that needs no training."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2

from firmware_protocol.errors import CameraError, ConfigError
from nxtdrive.vision.detection import Detection, Image, distinct
from nxtdrive.vision.detectors.correlation import CorrelationMatcher, match_all
from nxtdrive.vision.detectors.features import FeatureMatcher, keypoints
from nxtdrive.vision.detectors.frame_pyramid import pyramid
from nxtdrive.vision.detectors.spec import DetectorSpec
from nxtdrive.vision.sources import read_image

SMALLEST_PX = 40
MAX_RATIO = 20
"""Largest ratio of a picture's sides: a narrower one has copies that OpenCV cannot transform."""


class PictureDetector:
    """Finds a flat picture (a print, a poster, a box) that the user has one or more photographs of.

    Correlation comes first; if it finds nothing, features are tried: the two fail in opposite situations. The score is
    the colour correlation, 0..1, of the picture with that part of the frame.

    Args:
        pictures: BGR photographs of the same target, each cropped to the target, seen from the front.

    Raises:
        ConfigError: There is no picture, or one is too small or without contrast.
    """

    def __init__(self, pictures: Sequence[Image]) -> None:
        if not pictures:
            raise ConfigError("the picture detector needs at least one picture.", remedy="Give it a file.")
        for picture in pictures:
            check_picture(picture)
        self._correlation = [CorrelationMatcher(picture) for picture in pictures]
        self._features = [FeatureMatcher(picture) for picture in pictures]

    def detect(self, image: Image) -> list[Detection]:
        """Return all places where the picture is found, best first."""
        return self.detect_all([self], image)[0]

    @classmethod
    def detect_all(cls, detectors: Sequence[PictureDetector], image: Image) -> list[list[Detection]]:
        """Return what each of several detectors finds, best first; they share the work of their common steps."""
        matchers = [matcher for detector in detectors for matcher in detector._correlation]
        matched = iter(match_all(matchers, pyramid(image), sharers=len(detectors)))
        found = [[one for _ in detector._correlation for one in next(matched)] for detector in detectors]
        # Features take a third of the time of a look, so they wait until correlation failed.
        missed = [number for number in range(len(detectors)) if not found[number]]
        if missed:
            seen = keypoints(image)
            for number in missed:
                found[number] = [one for matcher in detectors[number]._features for one in matcher.match(image, seen)]
        return [distinct(each) for each in found]


def from_spec(spec: DetectorSpec) -> PictureDetector:
    """Make the detector from ``pictures``: image files of the same target."""
    return PictureDetector([_read(path) for path in spec.take_paths("pictures")])


def _read(path: Path) -> Image:
    try:
        picture = read_image(path)
    except CameraError as error:
        raise ConfigError(*error.args, remedy=error.remedy) from None
    check_picture(picture, f"{path}: the picture")
    return picture


def check_picture(picture: Image, name: str = "the picture") -> None:
    """Raise a ConfigError that begins with the name if a picture is too small, too narrow, or of one colour."""
    height, width = picture.shape[:2]
    if min(height, width) < SMALLEST_PX:
        raise ConfigError(
            f"{name} is only {width}x{height} pixels.",
            remedy=f"Use one of at least {SMALLEST_PX} pixels each way.",
        )
    if max(height, width) > MAX_RATIO * min(height, width):
        raise ConfigError(
            f"{name} is {width}x{height} pixels, too narrow to be found.",
            remedy=f"Crop it to a part that is at most {MAX_RATIO} times as long as it is wide.",
        )
    if float(cv2.meanStdDev(picture)[1].max()) < 1.0:
        remedy = "Use a picture with more detail, or the color detector if it is a strong colour."
        raise ConfigError(f"{name} is of a single colour.", remedy=remedy)
