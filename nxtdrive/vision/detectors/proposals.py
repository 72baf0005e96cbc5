"""Propose where a picture may be: small grey templates slide over the levels of a frame's pyramid.

Each level halves the frame, so a few template heights cover every size from 14 pixels to larger than the frame, and
most of the cost is that of the finest level. Many proposals are wrong, since a few grey pixels match many places.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detectors.alignment import Poses
from nxtdrive.vision.detectors.fourier import spectra
from nxtdrive.vision.detectors.frame_pyramid import Level, Pyramid, Transformed
from nxtdrive.vision.detectors.lit_windows import Footprint
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
"""Minimum grey correlation of a proposal."""

PROPOSALS = (16, 8, 6, 4, 4)
"""Proposals per level at most; the finest level has the smallest templates and the most places for chance matches."""

CROWD = 10
"""For each proposal this many places are compared for overlaps."""

SHAPES_KEPT = 20
"""Shapes of levels for which the templates' spectra are kept: those of whole frames, and of some crops of them."""

NEIGHBOURS = np.ones((3, 3), np.uint8)


@dataclass(frozen=True, slots=True)
class _Template:
    """A grey template of mean 0 and norm 1, and the view that it shows."""

    gray: NDArray[np.float32]
    aspect: float
    roll_deg: float


_Transformed: TypeAlias = tuple[_Template, Transformed]


class _Peaks(NamedTuple):
    """Places of a level where a template matches best nearby: scores, boxes (x, y, width, height) and views."""

    scores: NDArray[np.float32]
    boxes: NDArray[np.intp]
    views: NDArray[np.float64]


class Proposals(NamedTuple):
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
        boxes: list[NDArray[np.float64]] = [np.empty((0, 4))]
        views, levels = [np.empty((0, 2))], [np.empty(0, np.intp)]
        for number, level in enumerate(frame.levels):
            usable = [
                (template, transform)
                for template, transform in self._transformed(level.gray.shape, level.step, frame.overexposed)
                if self._is_large_enough(template, level, number)
            ]
            if usable:
                best = _best(_peaks(level, usable), PROPOSALS[number])
                boxes.append(np.asarray(best.boxes * level.scale, np.float64))
                views.append(best.views)
                levels.append(np.full(len(best.boxes), number))
        return Proposals(_poses(np.concatenate(boxes), np.concatenate(views)), np.concatenate(levels))

    def _is_large_enough(self, template: _Template, level: Level, number: int) -> bool:
        height = template.gray.shape[0]
        if self._part != 1.0:
            return bool(height / self._part >= LARGE * level.gray.shape[0])
        return bool(number > 0 or template.aspect > 0.8 or height >= FAR_HEIGHT)

    def _transform(self, shape: tuple[int, int], step: int, cut: bool) -> list[_Transformed]:
        """Return the templates that fit into a shape, with the complex conjugates of their Fourier transforms."""
        fit = (t for t in self._templates[cut] if t.gray.shape[0] <= shape[0] and t.gray.shape[1] <= shape[1])
        return [(t, Transformed(np.conj(spectra(t.gray, shape, step)), Footprint(t.gray, step))) for t in fit]


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


def _peaks(level: Level, templates: Sequence[_Transformed]) -> _Peaks:
    """Return the places where each template matches best nearby."""
    rows, columns = (-(-side // level.step) for side in level.gray.shape)
    scores = np.empty((len(templates), rows, columns), np.float32)
    for score, (_, transform) in zip(scores, templates, strict=True):
        level.score(transform, score)
    # One call for all templates: a score of 0, where a window reaches out of the level, keeps each from the next.
    column = scores.reshape(-1, columns)
    found = np.flatnonzero((column > PROPOSE_AT) & (column == cv2.dilate(column, NEIGHBOURS)))
    which, places = divmod(found, rows * columns)
    ys, xs = divmod(places, columns)
    sizes = np.array([template.gray.shape[::-1] for template, _ in templates])[which]
    views = np.array([(template.aspect, template.roll_deg) for template, _ in templates])[which]
    boxes = np.column_stack([xs * level.step, ys * level.step, sizes])
    return _Peaks(column.ravel()[found], boxes, views)


def _best(peaks: _Peaks, most: int) -> _Peaks:
    """Choose up to `most` of the best places greedily, dropping those that overlap a chosen one by half."""
    order = np.argsort(-peaks.scores, kind="stable")[: CROWD * most]
    boxes = peaks.boxes[order]
    left, top, width, height = boxes.T.astype(np.float32)
    right, bottom, areas = left + width, top + height, width * height
    free = np.ones(len(boxes), bool)
    chosen: list[int] = []
    for one in range(len(boxes)):
        if not free[one]:
            continue
        chosen.append(one)
        if len(chosen) == most:
            break
        across = np.minimum(right[one], right) - np.maximum(left[one], left)
        down = np.minimum(bottom[one], bottom) - np.maximum(top[one], top)
        shared = np.maximum(across, 0) * np.maximum(down, 0)
        free &= shared < 0.5 * (areas[one] + areas - shared)
    kept = order[chosen]
    return _Peaks(peaks.scores[kept], boxes[chosen], peaks.views[kept])


def _poses(boxes: NDArray[np.float64], views: NDArray[np.float64]) -> Poses:
    """Return the poses of upright boxes, in pixels of the frame, that show the picture in a view."""
    x, y, width, height = boxes.T
    sin, cos = np.sin(np.radians(views[:, 1])), np.cos(np.radians(views[:, 1]))
    rows = (width * cos, -height * sin, x + width / 2), (width * sin, height * cos, y + height / 2)
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)
