"""Finds a picture by correlation: proposals on a gray pyramid, then verification in colour.

The first stage slides small gray templates over a pyramid of the frame; each level halves the frame, so a few template
heights cover every size from 14 pixels to larger than the frame, and most of the cost is that of the full level. It
proposes freely: a few gray pixels match much. The second stage compares each proposal with the picture *in colour* and
at the frame's own resolution, over a few sizes and positions around it; only its score counts.

Correlation tolerates blur, noise and bad light, but neither rotation in the picture's plane nor occlusion; there
`nxtdrive.vision.detectors.features` takes over. Measurements are in docs/vision.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Box, Detection, Image, overlap

WORK_WIDTH = 320
"""Proposals are made on a copy of the frame at most this wide."""

HEIGHTS = (14, 18, 22)
"""Heights of the templates in pixels of a level; the next level down continues with twice the first."""

FRONTAL, OBLIQUE = 1.0, 0.72
"""Widths of the templates relative to the picture's: seen from the front, and from 44 degrees to the side."""

CORE = 0.6
"""Close up, the centre of the picture is searched for, too (this share of width and height): its rim may lie outside
the frame."""

LARGE = 0.75
"""The core is searched for where the whole picture would fill at least this share of the frame's height."""

FAR_HEIGHT = 22
"""On the full level, oblique templates start at this height: smaller ones match anything."""

STEPS = (2, 1, 1, 1, 1)
"""Templates are compared at every second pixel of the finest level, at half the cost, which loses targets beyond 4 m
only. Done on the next level, too, it would lose a third of those at 2.5 to 3 m."""

FLAT_SD = 1.0
"""Lower bound of a window's contrast, gray levels: only rendered frames have flatter windows."""

PROPOSE_AT = 0.5
PROPOSALS = (8, 4, 3, 3, 3)
"""Most proposals per level; the finest level has the smallest templates and the most places for chance matches."""

NEIGHBOURS = np.ones((3, 3), np.uint8)


@dataclass(frozen=True, slots=True)
class _Look:
    """How to compare a proposal with the picture.

    Attributes:
        height: Height in pixels at which the proposal is compared.
        most_zoom: Largest factor by which a smaller proposal is enlarged to that height.
        stretches: Factors of its width and height that are tried.
    """

    height: int
    most_zoom: float
    stretches: tuple[tuple[float, float], ...]


CHECK_HEIGHT = 40
SIZE = _Look(CHECK_HEIGHT, 1.0, tuple((scale, scale) for scale in (1.0, 0.92, 1.09, 0.84, 1.19)))
SLANT = _Look(CHECK_HEIGHT, 1.0, ((1.0, 1.0), (0.87, 1.0), (1.15, 1.0)))
FINE = _Look(80, 3.0, tuple((scale, scale) for scale in (1.0, 0.97, 1.03, 0.94, 1.06)))
KEPT_HEIGHT = 160
"""The picture is stored at this height; no comparison needs more."""

PROMISING = 0.65
HOPELESS = 0.5
"""A proposal whose colour score at its own size is below this is dropped at once."""

SURE = 0.75
CHANCE_AREA = 12.0
CORE_EXTRA = 0.08
"""A score is accepted from ``SURE + CHANCE_AREA / area`` on, with the compared area in square pixels: the fewer pixels,
the better the matches that chance finds. The core has less to tell it from other things. Source: docs/vision.md."""


@dataclass(frozen=True, slots=True)
class Level:
    """One level of the pyramid.

    Attributes:
        gray: The gray frame.
        sums: Integral image.
        squares: Integral image of the squares.
        scale: Size of the frame divided by the size of this level.
        step: Distance in pixels between the places at which templates are compared.
    """

    gray: NDArray[np.float32]
    sums: NDArray[np.float64]
    squares: NDArray[np.float64]
    scale: float
    step: int


@dataclass(frozen=True, slots=True)
class _Template:
    """A gray template of mean 0 and norm 1, which part of the picture it shows, and whether it serves far away."""

    gray: NDArray[np.float32]
    part: float
    far: bool


@dataclass(frozen=True, slots=True)
class _Match:
    """A rectangle (left, top, width, height in pixels of the frame) that shows the middle `part` of the picture."""

    score: float
    rectangle: tuple[float, float, float, float]
    part: float


