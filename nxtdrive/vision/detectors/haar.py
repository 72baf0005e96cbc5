"""Find the objects that a Haar cascade was trained for: one of OpenCV's, or the user's own file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from firmware_protocol.errors import ConfigError
from input_files.plain import MEGABYTE, InputFileError, at_home, refuse_empty
from nxtdrive.host.environment import pip_command
from nxtdrive.vision.detection import Box, Detection, Image, distinct
from nxtdrive.vision.detectors.spec import DetectorSpec
from nxtdrive.vision.detectors.trial import run_trial

DEFAULT_CASCADE = "haarcascade_frontalface_alt2"

SCALE_FACTOR = 1.1
"""Ratio of successive sizes."""

MIN_NEIGHBOURS = 3
"""Overlapping hits that make a detection. Source: docs/ranges.md; fewer see no farther and find faces in wallpaper."""

HITS_FOR_FULL_SCORE = 10
"""Overlapping hits from which on the score is 1; with fewer it is their share of these."""

FACES = "haarcascade_frontalface_"
"""The names of OpenCV's cascades for faces from the front begin with this."""


class ConfirmingCascade(NamedTuple):
    """How a cascade confirms the hits of another one.

    Attributes:
        scale_factor: Ratio of successive sizes.
        neighbours: Overlapping hits that it takes.
        rolls_deg: By how much the hit's surroundings are rolled; a face in one of them is enough.
    """

    scale_factor: float
    neighbours: int
    rolls_deg: tuple[float, ...] = (0.0,)


CONFIRMED_BY = {
    DEFAULT_CASCADE: ConfirmingCascade(1.05, 8),
    "haarcascade_frontalface_default": ConfirmingCascade(1.05, 8),
    "haarcascade_frontalface_alt_tree": ConfirmingCascade(1.02, 1, (0.0, 6.0, -6.0)),
}
"""All others of these must confirm its hits: cascades that were trained apart rarely take the same pattern for a face.
The last one rarely does at all, but misses rolled faces. Source: docs/ranges.md 1.4."""

CONFIRMED_PX = 56
"""Width to which a hit is scaled for that; the cascades were trained at 20 and 24 pixels."""

CONFIRMED_MARGIN = 0.6
"""What is shown around the hit on each side, as a share of its width."""

MAX_BYTES = 20 * MEGABYTE
"""OpenCV's largest cascade has a seventh of it."""

TRIAL_S = 20.0
TRIAL = Path(__file__).with_name("cascade_trial.py")


class HaarDetector:
    """Runs one cascade over the grey frame. The score grows with the number of overlapping hits.

    What OpenCV's cascades for faces from the front find must be confirmed by others of them.

    Args:
        cascade: Name of a cascade that comes with OpenCV (``haarcascade_frontalface_alt2``) or the path of an XML file.

    Raises:
        ConfigError: There is no such cascade, or this OpenCV has no Haar detector (5.0 and later).
    """

    def __init__(self, cascade: str = DEFAULT_CASCADE) -> None:
        if not hasattr(cv2, "CascadeClassifier"):
            raise ConfigError(
                f"OpenCV {cv2.__version__} has no Haar detector.",
                remedy="Use a picture target, or install an OpenCV that has one: "
                + pip_command("install", "opencv-python-headless<5"),
            )
        path = _find(cascade)
        try:
            refuse_empty(path, path.stat().st_size)
        except InputFileError as error:
            raise ConfigError(str(error)) from None
        bundled = path.parent == _folder()
        self._classifier = cv2.CascadeClassifier()
        if not (bundled or _works(path)) or not self._classifier.load(str(path)):
            raise ConfigError(f"{path} is not a cascade OpenCV can read.", remedy="Use an XML file of OpenCV 3 or 4.")
        others = CONFIRMED_BY if bundled and path.stem.startswith(FACES) else {}
        self._confirming = [
            (cv2.CascadeClassifier(str(_find(other))), confirmation)
            for other, confirmation in others.items()
            if other != path.stem
        ]

    def detect(self, image: Image) -> list[Detection]:
        """Return all hits, best first."""
        gray = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
        boxes, hits = self._classifier.detectMultiScale2(gray, scaleFactor=SCALE_FACTOR, minNeighbors=MIN_NEIGHBOURS)
        found = distinct(
            [
                Detection((int(left), int(top), int(width), int(height)), min(1.0, int(count) / HITS_FOR_FULL_SCORE))
                for (left, top, width, height), count in zip(boxes, hits, strict=True)
            ]
        )
        return [each for each in found if self._confirmed(gray, each.box)]

    def _confirmed(self, gray: Image, box: Box) -> bool:
        """Return whether the other cascades find a face there too."""
        left, top, width, height = box
        x_margin, y_margin = round(CONFIRMED_MARGIN * width), round(CONFIRMED_MARGIN * height)
        around = gray[
            max(0, top - y_margin) : top + height + y_margin, max(0, left - x_margin) : left + width + x_margin
        ]
        scale = CONFIRMED_PX / width
        scaled = cv2.resize(around, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
        return all(
            any(_finds(cascade, _rolled(scaled, roll_deg), how) for roll_deg in how.rolls_deg)
            for cascade, how in self._confirming
        )


def _finds(cascade: cv2.CascadeClassifier, gray: cv2.typing.MatLike, how: ConfirmingCascade) -> bool:
    return len(cascade.detectMultiScale(gray, scaleFactor=how.scale_factor, minNeighbors=how.neighbours)) > 0


def _rolled(gray: cv2.typing.MatLike, roll_deg: float) -> cv2.typing.MatLike:
    if not roll_deg:
        return gray
    height, width = gray.shape
    turn = cv2.getRotationMatrix2D((width / 2, height / 2), roll_deg, 1.0)
    return cv2.warpAffine(gray, turn, (width, height), borderMode=cv2.BORDER_REPLICATE)


def from_spec(spec: DetectorSpec) -> HaarDetector:
    """Make the detector from ``cascade``: a name, or a file."""
    cascade = spec.take("cascade", str, DEFAULT_CASCADE)
    file = spec.path(cascade)
    return HaarDetector(str(file) if os.path.isfile(file) else cascade)


def cascades() -> list[str]:
    """Return the names of the cascades that come with this OpenCV."""
    return sorted(file.stem for file in _folder().glob("*.xml"))


def _find(cascade: str) -> Path:
    for path in (at_home(cascade), _folder() / f"{cascade}.xml"):
        if os.path.isfile(path):
            return path
    raise ConfigError(
        f"there is no cascade {cascade!r}.", remedy=f"Give an XML file or one of: {', '.join(cascades()) or '(none)'}."
    )


def _works(path: Path) -> bool:
    """Return whether another process can load the cascade and run it: a damaged file may crash OpenCV."""
    if path.stat().st_size > MAX_BYTES:
        return False
    done = run_trial(TRIAL, str(path.resolve()), limit_s=TRIAL_S)
    return done is not None and done.returncode == 0


def _folder() -> Path:
    return Path(cv2.__file__).parent / "data"
