"""Align a picture with places in a frame: many proposals at once, by inverse compositional Gauss-Newton steps.

A proposal is off by some pixels, a tenth in size and some degrees of roll. A few steps towards the best normalised
correlation find its centre, width, height, roll and shear to a fraction of a pixel. The derivatives belong to the
picture, so they are computed once. Source: Baker and Matthews 2004, "Lucas-Kanade 20 years on", section 3.2, and
Evangelidis and Psarakis 2008 for the normalised correlation as the criterion.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Poses = NDArray[np.float64]
"""(N, 2, 3): the affine map of each place, from the picture (x and y from -0.5 to 0.5) to the frame, in pixels."""

ROBUST_SD = 2.0
"""Differences beyond this many standard deviations get no more weight: glare covers part of the picture."""

MIN_LIT = 0.5
"""Minimum share of a place that must be free of glare."""

BLUR_PX = 0.6
"""Standard deviation of the blur of the template: a lens blurs the frame, and steps reach farther on soft edges."""

BORDER_PX = 8
"""Width of the copied edge around each image of a canvas: samples beside an image do not show its neighbour."""

STEP_LIMIT = 0.25
"""A step moves, stretches or turns by at most this share of the picture."""


@dataclass(frozen=True, slots=True)
class Canvas:
    """Grey images below each other, so that one call samples from all of them.

    Attributes:
        gray: The images, each with a border that repeats its rim.
        lit: 1 where `gray` is to be compared, 0 in glare; None where there is no glare.
        origins: (levels, 2): where the corner of each image lies, in pixels of `gray`.
        scales: Size of the frame divided by the size of each image.
    """

    gray: NDArray[np.float32]
    lit: NDArray[np.float32] | None
    origins: NDArray[np.float64]
    scales: NDArray[np.float64]

    def sample(
        self, points: NDArray[np.float64], levels: NDArray[np.intp]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """Return the grey values (N, M) and their `lit` at `points` (N, 2, M) of the frame, each row on its level."""
        places = (points / self.scales[levels][:, None, None] + (self.origins[levels] - 0.5)[:, :, None]).astype(
            np.float32
        )
        x, y = places[:, 0], places[:, 1]
        gray = cv2.remap(self.gray, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        lit = None if self.lit is None else cv2.remap(self.lit, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(gray, np.float32), None if lit is None else np.asarray(lit, np.float32)


def canvas_of(levels: Sequence[tuple[cv2.typing.MatLike, cv2.typing.MatLike | None, float]]) -> Canvas:
    """Put grey images below each other, given with their `lit` and their scales."""
    width = max(gray.shape[1] for gray, _, _ in levels) + 2 * BORDER_PX

    def stacked(images: Iterable[cv2.typing.MatLike]) -> NDArray[np.float32]:
        edges = ((BORDER_PX, BORDER_PX, BORDER_PX, width - image.shape[1] - BORDER_PX) for image in images)
        rows = [cv2.copyMakeBorder(i, *e, cv2.BORDER_REPLICATE) for i, e in zip(images, edges, strict=True)]
        return np.vstack(rows).astype(np.float32)

    heights = [gray.shape[0] + 2 * BORDER_PX for gray, _, _ in levels]
    origins = np.array([(BORDER_PX, sum(heights[:number]) + BORDER_PX) for number in range(len(levels))], np.float64)
    lit = [each for _, each, _ in levels if each is not None]
    scales = np.array([scale for _, _, scale in levels])
    return Canvas(stacked([gray for gray, _, _ in levels]), stacked(lit) if lit else None, origins, scales)


def grid(width: int, height: int) -> NDArray[np.float64]:
    """Return (3, width * height): x, y and 1 of the centres of a picture's pixels."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width - 0.5, (np.arange(height) + 0.5) / height - 0.5)
    return np.stack([x.ravel(), y.ravel(), np.ones(width * height)])


class Aligner:
    """A grey template, prepared for alignment.

    Args:
        gray: The template; its size sets the resolution of the comparison.

    Attributes:
        size: Width and height of the template.
        template: Its values (M), of mean 0 and norm 1.
        solver: (M, 6): the step of least squares for each difference from the template, if nothing is glare.
    """

    def __init__(self, gray: cv2.typing.MatLike) -> None:
        height, width = gray.shape
        self.size = width, height
        gray = np.asarray(cv2.GaussianBlur(gray, (0, 0), BLUR_PX), np.float32)
        self.template = _unit(gray.reshape(1, -1).astype(np.float32))[0]
        scaled = self.template.reshape(gray.shape).astype(np.float64)
        down, across = np.gradient(scaled)
        points = grid(width, height)
        moves = np.concatenate([across.ravel() * width * points, down.ravel() * height * points]).T
        moves -= moves.mean(axis=0)
        moves -= np.outer(self.template, self.template @ moves)
        # Directions in which the picture looks the same have no derivative; the ridge keeps them still.
        normal = moves.T @ moves
        ridge = 1e-3 * np.trace(normal) / len(normal) * np.eye(len(normal))
        self.solver = np.linalg.solve(normal + ridge, moves.T).T
        self._basis = np.column_stack([moves, np.full(len(moves), 1 / math.sqrt(len(moves))), self.template])
        self._products = (self._basis[:, :, None] * self._basis[:, None]).reshape(len(moves), -1).astype(np.float32)
        self._ridge = np.diag(np.concatenate([ridge.diagonal(), (1e-3, 1e-3)]))

    def step(self, difference: NDArray[np.float64], lit: NDArray[np.float32] | None) -> NDArray[np.float64]:
        """Return the steps (N, 6) of least squares for differences (N, M) from the template, 0 where not `lit`.

        What glare hides says nothing: without it the derivatives are no longer orthogonal to gain and offset, so these
        are solved for as well.
        """
        if lit is None:
            return np.asarray(difference @ self.solver)
        side = self._basis.shape[1]
        normal = (lit @ self._products).reshape(-1, side, side) + self._ridge
        return np.asarray(np.linalg.solve(normal, (difference @ self._basis)[:, :, None])[:, :6, 0])


