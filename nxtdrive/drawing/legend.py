"""Entries of a legend: a sample and what it means."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from nxtdrive.drawing.sheet import Color, Point, Sheet

SAMPLE_PX, PATCH_PX = 52, 18.0
"""Width of a sample, and of one of an area."""

Paint = Callable[[Sheet, Point], None]
"""Draws a sample around a place."""


@dataclass(frozen=True, slots=True)
class Key:
    """An entry of the legend.

    Attributes:
        text: What it means.
        paint: Draws the sample.
    """

    text: str
    paint: Paint


def line_sample(color: Color, width: float, dash: Sequence[float] = ()) -> Paint:
    """Return a sample of a line."""
    half = SAMPLE_PX / 2 - 2
    return lambda sheet, at: sheet.line([(at[0] - half, at[1]), (at[0] + half, at[1])], color, width, dash)


def marker_sample(shape: str, color: Color, size: float = 6.5) -> Paint:
    """Return a sample of a mark."""
    return lambda sheet, at: sheet.marker(shape, at, size, color)


def ring_sample(radius: float, color: Color, width: float) -> Paint:
    """Return a sample of a ring."""
    return lambda sheet, at: sheet.circle(at, radius, None, color, width)


def dot_sample(radius: float, color: Color) -> Paint:
    """Return a sample of a dot."""
    return lambda sheet, at: sheet.circle(at, radius, color)


def patch_sample(fill: Color, outline: Color) -> Paint:
    """Return a sample of an area."""
    half = PATCH_PX / 2
    return lambda sheet, at: sheet.box((at[0] - half, at[1] - half, at[0] + half, at[1] + half), fill, outline)
