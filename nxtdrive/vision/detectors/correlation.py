"""Find a picture by correlation: proposals on a grey pyramid, their alignment, then a check in colour.

The first stage proposes many places. The second aligns all of them at once with the picture, which finds their roll,
too. The third compares the best of them with the picture *in colour* at the frame's own resolution; only its score
counts.

Correlation tolerates blur, noise, bad light, glare and a rolled camera, but not occlusion; there
`nxtdrive.vision.detectors.features` takes over. Measurements are in docs/ranges.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Detection, Image, Quad, box_of, distinct, quad_of
from nxtdrive.vision.detectors.alignment import Aligner, Candidates, Poses, align
from nxtdrive.vision.detectors.frame_pyramid import Pyramid, rectified
from nxtdrive.vision.detectors.proposals import Proposer
from nxtdrive.vision.detectors.resemblance import resemblance
from nxtdrive.vision.detectors.scaling import at_height
from nxtdrive.vision.detectors.score_threshold import coarseness, distinctness, min_score

CORE = 0.6
"""Close up, the centre of the picture is also searched for (this share of width and height): its rim may lie outside
the frame."""

COARSE_HEIGHT, COARSE_STEPS = 24, 4
FINE_HEIGHT, FINE_STEPS = 40, 3
"""Heights in pixels at which the picture is aligned, first on a proposal's level and then on the next finer one, and
steps of each alignment."""

PROMISING, MIN_PROMISING = 16, 4
"""Number of the best proposals after one step that are aligned further: all pictures that are looked for at once share
the first number, and each has the second."""

ALIGNED_AT = 0.65
"""Minimum grey correlation of an aligned proposal that is checked in colour."""

CHECKS, MIN_CHECKS = 4, 2
"""Number of the best aligned proposals that are checked in colour, shared likewise; where the picture is, it is nearly
always the best."""

MIN_CUT = 120.0
"""An overexposed frame is taken to cut a picture at its median, but not below this, where values are 2.1 times the
picture's."""

MIN_RANGE = 16.0
"""Range of grey that must be left below the cut; a bright picture has none."""

KEPT_HEIGHT = 160
"""The picture is stored at this height; no comparison needs more."""

LENS_BLUR_PX = 0.8
"""Standard deviation of a camera's blur, with that of reading between its pixels."""

ALL_SHOWN = 0.95
"""If less of a picture can be compared, the rest may be coarser than the whole."""

MIN_INSIDE = 0.6
"""Share of a place that must lie inside the frame."""

MIN_HEIGHT_PX = 15
"""Minimum height of a place."""

MAX_ROLL_DEG, MAX_SHEAR_DEG = 22.0, 10.0
"""How far a place's sides may lean from the vertical, and its corners from a right angle."""

NARROWEST, WIDEST = 0.4, 1.15
"""Bounds of a place's width relative to its height, as a factor of the picture's: from 66 degrees to the side on."""


class CorrelationMatcher:
    """Finds one reference picture at any distance from filling the frame to 15 pixels high.

    Args:
        picture: The picture as it looks from the front, BGR, without anything around it.

    Attributes:
        parts: The picture and its core.
    """

    def __init__(self, picture: Image) -> None:
        if picture.shape[0] > KEPT_HEIGHT:
            picture = at_height(picture, KEPT_HEIGHT)
        height, width = picture.shape[:2]
        y, x = round(height * (1 - CORE) / 2), round(width * (1 - CORE) / 2)
        ratio = width / height
        core = _Part(picture[y : height - y, x : width - x], CORE, ratio)
        self.parts = _Part(picture, 1.0, ratio), core

    def match(self, frame: Pyramid) -> list[Detection]:
        """Return distinct places in the frame that show the picture, best first."""
        return match_all([self], frame)[0]


def match_all(matchers: Sequence[CorrelationMatcher], frame: Pyramid, sharers: int = 1) -> list[list[Detection]]:
    """Return for each matcher the distinct places in the frame that show its picture, best first.

    Args:
        matchers: Whose pictures are looked for; they take the steps of their alignments together.
        frame: Where to look.
        sharers: Number of targets that share the work: the more they are, the fewer places of each are compared.
    """
    parts = [part for matcher in matchers for part in matcher.parts]
    aligned = zip(parts, _aligned(frame, parts, sharers), strict=True)
    found = [part.detections(frame, poses) for part, poses in aligned]
    return [distinct(whole + core) for whole, core in zip(found[::2], found[1::2], strict=True)]


