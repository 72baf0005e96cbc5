"""How much of a target fits into the frame: one that hangs high or stands low leaves it as the robot comes nearer."""

from __future__ import annotations

import math

from behaviors.mission.robot import FRAME_ASPECT, CameraTable
from behaviors.ports import Edges

FILLS_SHARE = 0.85
"""A target fills the frame if it reaches this share of the way from the horizon to the frame's upper or lower edge."""
STEEPEST_DEG = 85.0
"""The frame's edges are taken to point up or down no more steeply than this."""


class FrameFit:
    """What the frames of one camera show of something upright, from how far away.

    Args:
        camera: The camera.
    """

    def __init__(self, camera: CameraTable) -> None:
        half_deg = math.degrees(math.atan(FRAME_ASPECT * math.tan(math.radians(camera.hfov_deg) / 2)))
        self._up, self._down = _slope(half_deg + camera.tilt_deg), _slope(half_deg - camera.tilt_deg)

    def fills_mm(self, edges_mm: Edges) -> float:
        """Return from how near a target fills the frame; infinite if it never fits in, as one below a raised view."""
        lower_mm, upper_mm = edges_mm
        return max(_nearest_mm(upper_mm, self._up), _nearest_mm(-lower_mm, self._down))

    def shown(self, edges_mm: Edges, distance_mm: float) -> float:
        """Return the share of a target's height, 0..1, that the frame shows at this distance from the lens."""
        lower_mm, upper_mm = edges_mm
        shown_mm = min(upper_mm, distance_mm * self._up) - max(lower_mm, -distance_mm * self._down)
        return max(0.0, shown_mm / (upper_mm - lower_mm))


def _slope(deg: float) -> float:
    return math.tan(math.radians(max(-STEEPEST_DEG, min(STEEPEST_DEG, deg))))


def _nearest_mm(edge_mm: float, slope: float) -> float:
    """Return from how near an edge above the lens (or below, with `-lower_mm`) fills that half of the frame."""
    if edge_mm <= 0.0:
        return 0.0
    return edge_mm / (FILLS_SHARE * slope) if slope > 0.0 else math.inf
