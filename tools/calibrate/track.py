"""The recording of the robot's motion in front of the marker sheet."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .sheet import Seen

Array = NDArray[np.float64]

STEADY_S, STEADY_DEG, UNEVEN = 0.25, 3.0, 0.35
"""Before and after the exposure of a view from steady motion: a time, the least turn of a wheel during it, and by which
share the turns may differ."""
SMOOTH_S = 0.2
"""Counts are averaged over this time."""


@dataclass(frozen=True, slots=True)
class View:
    """The sheet in one frame.

    Attributes:
        time_s: When the frame arrived.
        seen: The corners in it.
    """

    time_s: float
    seen: Seen


@dataclass(slots=True)
class Track:
    """Counts of the wheels and views of the sheet, in order of time.

    Attributes:
        size: Width and height of the frames in pixels.
        counts: Time, left and right count in degrees, forward positive.
        views: Frames in which markers were seen.
        ranges: Time and echo in millimetres, of the sonar.
    """

    size: tuple[int, int]
    counts: list[tuple[float, float, float]] = field(default_factory=list)
    views: list[View] = field(default_factory=list)
    ranges: list[tuple[float, float]] = field(default_factory=list)

    def steady(self, latency_s: float) -> Track:
        """Return the same with only those views that were exposed while the wheels turned steadily.

        Counts are whole degrees. Only while they change is their mean over a short time more precise.
        """
        counts = np.asarray(self.counts, np.float64)
        exposed_s = np.array([view.time_s for view in self.views]) - latency_s
        before, now, after = (
            np.stack([np.interp(exposed_s + shift, counts[:, 0], counts[:, column]) for column in (1, 2)])
            for shift in (-STEADY_S, 0.0, STEADY_S)
        )
        first, second = now - before, after - now
        moves = np.abs(first).max(axis=0) > STEADY_DEG
        even = np.abs(first - second).max(axis=0) < UNEVEN * np.abs(first).max(axis=0)
        inside = (exposed_s > counts[0, 0] + STEADY_S) & (exposed_s < counts[-1, 0] - STEADY_S)
        views = [view for view, good in zip(self.views, moves & even & inside, strict=True) if good]
        return replace(self, views=views)

    def until(self, time_s: float) -> Track:
        """Return the recording up to a time."""
        return Track(
            self.size,
            [each for each in self.counts if each[0] <= time_s],
            [each for each in self.views if each.time_s <= time_s],
            [each for each in self.ranges if each[0] <= time_s],
        )


def poses(counts: Array, mm_per_deg: tuple[float, float], track_mm: float, slipped: Array | float = 0.0) -> Array:
    """Integrate counts to poses.

    Args:
        counts: Time, left and right count in degrees, one row each.
        mm_per_deg: Distance of the left and the right wheel per degree.
        track_mm: Distance between the wheels.
        slipped: By how much more the robot turned between two counts than these say, radians, positive right.

    Returns:
        Time, x, y in millimetres and heading in radians, positive right, one row per count; the first is at the origin.
    """
    left, right = np.diff(counts[:, 1]) * mm_per_deg[0], np.diff(counts[:, 2]) * mm_per_deg[1]
    turned = (left - right) / track_mm + slipped
    heading = np.concatenate([[0.0], np.cumsum(turned)])
    middle, driven_mm = heading[:-1] + turned / 2, (left + right) / 2
    x = np.concatenate([[0.0], np.cumsum(driven_mm * np.cos(middle))])
    y = np.concatenate([[0.0], np.cumsum(driven_mm * np.sin(middle))])
    return np.stack([counts[:, 0], x, y, heading], axis=1)


def smoothed(counts: Array) -> Array:
    """Return counts averaged over a short time, at the same times."""
    times = counts[:, 0]
    early, late = np.maximum(times - SMOOTH_S / 2, times[0]), np.minimum(times + SMOOTH_S / 2, times[-1])
    # the same time before and after, so that steady motion stays unchanged
    half = np.maximum(np.minimum(times - early, late - times), 1e-6)
    columns = [times]
    for column in (1, 2):
        steps = np.diff(times) * (counts[1:, column] + counts[:-1, column]) / 2
        area = np.concatenate([[0.0], np.cumsum(steps)])
        ends = [_area_until(times + sign * half, times, counts[:, column], area) for sign in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2 * half))
    return np.stack(columns, axis=1)


def _area_until(until: Array, times: Array, values: Array, area: Array) -> Array:
    """Return the integral of a line through points up to some times."""
    i = np.clip(np.searchsorted(times, until, side="right") - 1, 0, len(times) - 2)
    part = until - times[i]
    slope = (values[i + 1] - values[i]) / np.maximum(times[i + 1] - times[i], 1e-9)
    return np.asarray(area[i] + part * values[i] + slope * part**2 / 2)


def at_times(path: Array, times_s: Array) -> tuple[Array, Array, Array]:
    """Return x, y and heading at times, interpolated."""
    x, y, heading = (np.interp(times_s, path[:, 0], path[:, column]) for column in (1, 2, 3))
    return x, y, heading
