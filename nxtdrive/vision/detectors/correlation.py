"""Finds a picture by correlation: proposals on a gray pyramid, their alignment, then a check in colour.

The first stage proposes places freely. The second aligns all of them at once with the picture, which finds their roll,
too. The third compares the best of them with the picture *in colour* at the frame's own resolution; only its score
counts.

Correlation tolerates blur, noise, bad light, glare and a rolled camera, but not occlusion; there
`nxtdrive.vision.detectors.features` takes over. Measurements are in docs/vision.md.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Detection, Image, Quad, box_of, overlap
from nxtdrive.vision.detectors.alignment import Aligner, Poses
from nxtdrive.vision.detectors.chance import coarseness, distinctness, least_score
from nxtdrive.vision.detectors.frame_pyramid import Pyramid, straightened
from nxtdrive.vision.detectors.proposals import Proposer
from nxtdrive.vision.detectors.resemblance import resemblance
from nxtdrive.vision.detectors.scaling import at_height

CORE = 0.6
"""Close up, the centre of the picture is searched for, too (this share of width and height): its rim may lie outside
the frame."""

COARSE_HEIGHT, COARSE_STEPS = 24, 4
FINE_HEIGHT, FINE_STEPS = 40, 3
"""Heights in pixels at which the picture is aligned, first on a proposal's level and then on the next finer one, and
steps of each alignment."""

PROMISING = 16
"""So many of the best proposals after one step are aligned further."""

ALIGNED_AT = 0.65
CHECKS = 4
"""So many of the best aligned proposals are checked in colour; where the picture is, it is nearly always the best."""

LEAST_RANGE = 16.0
"""Range of gray that must be left below the median; a mostly black picture has none."""

KEPT_HEIGHT = 160
"""The picture is stored at this height; no comparison needs more."""

LENS_BLUR_PX = 0.8
"""Standard deviation of a camera's blur, with that of reading between its pixels."""

ALL_SHOWN = 0.95
"""Where less of a picture tells something, what is left of it may be coarser than the whole."""

LEAST_INSIDE = 0.6
"""Share of a place that must lie inside the frame."""

LEAST_HEIGHT_PX = 15
MOST_ROLL_DEG, MOST_SHEAR_DEG = 22.0, 10.0
NARROWEST, WIDEST = 0.4, 1.15
"""Bounds of a place's width relative to its height, as a factor of the picture's: from 66 degrees to the side on."""


class CorrelationMatcher:
    """Finds one reference picture at any distance from filling the frame to 14 pixels high.

    Args:
        picture: The picture as it looks from the front, BGR, without anything around it.
    """

    def __init__(self, picture: Image) -> None:
        if picture.shape[0] > KEPT_HEIGHT:
            picture = at_height(picture, KEPT_HEIGHT)
        height, width = picture.shape[:2]
        y, x = round(height * (1 - CORE) / 2), round(width * (1 - CORE) / 2)
        self._ratio = width / height
        self._parts = _Part(picture, 1.0), _Part(picture[y : height - y, x : width - x], CORE)

    def match(self, frame: Pyramid) -> list[Detection]:
        """Return distinct places in the frame that show the picture, best first."""
        found = []
        for part in self._parts:
            for pose in self._aligned(frame, part):
                score = part.score(frame, pose) if _plausible(pose, self._ratio) else None
                if score is not None:
                    quad = _quad(pose, part.share)
                    found.append(Detection(box_of(quad), min(1.0, score), quad))
        return distinct(found)

    def _aligned(self, frame: Pyramid, part: _Part) -> Poses:
        """Return the poses of the best distinct proposals after their alignment."""
        proposals = part.proposer.propose(frame)
        aligner = part.aligner(COARSE_HEIGHT, cut=frame.overexposed)
        poses, scores = aligner.align(frame.canvas, proposals.poses, proposals.levels, 1)
        best = np.argsort(-scores, kind="stable")[:PROMISING]
        levels = proposals.levels[best]
        poses, scores = aligner.align(frame.canvas, poses[best], levels, COARSE_STEPS - 1)
        kept: list[int] = []
        for index in np.argsort(-scores, kind="stable"):
            if scores[index] < ALIGNED_AT or len(kept) == CHECKS:
                break
            pose = poses[index]
            reach = 0.25 * float(np.hypot(*pose[:, 1]))
            if _plausible(pose, self._ratio) and all(np.abs(pose - poses[k])[:, 2].max() > reach for k in kept):
                kept.append(int(index))
        poses, levels = poses[kept], levels[kept]
        finer = levels > 0
        if finer.any():
            aligner = part.aligner(FINE_HEIGHT, cut=frame.overexposed)
            poses[finer], _ = aligner.align(frame.canvas, poses[finer], levels[finer] - 1, FINE_STEPS)
        return poses