class Candidates(NamedTuple):
    """Candidate poses to align with one template.

    Attributes:
        aligner: The template.
        poses: Where to begin.
        levels: On which level of the canvas each is compared.
    """

    aligner: Aligner
    poses: Poses
    levels: NDArray[np.intp]


Aligned = tuple[Poses, NDArray[np.float64]]
"""Poses, and the normalised correlation of each."""


def align(canvas: Canvas, places: Sequence[Candidates], steps: int) -> list[Aligned]:
    """Return the poses of all places after some steps; those of templates of one size take their steps together.

    Args:
        canvas: The frame.
        places: The places of each template.
        steps: Number of steps.
    """
    aligned = [(each.poses, np.empty(0)) for each in places]
    sizes: dict[tuple[int, int], list[int]] = {}
    for number, each in enumerate(places):
        if len(each.poses):
            sizes.setdefault(each.aligner.size, []).append(number)
    for numbers in sizes.values():
        batch = _Batch([places[number] for number in numbers])
        for number, found in zip(numbers, batch.align(canvas, steps), strict=True):
            aligned[number] = found
    return aligned


class _Batch:
    """Candidate poses to align with templates of one size.

    Args:
        places: The places of each template, at least one of each.
    """

    def __init__(self, places: Sequence[Candidates]) -> None:
        self._places = places
        ends = np.cumsum([len(each.poses) for each in places])
        self._rows = [slice(end - len(each.poses), end) for end, each in zip(ends, places, strict=True)]
        self._templates = np.repeat([each.aligner.template for each in places], np.diff(ends, prepend=0), axis=0)

    def align(self, canvas: Canvas, steps: int) -> list[Aligned]:
        """Return the best poses of each template's places during some steps."""
        points = grid(*self._places[0].aligner.size)
        levels = np.concatenate([each.levels for each in self._places])
        poses = np.concatenate([each.poses for each in self._places])
        best, best_scores = poses, np.full(len(poses), -1.0)
        for step in range(steps + 1):
            seen, lit = canvas.sample(poses @ points, levels)
            difference, scores = self._compared(seen, lit)
            better = scores > best_scores
            best_scores = np.where(better, scores, best_scores)
            best = np.where(better[:, None, None], poses, best)
            if step < steps:
                poses = self._moved(poses, difference, lit)
        return [(best[rows], best_scores[rows]) for rows in self._rows]

    def _compared(
        self, seen: NDArray[np.float32], lit: NDArray[np.float32] | None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the differences (N, M) of samples from their templates, and the correlation of each row."""
        if lit is None:
            seen = _unit(seen)
            each = zip(self._rows, self._places, strict=True)
            scores = np.concatenate([seen[rows] @ places.aligner.template for rows, places in each])
            return seen / np.maximum(scores, 0.2)[:, None] - self._templates, scores
        share = np.maximum(lit.mean(axis=1, keepdims=True), 1e-6)
        centred = (seen - (seen * lit).mean(axis=1, keepdims=True) / share) * lit
        template = (self._templates - (self._templates * lit).mean(axis=1, keepdims=True) / share) * lit
        norms = np.maximum(np.linalg.norm(centred, axis=1), np.sqrt(lit.shape[1]))
        lengths = np.maximum(np.linalg.norm(template, axis=1), 1e-6)
        scores = (centred * template).sum(axis=1) / norms / lengths
        difference = centred * (lengths / norms / np.maximum(scores, 0.2))[:, None] - template
        return difference, np.where(share[:, 0] >= MIN_LIT, scores, 0.0)

    def _moved(self, poses: Poses, difference: NDArray[np.float64], lit: NDArray[np.float32] | None) -> Poses:
        limit = ROBUST_SD * 1.5 * np.median(np.abs(difference), axis=1, keepdims=True)
        clipped = np.clip(difference, -limit, limit)
        each = zip(self._rows, self._places, strict=True)
        change = np.concatenate(
            [places.aligner.step(clipped[rows], None if lit is None else lit[rows]) for rows, places in each]
        )
        steps = np.tile(np.eye(3), (len(poses), 1, 1))
        steps[:, :2] += np.clip(change, -STEP_LIMIT, STEP_LIMIT).reshape(-1, 2, 3)
        return np.asarray(poses @ np.linalg.inv(steps))


def _unit(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return rows of mean 0 and norm 1; flat rows stay near 0."""
    centred = rows - rows.mean(axis=1, keepdims=True)
    norms = np.sqrt((centred * centred).sum(axis=1, keepdims=True))
    return np.asarray(centred / np.maximum(norms, np.float32(math.sqrt(rows.shape[1]))), np.float32)