def _aligned(frame: Pyramid, parts: Sequence[_Part], sharers: int) -> list[Poses]:
    """Return the poses of the best distinct proposals of each part after their alignment."""
    places = [Candidates(part.aligner(COARSE_HEIGHT, cut=frame.overexposed), *part.propose(frame)) for part in parts]
    promising = max(MIN_PROMISING, PROMISING // sharers)
    for number, (poses, scores) in enumerate(align(frame.canvas, places, 1)):
        best = np.argsort(-scores, kind="stable")[:promising]
        places[number] = Candidates(places[number].aligner, poses[best], places[number].levels[best])
    kept = []
    for part, before, (poses, scores) in zip(parts, places, align(frame.canvas, places, COARSE_STEPS - 1), strict=True):
        chosen = part.chosen(poses, scores, max(MIN_CHECKS, CHECKS // sharers))
        kept.append((poses[chosen], before.levels[chosen]))
    fine = [
        Candidates(part.aligner(FINE_HEIGHT, cut=frame.overexposed), poses[levels > 0], levels[levels > 0] - 1)
        for part, (poses, levels) in zip(parts, kept, strict=True)
    ]
    for (poses, levels), (finer, _) in zip(kept, align(frame.canvas, fine, FINE_STEPS), strict=True):
        poses[levels > 0] = finer
    return [poses for poses, _ in kept]


class _Part:
    """The middle `share` of a picture (of its width and height), in all forms that are compared.

    Args:
        picture: That part.
        share: Of the whole picture's width and height.
        ratio: Width of the whole picture relative to its height.
    """

    def __init__(self, picture: Image, share: float, ratio: float) -> None:
        self._share = share
        self._ratio = ratio
        self._picture = picture
        gray = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.float32)
        cut = np.minimum(gray, max(float(np.median(gray)), MIN_CUT))
        self._grays = gray, cut if np.ptp(cut) >= MIN_RANGE else gray
        self.propose = Proposer(*self._grays, share).propose
        self._aligners: dict[tuple[int, bool], Aligner] = {}
        self._sizes: dict[int, tuple[NDArray[np.float32], float]] = {}
        self._waves = distinctness(picture)

    def aligner(self, height: int, *, cut: bool) -> Aligner:
        """Return the aligner of the part at a height, `cut` as an overexposed frame shows it; made once."""
        key = (height, cut)
        if key not in self._aligners:
            self._aligners[key] = Aligner(at_height(self._grays[cut], height))
        return self._aligners[key]

    def chosen(self, poses: Poses, scores: NDArray[np.float64], most: int) -> list[int]:
        """Return the numbers of up to `most` of the best places that are possible views and lie apart."""
        kept: list[int] = []
        for index in np.argsort(-scores, kind="stable"):
            if scores[index] < ALIGNED_AT or len(kept) == most:
                break
            pose = poses[index]
            reach = 0.25 * float(np.hypot(*pose[:, 1]))
            if _plausible(pose, self._ratio) and all(np.abs(pose - poses[k])[:, 2].max() > reach for k in kept):
                kept.append(int(index))
        return kept

    def detections(self, frame: Pyramid, poses: Poses) -> list[Detection]:
        """Return the whole picture at those of the poses where the colours resemble it."""
        found = []
        for pose in poses:
            score = self._score(frame, pose) if _plausible(pose, self._ratio) else None
            if score is not None:
                quad = _quad(pose, self._share)
                found.append(Detection(box_of(quad), min(1.0, score), quad))
        return found

    def _score(self, frame: Pyramid, pose: Poses) -> float | None:
        """Return how well the colours at a pose resemble the part's, 0..1; None if chance may do as well."""
        width_px, height_px = (float(side) for side in np.hypot(*pose[:, :2]))
        picture, coarse = self._at(max(4, min(FINE_HEIGHT, round(height_px))))
        seen, inside = rectified(frame, pose, picture.shape[1], picture.shape[0])
        if inside.mean() < MIN_INSIDE:
            return None
        score, share, expected = resemblance(seen, picture, inside, overexposed=frame.overexposed)
        if share < ALL_SHOWN:
            coarse = max(coarse, coarseness(expected))
        area = max(0.01, share) * picture.shape[0] ** 2 * width_px / height_px  # as it appears
        return score if score >= min_score(coarse, self._waves, area, core=self._share != 1.0) else None

    def _at(self, height: int) -> tuple[NDArray[np.float32], float]:
        """Return the part in colour at a height, and its coarseness; cached, because few heights occur."""
        if height not in self._sizes:
            small = at_height(self._picture, height).astype(np.float32)
            if height < FINE_HEIGHT:  # a smaller place is compared pixel by pixel, and a lens blurs those
                small = np.asarray(cv2.GaussianBlur(small, (0, 0), LENS_BLUR_PX), np.float32)
            self._sizes[height] = small, coarseness(small)
        return self._sizes[height]


def _plausible(pose: Poses, ratio: float) -> bool:
    """Return whether a pose can be the upright picture, seen by a camera rolled by up to about 20 degrees."""
    (ax, bx, _), (ay, by, _) = pose
    width, height = math.hypot(ax, ay), math.hypot(bx, by)
    if width < 4 or height < MIN_HEIGHT_PX:
        return False
    roll_x, roll_y = math.degrees(math.atan2(ay, ax)), math.degrees(math.atan2(-bx, by))
    upright = abs(roll_y) <= MAX_ROLL_DEG and abs(roll_x - roll_y) <= MAX_SHEAR_DEG
    return upright and NARROWEST <= width / height / ratio <= WIDEST


def _quad(pose: Poses, part: float) -> Quad:
    """Return the corners of the whole picture, of which the pose may show only the core."""
    half = 0.5 / part
    corners = np.array([(-half, half, half, -half), (-half, -half, half, half), (1, 1, 1, 1)])
    return quad_of((pose @ corners).T)
