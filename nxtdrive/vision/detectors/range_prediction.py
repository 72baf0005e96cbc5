"""Predict how far the `picture` detector will see a print, and say why not farther.

The detector itself is tried on small frames that show the picture smaller and smaller, as a webcam would: softened, dim
and with noise. What limits it is then measured on the photograph. docs/ranges.md shows how well this predicts the
ranges in rendered rooms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Image
from nxtdrive.vision.detectors.correlation import CorrelationMatcher
from nxtdrive.vision.detectors.frame_pyramid import pyramid
from nxtdrive.vision.detectors.scaling import at_height
from nxtdrive.vision.detectors.score_threshold import DETAIL_HEIGHT, distinctness

HEIGHTS_PX = (18, 21, 25, 30, 36, 43, 52, 62, 75)
"""Apparent heights that are tried, in pixels of a frame 320 wide."""

USUAL_HEIGHT_PX = 21
"""Most prints are found from this apparent height on."""

TRIALS = 4
"""Frames for each height."""

GAIN, SOFTNESS_PX, NOISE = 0.8, 0.7, 5.0
"""The frames: brightness relative to the picture's, and standard deviations of the blur and, in 256 levels, of the
noise."""

FAINT_SD, ALIKE_WAVES, KEPT_CONTRAST = 16.0, 10.0, 0.6
"""Limits below which `RangePrediction.limitations` names what is low: the standard deviation of grey at
`DETAIL_HEIGHT`, in 256 levels; the number of details (`distinctness`); the share of the contrast that is left at that
height."""


class Limitation(NamedTuple):
    """What makes a picture hard to find.

    Attributes:
        cause: In plain words, beginning with its subject.
        better: What another picture should have, which is found from farther away.
    """

    cause: str
    better: str

    @classmethod
    def joined(cls, limitations: Sequence[Limitation]) -> Limitation:
        """Join several, at least one, to one."""
        causes, better = zip(*limitations, strict=True)
        return cls(" and ".join(causes), " and ".join(better))


@dataclass(frozen=True, slots=True)
class RangePrediction:
    """How well a print will be found.

    Attributes:
        height_px: Apparent height from which on it is found, in pixels of a frame 320 wide; None if at none tried.
        limitations: What limits it; empty if it is found as most prints are.
    """

    height_px: int | None
    limitations: tuple[Limitation, ...]

    @property
    def hard(self) -> bool:
        """Whether it is found only from clearly nearer than most prints."""
        return self.height_px is None or self.height_px > 1.4 * USUAL_HEIGHT_PX


def predict_range(picture: Image) -> RangePrediction:
    """Try the detector on a picture, BGR and at least 40 pixels high and wide; takes some tenths of a second."""
    matcher = CorrelationMatcher(picture)
    height_px = next((height for height in HEIGHTS_PX if _found(matcher, picture, height)), None)
    found = RangePrediction(height_px, tuple(_limitations(picture)))
    return found if found.hard else RangePrediction(height_px, ())


def _found(matcher: CorrelationMatcher, picture: Image, height: int) -> bool:
    """Return whether the picture is found in all frames but one in which it is `height` pixels high."""
    rng = np.random.default_rng(height)
    missed = 0
    for _ in range(TRIALS):
        place, frame = _frame(picture, height, rng)
        hits = (one.centre for one in matcher.match(pyramid(frame)))
        missed += not any(abs(u - place[0]) < height / 4 and abs(v - place[1]) < height / 4 for u, v in hits)
        if missed > 1:
            return False
    return True


def _frame(picture: Image, height: int, rng: np.random.Generator) -> tuple[tuple[float, float], Image]:
    """Return where the picture is, and a frame that shows it in front of a wall."""
    small = at_height(picture, 3 * height)
    width = small.shape[1] / 3
    size = round(width) + 60, height + 60
    wall = rng.uniform(60, 190, 3) + cv2.resize(rng.normal(0, 12, (6, 6, 3)), size, interpolation=cv2.INTER_CUBIC)
    left, top = 30 + rng.uniform(-1, 1), 30 + rng.uniform(-1, 1)
    large = cv2.resize(wall.clip(0, 255).astype(np.uint8), (size[0] * 3, size[1] * 3))
    shift = np.array([[1, 0, 3 * left], [0, 1, 3 * top]])
    cv2.warpAffine(small, shift, large.shape[1::-1], dst=large, borderMode=cv2.BORDER_TRANSPARENT)
    frame = cv2.GaussianBlur(cv2.resize(large, size, interpolation=cv2.INTER_AREA), (0, 0), SOFTNESS_PX)
    seen = frame.astype(np.float32) * GAIN + rng.normal(0, NOISE, frame.shape)
    return (left + width / 2, top + height / 2), seen.clip(0, 255).astype(np.uint8)


def _limitations(picture: Image) -> list[Limitation]:
    small, whole = _gray(at_height(picture, DETAIL_HEIGHT)), _gray(picture)
    found = []
    if small.std() < FAINT_SD:
        found.append(Limitation("it has little contrast from afar", "dark and bright parts"))
    if small.std() < KEPT_CONTRAST * whole.std():
        found.append(Limitation("its details are small", "large shapes"))
    if distinctness(picture) < ALIKE_WAVES:
        found.append(Limitation("it has few details, so much else resembles it", "more shapes"))
    return found or [Limitation("other things resemble it", "other shapes")]


def _gray(picture: cv2.typing.MatLike) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
