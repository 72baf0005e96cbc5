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

COLUMNS = 24
FARTHEST_MM = 20000.0
"""Floor that nothing hides ends here, just below the horizon."""


@dataclass(frozen=True, slots=True)
class FloorLaw:
    """How well the floor is distinguished from objects on it.

    Attributes:
        row_sd_px: Standard deviation of the row at which the floor ends, in a frame 320 pixels wide.
        look_like_floor: Textures with the floor's colours: where they stand, the floor seems to go on.
        specks: Probability that the floor seems to end nearer, at a spot of another colour.
        speck_px: Then it ends at most this many rows lower.
    """

    row_sd_px: float
    look_like_floor: frozenset[str]
    specks: float
    speck_px: float = 60.0


FLOOR_LAW = FloorLaw(0.75, frozenset({"cardboard", "carton", "crate", "wood"}), 0.004)
"""On the floor of all simulated rooms, oak. Source: docs/vision.md section 3."""


class GeometricFloor:
    """Simulates the detector of the free floor without rendering.

    Args:
        law: Performance of the detector.
    """

    def __init__(self, law: FloorLaw = FLOOR_LAW) -> None:
        self._law = law

    def ends(self, panels: Sequence[Panel], viewpoint: Viewpoint, camera: Pinhole) -> Array:
        """Return the points of the map, (n, 2), at which the visible floor ends, for each of some columns of a frame.

        An object on legs hides only the floor behind it, so the floor seems to reach farther than it does.
        """
        rays = (np.arange(COLUMNS) + 0.5) / COLUMNS * camera.width - camera.width / 2
        rays /= camera.focal_px
        lens = viewpoint.x_mm, viewpoint.y_mm
        seen = [
            panel
            for panel in panels
            if panel.bottom_mm < viewpoint.height_mm
            and panel.texture_of(front=panel.shows_front_to(*lens)) not in self._law.look_like_floor
        ]
        depth = _depths_mm(seen, viewpoint, rays)
        heading = math.radians(viewpoint.heading_deg)
        cos, sin = math.cos(heading), math.sin(heading)
        x = viewpoint.x_mm + depth * (cos - rays * sin)
        y = viewpoint.y_mm + depth * (sin + rays * cos)
        return np.stack([x, y], axis=1)

    def error_px(self, generator: random.Random) -> float:
        """Return an error of the row at which the floor ends."""
        if generator.random() < self._law.specks:
            return generator.uniform(0.0, self._law.speck_px)
        return generator.gauss(0.0, self._law.row_sd_px)


def _depths_mm(panels: Sequence[Panel], viewpoint: Viewpoint, rays: Array) -> Array:
    """Return the depth along the heading, (n,), at which panels hide the floor, for rays by their angle's tangent."""
    ends = np.array([(p.x0_mm, p.y0_mm, p.x1_mm, p.y1_mm, p.bottom_mm) for p in panels], np.float64)
    x0, y0, x1, y1, bottom = ends.reshape(-1, 5).T
    (right0, depth0), (right1, depth1) = in_level_frame(x0, y0, viewpoint), in_level_frame(x1, y1, viewpoint)
    ahead = (depth0 > 0.0) | (depth1 > 0.0)
    right0, depth0, right1, depth1, bottom = (each[ahead] for each in (right0, depth0, right1, depth1, bottom))
    along_right, along_depth = right1 - right0, depth1 - depth0
    ray = rays[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (ray * depth0 - right0) / (along_right - ray * along_depth)
        depth = (depth0 + share * along_depth) * viewpoint.height_mm / (viewpoint.height_mm - bottom)
    depth = np.where((share >= 0.0) & (share <= 1.0) & (depth > NEAR_MM), depth, FARTHEST_MM)
    return np.asarray(depth.min(axis=1, initial=FARTHEST_MM), np.float64)
