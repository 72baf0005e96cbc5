"""Where the floor ends in a frame, by geometry and chance without an image, as the detector of the free floor finds it.

In plan view a column of a level camera's frame is a ray. The floor ends where the lower edge of a panel hides it.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_backend.camera.projection import Pinhole
from sim_backend.camera.scene import NEAR_MM, Panel, Viewpoint, in_level_frame

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

COLUMNS = 24
FARTHEST_MM = 20000.0
"""Floor that nothing hides ends here, just below the horizon."""


@dataclass(frozen=True, slots=True)
class FloorModel:
    """How well the floor is distinguished from objects on it.

    Attributes:
        row_sd_px: Standard deviation of the row at which the floor ends, in a frame 320 pixels wide.
        look_like_floor: Textures with the floor's colours: where they stand, the floor seems to continue.
        specks: Probability that the floor seems to end nearer, at a spot of another colour.
        speck_px: Then it ends at most this many rows lower.
    """

    row_sd_px: float
    look_like_floor: frozenset[str]
    specks: float
    speck_px: float = 60.0


FLOOR_MODEL = FloorModel(0.75, frozenset({"cardboard", "carton", "crate", "wood"}), 0.004)
"""On the floor of all simulated rooms, oak. Source: docs/ranges.md section 3."""


class GeometricFloor:
    """Simulates the detector of the free floor without rendering.

    Args:
        model: Performance of the detector.
    """

    def __init__(self, model: FloorModel = FLOOR_MODEL) -> None:
        self._model = model

    def ends(self, panels: Sequence[Panel], viewpoint: Viewpoint, camera: Pinhole) -> Array:
        """Return the points, (n, 3) on the map and above it, at which floor seems to end, for some columns of a frame.

        An object on legs hides only the floor behind it, so the floor seems to reach farther than it does. One that
        looks like the floor seems to be floor up to its upper edge, and hides what is behind it; if that edge is above
        the horizon, the floor seems to end there.
        """
        rays = (np.arange(COLUMNS) + 0.5) / COLUMNS * camera.width - camera.width / 2
        rays /= camera.focal_px
        below = [panel for panel in panels if panel.bottom_mm < viewpoint.height_mm]
        foot, met = _met(below, viewpoint, rays)
        alike = np.array([self._looks_like_floor(panel, viewpoint) for panel in met], bool)
        begins = _beyond(foot, [panel.bottom_mm for panel in met], viewpoint)
        depth = begins[:, ~alike].min(axis=1, initial=FARTHEST_MM)
        hiding = alike & (begins < depth[:, None]).any(axis=0)
        if hiding.any():
            ends = _beyond(foot, [panel.top_mm for panel in met], viewpoint)
            depth = _uncovered(foot, begins, ends, hiding, ~alike)
        above_mm = np.zeros(len(rays))
        if (beyond := np.isinf(depth)).any():
            tops_mm = np.array([panel.top_mm for panel in met], np.float64)
            rises = (tops_mm - viewpoint.height_mm) / foot[beyond]
            highest = np.where(hiding & np.isfinite(foot[beyond]), rises, -np.inf).argmax(axis=1)
            depth[beyond], above_mm[beyond] = foot[beyond, highest], tops_mm[highest]
        heading = math.radians(viewpoint.heading_deg)
        cos, sin = math.cos(heading), math.sin(heading)
        x = viewpoint.x_mm + depth * (cos - rays * sin)
        y = viewpoint.y_mm + depth * (sin + rays * cos)
        return np.stack([x, y, above_mm], axis=1)

    def _looks_like_floor(self, panel: Panel, viewpoint: Viewpoint) -> bool:
        front = panel.shows_front_to(viewpoint.x_mm, viewpoint.y_mm)
        return panel.texture_of(front=front) in self._model.look_like_floor

    def error_px(self, generator: random.Random) -> float:
        """Return an error of the row at which the floor ends."""
        if generator.random() < self._model.specks:
            return generator.uniform(0.0, self._model.speck_px)
        return generator.gauss(0.0, self._model.row_sd_px)


def _met(panels: Sequence[Panel], viewpoint: Viewpoint, rays: Array) -> tuple[Array, list[Panel]]:
    """Return at which depth along the heading rays, by their tangents, meet panels, (rays, n), and those panels.

    It is infinite where a ray does not meet one.
    """
    feet = np.array([(p.x0_mm, p.y0_mm, p.x1_mm, p.y1_mm) for p in panels], np.float64)
    x0, y0, x1, y1 = feet.reshape(-1, 4).T
    (right0, depth0), (right1, depth1) = in_level_frame(x0, y0, viewpoint), in_level_frame(x1, y1, viewpoint)
    ahead = np.flatnonzero((depth0 > 0.0) | (depth1 > 0.0))
    right0, depth0, right1, depth1 = (each[ahead] for each in (right0, depth0, right1, depth1))
    along_right, along_depth = right1 - right0, depth1 - depth0
    ray = rays[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (ray * depth0 - right0) / (along_right - ray * along_depth)
        depth = depth0 + share * along_depth
    met = (share >= 0.0) & (share <= 1.0) & (depth > NEAR_MM)
    seen = np.flatnonzero(met.any(axis=0))
    return np.where(met, depth, np.inf)[:, seen], [panels[each] for each in ahead[seen]]


def _beyond(foot: Array, heights_mm: Sequence[float], viewpoint: Viewpoint) -> Array:
    """Return at which depth the floor would lie that is seen in the direction of edges at these heights, (rays, n).

    It is infinite above the horizon.
    """
    lower_mm = np.maximum(viewpoint.height_mm - np.array(heights_mm, np.float64), 0.0)
    with np.errstate(divide="ignore"):
        beyond: Array = foot * viewpoint.height_mm / lower_mm
    return beyond


def _uncovered(foot: Array, begins: Array, ends: Array, hiding: Mask, solid: Mask) -> Array:
    """Return the depth, (rays,), at which the floor seems to end where panels look like it and hide what is behind.

    It is infinite where one of them reaches above the horizon and nothing ends the floor before.

    Args:
        foot: Depth of each panel, (rays, n).
        begins: Depth of the floor in the direction of its lower edge.
        ends: The same of its upper edge.
        hiding: Which of them look like the floor and hide something.
        solid: Which of them do not look like the floor.
    """
    behind, shown, horizon = foot[:, solid], begins[:, solid], np.full(len(foot), FARTHEST_MM)
    for depth, begin, end in zip(foot.T[hiding], begins.T[hiding], ends.T[hiding], strict=True):
        hidden = (behind > depth[:, None]) & (shown >= begin[:, None])
        shown = np.where(hidden, np.maximum(shown, end[:, None]), shown)
        horizon[np.isfinite(depth) & np.isinf(end)] = np.inf
    seen: Array = np.column_stack([np.where(shown < ends[:, solid], shown, np.inf), horizon]).min(axis=1)
    return seen
