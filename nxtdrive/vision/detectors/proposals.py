"""Proposes where a picture may be: small gray templates slide over the levels of a frame's pyramid.

Each level halves the frame, so a few template heights cover every size from 14 pixels to larger than the frame, and
most of the cost is that of the finest level. It proposes freely: a few gray pixels match much.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detectors.alignment import Poses
from nxtdrive.vision.detectors.frame_pyramid import Level, Pyramid, correlated, spectra
from nxtdrive.vision.detectors.scaling import at_height

HEIGHTS = (14, 18, 22)
"""Heights of the templates in pixels of a level; the next level down continues with twice the first."""

VIEWS = ((1.0, 0.0), (0.72, 0.0), (0.9, 9.0), (0.9, -9.0))
"""Templates: width relative to the picture's (from the front, and from 44 degrees to the side) and roll in degrees."""

LARGE = 0.75
"""The core is searched for where the whole picture would fill at least this share of the frame's height."""

FAR_HEIGHT = 22
"""On the finest level, templates from the side start at this height: smaller ones match anything."""

PROPOSE_AT = 0.4
PROPOSALS = (16, 8, 6, 4, 4)
"""Most proposals per level; the finest level has the smallest templates and the most places for chance matches."""

CROWD = 10
"""So many times as many places are compared for overlaps."""

SHAPES_KEPT = 20
"""Shapes of levels for which the templates' spectra are kept: those of whole frames, and of some crops of them."""

NEIGHBOURS = np.ones((3, 3), np.uint8)


@dataclass(frozen=True, slots=True)
class _Template:
    """A gray template of mean 0 and norm 1, and the view that it shows."""

    gray: NDArray[np.float32]
    aspect: float
    roll_deg: float


@dataclass(frozen=True, slots=True)
class Proposals:
    """Places where the picture may be: their poses, and the number of the level of each."""

    poses: Poses
    levels: NDArray[np.intp]


class Proposer:
    """Proposes places of one part of a picture.

    Args:
        gray: The part.
        cut: The same as an overexposed frame shows it.
        part: Share of the picture's width and height that it is.
    """

    def __init__(self, gray: NDArray[np.float32], cut: NDArray[np.float32], part: float) -> None:
        self._part = part
        self._templates = tuple(_templates(gray)), tuple(_templates(cut))
        self._transformed = lru_cache(maxsize=SHAPES_KEPT)(self._transform)

    def propose(self, frame: Pyramid) -> Proposals:
        """Return the best places that do not overlap much, of all levels."""
        poses, levels = [np.empty((0, 2, 3))], [np.empty(0, np.intp)]
        for number, level in enumerate(frame.levels):
            usable = [
                (template, transform)
                for template, transform in self._transformed(level.gray.shape, level.step, frame.overexposed)
                if self._suits(template, level, number)
            ]
            if usable:
                found = [_peaks(level, template, transform) for template, transform in usable]
                boxes, views = _best(found, [template for template, _ in usable], level, PROPOSALS[number])
                poses.append(_poses(boxes, views, level.scale))
                levels.append(np.full(len(boxes), number))
        return Proposals(np.concatenate(poses), np.concatenate(levels))

    def _suits(self, template: _Template, level: Level, number: int) -> bool:
        height = template.gray.shape[0]
        if self._part != 1.0:
            return bool(height / self._part >= LARGE * level.gray.shape[0])
        return bool(number > 0 or template.aspect > 0.8 or height >= FAR_HEIGHT)

    def _transform(
        self, shape: tuple[int, int], step: int, cut: bool
    ) -> list[tuple[_Template, list[NDArray[np.float32]]]]:
        """Return the templates that fit into a shape, with their Fourier transforms."""
        fit = (t for t in self._templates[cut] if t.gray.shape[0] <= shape[0] and t.gray.shape[1] <= shape[1])
        return [(template, spectra(template.gray, shape, step)) for template in fit]


def _templates(gray: NDArray[np.float32]) -> Iterator[_Template]:
    for aspect, roll_deg in VIEWS:
        for height in HEIGHTS:
            yield _Template(_rolled(at_height(gray, height, aspect), roll_deg), aspect, roll_deg)


def _rolled(gray: cv2.typing.MatLike, roll_deg: float) -> NDArray[np.float32]:
    """Return the template rolled clockwise, of mean 0 and norm 1; what lies outside the picture counts as its mean."""
    centred = gray.astype(np.float32) - np.float32(gray.mean())
    if roll_deg:
        height, width = gray.shape
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), -roll_deg, 1.0)
        centred = np.asarray(cv2.warpAffine(centred, turn, (width, height), borderValue=0.0), np.float32)
        centred -= centred.mean()
    return np.asarray(centred / max(1e-6, float(np.linalg.norm(centred))), np.float32)


def _peaks(
    level: Level, template: _Template, transform: Sequence[NDArray[np.float32]]
) -> tuple[NDArray[np.float32], NDArray[np.intp], int]:
    """Return the scores of the places where a template matches best nearby, their numbers, and the places of a row."""
    height, width = template.gray.shape
    norms = level.norms(height, width)
    score = correlated(level.spectra, transform)[: norms.shape[0], : norms.shape[1]] / norms
    places = np.flatnonzero((score > PROPOSE_AT) & (score == cv2.dilate(score, NEIGHBOURS)))
    return score.ravel()[places], places, score.shape[1]


def _best(
    found: Sequence[tuple[NDArray[np.float32], NDArray[np.intp], int]],
    templates: Sequence[_Template],
    level: Level,
    most: int,
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Choose up to `most` of the best places greedily, dropping those that overlap a chosen one by half.

    Returns:
        Their boxes and their views.
    """
    which = np.repeat(np.arange(len(found)), [len(scores) for scores, _, _ in found])
    left = np.argsort(-np.concatenate([scores for scores, _, _ in found]), kind="stable")[: CROWD * most]
    which, places = which[left], np.concatenate([places for _, places, _ in found])[left]
    ys, xs = divmod(places, np.array([columns for _, _, columns in found])[which])
    sizes = np.array([template.gray.shape[::-1] for template in templates])[which]
    boxes = np.column_stack([xs * level.step, ys * level.step, sizes])
    views = np.array([(template.aspect, template.roll_deg) for template in templates])[which]
    left = np.arange(len(boxes))
    chosen: list[int] = []
    while len(left) and len(chosen) < most:
        x, y, width, height = boxes[left[0]]
        chosen.append(int(left[0]))
        others = boxes[left]
        across = np.minimum(x + width, others[:, 0] + others[:, 2]) - np.maximum(x, others[:, 0])
        down = np.minimum(y + height, others[:, 1] + others[:, 3]) - np.maximum(y, others[:, 1])
        shared = np.maximum(across, 0) * np.maximum(down, 0)
        apart = shared < 0.5 * (width * height + others[:, 2] * others[:, 3] - shared)
        apart[0] = False
        left = left[apart]
    return boxes[chosen], views[chosen]


def _poses(boxes: NDArray[np.intp], views: NDArray[np.float64], scale: float) -> Poses:
    """Return the poses of upright boxes of a level that show the picture in a view."""
    x, y, width, height = boxes.T * scale
    sin, cos = np.sin(np.radians(views[:, 1])), np.cos(np.radians(views[:, 1]))
    rows = (width * cos, -height * sin, x + width / 2), (width * sin, height * cos, y + height / 2)
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)