def pyramid(image: Image) -> list[Level]:
    """Return the gray levels of a BGR frame, the finest first."""
    scale = max(1.0, image.shape[1] / WORK_WIDTH)
    size = (round(image.shape[1] / scale), max(1, round(image.shape[0] / scale)))
    work = image if scale == 1 else cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    gray = cv2.cvtColor(work, cv2.COLOR_BGR2GRAY)
    levels = [_level(gray, scale, STEPS[0])]
    while len(levels) < len(STEPS) and min(gray.shape) >= 2 * min(HEIGHTS):
        gray = cv2.resize(gray, (gray.shape[1] // 2, gray.shape[0] // 2), interpolation=cv2.INTER_AREA)
        levels.append(_level(gray, scale * 2 ** len(levels), STEPS[len(levels)]))
    return levels


def _level(gray: cv2.typing.MatLike, scale: float, step: int) -> Level:
    sums, squares = cv2.integral2(gray, sdepth=cv2.CV_64F, sqdepth=cv2.CV_64F)
    return Level(gray.astype(np.float32), sums.astype(np.float64), squares.astype(np.float64), scale, step)


class CorrelationMatcher:
    """Finds one reference picture, upright, at any distance from filling the frame to 14 pixels high.

    Args:
        picture: The picture as it looks from the front, BGR, without anything around it.
    """

    def __init__(self, picture: Image) -> None:
        if picture.shape[0] > KEPT_HEIGHT:
            size = (max(1, round(picture.shape[1] * KEPT_HEIGHT / picture.shape[0])), KEPT_HEIGHT)
            picture = _u8(cv2.resize(picture, size, interpolation=cv2.INTER_AREA))
        height, width = picture.shape[:2]
        y, x = round(height * (1 - CORE) / 2), round(width * (1 - CORE) / 2)
        self._parts = {1.0: picture, CORE: picture[y : height - y, x : width - x]}
        self._templates = tuple(self._make_templates())
        self._resized: dict[tuple[float, int, int], Image] = {}

    def match(self, image: Image, levels: list[Level]) -> list[Detection]:
        """Return distinct places in the BGR `image` (with its `pyramid`) that show the picture, best first."""
        found = []
        for number, level in enumerate(levels):
            for proposal in self._propose(level, number):
                match = self._check(image, proposal)
                if match is not None:
                    finer = self._refine(image, match, FINE) or match
                    found.append(Detection(_whole(finer), min(1.0, match.score)))
        return distinct(found)

    def _check(self, image: Image, proposal: _Match) -> _Match | None:
        match = self._refine(image, proposal, SIZE)
        if match is not None and match.score >= PROMISING:
            match = self._refine(image, match, SLANT)
        return match if match is not None and match.score >= _needed(match) else None

    def _make_templates(self) -> Iterator[_Template]:
        for part, picture in self._parts.items():
            gray = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
            for aspect in (FRONTAL, OBLIQUE):
                for height in HEIGHTS:
                    width = max(4, round(height * aspect * gray.shape[1] / gray.shape[0]))
                    small = cv2.resize(gray, (width, height), interpolation=cv2.INTER_AREA)
                    centred = small.astype(np.float32) - small.mean()
                    unit = (centred / max(1e-6, float(np.linalg.norm(centred)))).astype(np.float32)
                    yield _Template(unit, part, far=aspect == FRONTAL or height >= FAR_HEIGHT)

    def _propose(self, level: Level, number: int) -> list[_Match]:
        """Return the best places of one level that do not overlap much, best first."""
        scores: list[NDArray[np.float32]] = []
        boxes: list[NDArray[np.float64]] = []
        parts: list[NDArray[np.float64]] = []
        for template in self._templates:
            height, width = template.gray.shape
            large = height / template.part >= LARGE * level.gray.shape[0]
            wanted = (template.far or number > 0) and (template.part == 1.0 or large)
            if not wanted or height > level.gray.shape[0] or width > level.gray.shape[1]:
                continue
            score = _correlation(level, template.gray)
            ys, xs = np.nonzero(score > PROPOSE_AT)
            top = score[ys, xs] == cv2.dilate(score, NEIGHBOURS)[ys, xs]
            ys, xs = ys[top], xs[top]
            scores.append(score[ys, xs])
            sizes = np.full_like(xs, width), np.full_like(xs, height)
            boxes.append(np.stack([xs * level.step, ys * level.step, *sizes], axis=1) * level.scale)
            parts.append(np.full(len(xs), template.part))
        if not scores:
            return []
        return _peaks(np.concatenate(scores), np.concatenate(boxes), np.concatenate(parts), PROPOSALS[number])

    def _refine(self, image: Image, around: _Match, look: _Look) -> _Match | None:
        """Return the best colour match near a rectangle; None if there is none above `HOPELESS`."""
        left, top, width, height = around.rectangle
        margin = 0.2 * height
        x0, y0 = int(max(0.0, left - margin)), int(max(0.0, top - margin))
        patch = image[y0 : int(top + height + margin) + 1, x0 : int(left + width + margin) + 1]
        patch, zoom_x, zoom_y = _zoomed(patch, min(look.most_zoom, look.height / height))
        best: _Match | None = None
        for wider, higher in look.stretches:
            across, down = max(3, round(width * zoom_x * wider)), max(3, round(height * zoom_y * higher))
            if across > patch.shape[1] or down > patch.shape[0]:
                continue
            score, x, y = _best_place(patch, self._sized(around.part, across, down))
            if best is None or score > best.score:
                rectangle = (x0 + x / zoom_x, y0 + y / zoom_y, across / zoom_x, down / zoom_y)
                best = _Match(score, rectangle, around.part)
            if best.score < HOPELESS:
                return None
        return best

    def _sized(self, part: float, width: int, height: int) -> Image:
        """Return the part at a size; cached, because few sizes occur: none is higher than that of a `_Look`."""
        key = (part, width, height)
        if key not in self._resized:
            self._resized[key] = _u8(cv2.resize(self._parts[part], (width, height), interpolation=cv2.INTER_AREA))
        return self._resized[key]


def distinct(detections: list[Detection]) -> list[Detection]:
    """Return the best of every group of overlapping detections, best first."""
    kept: list[Detection] = []
    for detection in sorted(detections, key=lambda d: -d.score):
        if all(overlap(detection.box, other.box) < 0.3 for other in kept):
            kept.append(detection)
    return kept


def _correlation(level: Level, template: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the normalised correlation at each `level.step`-th place; ``cv2.TM_CCOEFF_NORMED`` costs twice as much."""
    height, width = template.shape
    step = level.step
    shared = cv2.matchTemplate(level.gray, template, cv2.TM_CCORR)[::step, ::step]
    total, square = (
        integral[height::step, width::step]
        - integral[:-height:step, width::step]
        - integral[height::step, :-width:step]
        + integral[:-height:step, :-width:step]
        for integral in (level.sums, level.squares)
    )
    energy = np.maximum(square - total * total / template.size, FLAT_SD**2 * template.size)
    return (shared / np.sqrt(energy)).astype(np.float32)


def _needed(match: _Match) -> float:
    width, height = match.rectangle[2:]
    area = width * height * min(1.0, CHECK_HEIGHT / height) ** 2
    return SURE + CHANCE_AREA / area + (CORE_EXTRA if match.part != 1.0 else 0.0)


def _peaks(
    scores: NDArray[np.float32], boxes: NDArray[np.float64], parts: NDArray[np.float64], most: int
) -> list[_Match]:
    """Choose up to `most` of the best greedily, dropping those that overlap a chosen one by half."""
    order = np.argsort(-scores, kind="stable")
    scores, boxes, parts = scores[order], boxes[order], parts[order]
    peaks: list[_Match] = []
    while len(scores) and len(peaks) < most:
        left, top, width, height = boxes[0]
        peaks.append(_Match(float(scores[0]), (float(left), float(top), float(width), float(height)), float(parts[0])))
        shared_x = np.minimum(left + width, boxes[:, 0] + boxes[:, 2]) - np.maximum(left, boxes[:, 0])
        shared_y = np.minimum(top + height, boxes[:, 1] + boxes[:, 3]) - np.maximum(top, boxes[:, 1])
        shared = np.maximum(shared_x, 0) * np.maximum(shared_y, 0)
        apart = shared < 0.5 * (width * height + boxes[:, 2] * boxes[:, 3] - shared)
        apart[0] = False
        scores, boxes, parts = scores[apart], boxes[apart], parts[apart]
    return peaks


def _zoomed(patch: Image, zoom: float) -> tuple[Image, float, float]:
    """Return the patch enlarged or shrunk, and the exact factors."""
    size = (max(1, round(patch.shape[1] * zoom)), max(1, round(patch.shape[0] * zoom)))
    if size == (patch.shape[1], patch.shape[0]):
        return patch, 1.0, 1.0
    zoomed = cv2.resize(patch, size, interpolation=cv2.INTER_AREA if zoom < 1 else cv2.INTER_LINEAR)
    return _u8(zoomed), size[0] / patch.shape[1], size[1] / patch.shape[0]


def _best_place(patch: Image, template: Image) -> tuple[float, int, int]:
    _, score, _, (x, y) = cv2.minMaxLoc(cv2.matchTemplate(patch, template, cv2.TM_CCOEFF_NORMED))
    return score, x, y


def _whole(match: _Match) -> Box:
    """Return the box of the whole picture, of which the match may show only the core."""
    left, top, width, height = match.rectangle
    rim_x, rim_y = width * (1 / match.part - 1) / 2, height * (1 / match.part - 1) / 2
    return round(left - rim_x), round(top - rim_y), round(width / match.part), round(height / match.part)


def _u8(array: cv2.typing.MatLike) -> Image:
    """Return the array as uint8, which OpenCV's stubs do not say it is."""
    return array.astype(np.uint8, copy=False)