class _Part:
    """The middle `share` of the picture (of its width and height), in all forms that are compared."""

    def __init__(self, picture: Image, share: float) -> None:
        self.share = share
        self._picture = picture
        gray = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.float32)
        cut = np.minimum(gray, np.median(gray))
        self._grays = gray, cut if np.ptp(cut) >= LEAST_RANGE else gray
        self.proposer = Proposer(*self._grays, share)
        self._aligners: dict[tuple[int, bool], Aligner] = {}
        self._sizes: dict[int, tuple[NDArray[np.float32], float]] = {}
        self._waves = distinctness(picture)

    def aligner(self, height: int, *, cut: bool) -> Aligner:
        """Return what aligns the part at a height, `cut` as an overexposed frame shows it; made once."""
        key = (height, cut)
        if key not in self._aligners:
            self._aligners[key] = Aligner(at_height(self._grays[cut], height))
        return self._aligners[key]

    def score(self, frame: Pyramid, pose: Poses) -> float | None:
        """Return how well the colours at a pose resemble the part's, 0..1; None if chance may do as well."""
        width_px, height_px = (float(side) for side in np.hypot(*pose[:, :2]))
        picture, coarse = self._at(max(4, min(FINE_HEIGHT, round(height_px))))
        seen, inside = straightened(frame, pose, picture.shape[1], picture.shape[0])
        if inside.mean() < LEAST_INSIDE:
            return None
        score, share, expected = resemblance(seen, picture, inside)
        if share < ALL_SHOWN:
            coarse = max(coarse, coarseness(expected))
        area = max(0.01, share) * picture.shape[0] ** 2 * width_px / height_px  # as it appears
        return score if score >= least_score(coarse, self._waves, area, core=self.share != 1.0) else None

    def _at(self, height: int) -> tuple[NDArray[np.float32], float]:
        """Return the part in colour at a height, and its coarseness; cached, because few heights occur."""
        if height not in self._sizes:
            small = at_height(self._picture, height).astype(np.float32)
            if height < FINE_HEIGHT:  # a smaller place is compared pixel by pixel, and a lens blurs those
                small = np.asarray(cv2.GaussianBlur(small, (0, 0), LENS_BLUR_PX), np.float32)
            self._sizes[height] = small, coarseness(small)
        return self._sizes[height]


def distinct(detections: list[Detection]) -> list[Detection]:
    """Return the best of every group of overlapping detections, best first."""
    kept: list[Detection] = []
    for detection in sorted(detections, key=lambda d: -d.score):
        if all(overlap(detection.box, other.box) < 0.3 for other in kept):
            kept.append(detection)
    return kept


def _plausible(pose: Poses, ratio: float) -> bool:
    """Whether a pose can be the upright picture, seen by a camera rolled by up to some 20 degrees."""
    (ax, bx, _), (ay, by, _) = pose
    width, height = math.hypot(ax, ay), math.hypot(bx, by)
    if width < 4 or height < LEAST_HEIGHT_PX:
        return False
    roll_x, roll_y = math.degrees(math.atan2(ay, ax)), math.degrees(math.atan2(-bx, by))
    upright = abs(roll_y) <= MOST_ROLL_DEG and abs(roll_x - roll_y) <= MOST_SHEAR_DEG
    return upright and NARROWEST <= width / height / ratio <= WIDEST


def _quad(pose: Poses, part: float) -> Quad:
    """Return the corners of the whole picture, of which the pose may show only the core."""
    half = 0.5 / part
    corners = np.array([(-half, half, half, -half), (-half, -half, half, half), (1, 1, 1, 1)])
    a, b, c, d = ((float(u), float(v)) for u, v in (pose @ corners).T)
    return a, b, c, d
