"""Geometric vision: what the picture detector would report, computed from geometry and chance without an image.

Rendering and searching a frame takes tens of milliseconds. For sweeps over thousands of missions this model computes
how large the picture appears, at which angle, how much of it is visible and how fast the camera turns; a fit to
the real detector gives the probability of a detection. `python -m tools.dev.fit_geometric`, in a checkout, measures the
detector and prints the model.

Each frame is an independent draw. A real detector that misses a picture from a standstill tends to miss it again in the
next frame, so the model slightly favours a robot that stops and looks for a long time.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sim_backend.camera.geometric_floor import GeometricFloor
from sim_backend.camera.lens import motion_blur_px
from sim_backend.camera.optics import PINHOLE_OPTICS, Optics
from sim_backend.camera.projection import Pinhole
from sim_backend.camera.scene import NEAR_MM, Panel, Viewpoint, in_camera_frame, in_level_frame
from sim_backend.plane import Length

Point = tuple[float, float, float]
Points = NDArray[np.float64]
Quad = tuple[tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]]
"""Corners (column, row) in pixels, (0, 0) at the upper left edge of the frame: upper left, upper right, lower right and
lower left of the picture as seen from its front."""

WORK_WIDTH_PX = 320
"""Width of the detector's working copy; sizes in the model are pixels of that copy."""

SHARES = (np.arange(6) + 0.5) / 6
"""Sample positions on the picture, across and along."""


@dataclass(frozen=True, slots=True)
class Falloff:
    """A hit rate that falls from 1 to 0 over a quantity, as a logistic curve.

    Attributes:
        half: Value at which the rate is one half.
        width: Width of the transition; positive falls with growing values, negative with shrinking ones.
    """

    half: float
    width: float

    def rate(self, value: float) -> float:
        """Return the hit rate at `value`, 0..1."""
        return 1.0 / (1.0 + math.exp(min(60.0, max(-60.0, (value - self.half) / self.width))))


@dataclass(frozen=True, slots=True)
class DetectorModel:
    """Probability and accuracy of detections.

    Attributes:
        log2_height: Falloff over the binary logarithm of the apparent height in pixels of the working copy.
        slant_deg: Falloff over the angle between the picture's normal and the line of sight.
        hidden: Falloff over the share of the picture that is covered or outside the frame.
        blur: Falloff over the motion blur as a share of the apparent height.
        dark: Falloff over the binary logarithm of the frame's brightness.
        glare: The same, for frames that are too bright.
        bearing_sd_deg: Standard deviation of the bearing.
        distance_sd: Standard deviation of the distance, as a share of it.
    """

    log2_height: Falloff
    slant_deg: Falloff
    hidden: Falloff
    blur: Falloff
    bearing_sd_deg: float
    distance_sd: float
    dark: Falloff = Falloff(-99.0, -1.0)
    glare: Falloff = Falloff(99.0, 1.0)

    def hit_rate(self, height_px: float, slant_deg: float, hidden: float, blur: float) -> float:
        """Return the probability of a detection in one frame, 0..1."""
        return (
            self.log2_height.rate(math.log2(max(1.0, height_px)))
            * self.slant_deg.rate(slant_deg)
            * self.hidden.rate(hidden)
            * self.blur.rate(blur)
        )

    def visibility(self, brightness: float) -> float:
        """Return the factor on the probability of a detection, 0..1, in a frame of this brightness."""
        if brightness == 1.0:
            return 1.0
        light = math.log2(max(1e-6, brightness))
        return self.dark.rate(light) * self.glare.rate(light)


PICTURE_MODEL = DetectorModel(
    log2_height=Falloff(3.98, -0.0269),
    slant_deg=Falloff(61.2, 2.66),
    hidden=Falloff(0.368, 0.0748),
    blur=Falloff(0.281, 0.0249),
    bearing_sd_deg=0.012,
    distance_sd=0.031,
    dark=Falloff(-2.80, -0.030),
    glare=Falloff(1.97, 0.144),
)
"""The `picture` detector on "lena" and "rilakkuma". Source: tools/dev/fit_geometric.py, 600 frames in each sweep, but
100 for `dark` and `glare`."""


@dataclass(frozen=True, slots=True)
class PictureView:
    """A picture as it appears in a frame.

    Attributes:
        panel: The picture.
        bearing_deg: Bearing of its centre from the camera's heading, positive right.
        distance_mm: Distance to its centre along the floor.
        height_px: Apparent height at its centre in pixels of the frame.
        slant_deg: Angle between its normal and the line of sight, in plan view.
        hidden: Share that is covered or outside the frame, 0..1.
        blur: Motion blur as a share of the apparent height.
    """

    panel: Panel
    bearing_deg: float
    distance_mm: float
    height_px: float
    slant_deg: float
    hidden: float
    blur: float


class GeometricDetector:
    """Simulates detections without rendering. The same seed and calls give the same results.

    Args:
        size: Width and height of the simulated frames in pixels.
        hfov_deg: Horizontal field of view.
        seed: Seed of the random draws.
        model: Performance of the detector.
        shutter_s: Shutter time, for motion blur; as in `lens.LensEffects`.
        optics: Distortion of the lens, and shutter.

    Attributes:
        pinhole: Frames and focal length.
        generator: Its random generator.
    """

    def __init__(
        self,
        size: tuple[int, int] = (320, 240),
        hfov_deg: float = 60.0,
        seed: int = 0,
        model: DetectorModel = PICTURE_MODEL,
        shutter_s: float = 0.02,
        optics: Optics = PINHOLE_OPTICS,
    ) -> None:
        self.pinhole = Pinhole(*size, hfov_deg)
        self._model = model
        self._shutter_s, self._optics = shutter_s, optics
        self.generator = random.Random(seed)
        self._floor = GeometricFloor()

    def observe(
        self,
        panels: Sequence[Panel],
        viewpoint: Viewpoint,
        name: str,
        turn_rate_deg_s: float = 0.0,
        *,
        brightness: float = 1.0,
        farthest_mm: float = math.inf,
    ) -> Quad | None:
        """Return the detection of the picture with texture `name` in one frame.

        Args:
            panels: All surfaces of the world, including the picture.
            viewpoint: Pose of the lens.
            name: Texture of the picture.
            turn_rate_deg_s: Turn rate of the camera.
            brightness: Of the frame; 1 is a well-lit room.
            farthest_mm: A picture that appears farther away is not detected.

        Returns:
            The corners of the picture with the detector's errors; None without a detection.
        """
        for view in self.views(panels, viewpoint, name, turn_rate_deg_s):
            if self.generator.random() < self.hit_rate(view) * self._model.visibility(brightness):
                return self._report(view, viewpoint, turn_rate_deg_s, farthest_mm)
        return None

    def floor_ends(
        self, panels: Sequence[Panel], viewpoint: Viewpoint, turn_rate_deg_s: float = 0.0
    ) -> NDArray[np.float64]:
        """Return the pixels, (n, 2) columns and rows, at which the floor ends in one frame; arguments as in `observe`.

        Directions in which it ends below the frame are left out.
        """
        points = self._floor.ends(panels, viewpoint, self.pinhole)
        if self._optics.readout_s and turn_rate_deg_s:
            pixels = [self._pixel((x, y, z), viewpoint, turn_rate_deg_s) for x, y, z in points]
            u, v = np.array(pixels, np.float64).reshape(-1, 2).T
        else:
            u, v = self._project((points[:, 0], points[:, 1], points[:, 2]), viewpoint)
        errors_px = np.array([self._floor.error_px(self.generator) for _ in points])
        v = v + errors_px * self.pinhole.width / WORK_WIDTH_PX
        v = np.where(points[:, 2] > 0.0, np.maximum(v, 0.0), v)  # up to the upper edge of the frame
        inside = (u >= 0.0) & (u < self.pinhole.width) & (v >= 0.0) & (v < self.pinhole.height)
        return np.asarray(np.stack([u, v], axis=1)[inside])

    def views(
        self, panels: Sequence[Panel], viewpoint: Viewpoint, name: str, turn_rate_deg_s: float = 0.0
    ) -> list[PictureView]:
        """Return how every picture with that texture looks from the front, nearest first; arguments as in `observe`."""
        found = [self._view(panel, panels, viewpoint, turn_rate_deg_s) for panel in panels if panel.texture == name]
        return sorted((view for view in found if view is not None), key=lambda view: view.distance_mm)

    def hit_rate(self, view: PictureView) -> float:
        """Return the probability that a picture with this appearance is detected in one frame, 0..1."""
        work_px = view.height_px * WORK_WIDTH_PX / self.pinhole.width
        return self._model.hit_rate(work_px, view.slant_deg, view.hidden, view.blur)

    def _view(
        self, panel: Panel, panels: Sequence[Panel], viewpoint: Viewpoint, turn_rate_deg_s: float
    ) -> PictureView | None:
        """Return the appearance of the front of a picture; None from behind, too near or completely hidden."""
        if not panel.shows_front_to(viewpoint.x_mm, viewpoint.y_mm):
            return None
        (right0, depth0), (right1, depth1) = (in_level_frame(*foot, viewpoint) for foot in panel.foot_points_mm)
        depths = () if viewpoint.level else (in_camera_frame(*corner, viewpoint)[2] for corner in _corners(panel))
        if min(depth0, depth1, *depths) < NEAR_MM:
            return None
        points = _grid(panel)
        free = self._in_frame(points, viewpoint)
        if free.any():  # most pictures are outside of the frame, which is found out quickly
            free &= ~_covered(points, panel, panels, viewpoint)
        if not free.any():
            return None
        right, depth = in_level_frame(*panel.centre_mm, viewpoint)
        focal, distance = self.pinhole.focal_px, math.hypot(right, depth)
        # distance from the lens to the picture's plane over distance to its centre: cosine of the slant
        cosine = (right1 * depth0 - right0 * depth1) / (panel.width_mm * distance)
        ends = (in_camera_frame(*panel.centre_mm, edge, viewpoint) for edge in (panel.top_mm, panel.bottom_mm))
        upper, lower = ((focal * u / w, focal * v / w) for u, v, w in ends)
        height_px = math.dist(upper, lower)
        return PictureView(
            panel,
            bearing_deg=math.degrees(math.atan2(right, depth)),
            distance_mm=distance,
            height_px=height_px,
            slant_deg=math.degrees(math.acos(min(1.0, cosine))),
            hidden=1.0 - float(np.mean(free)),
            blur=motion_blur_px(focal, turn_rate_deg_s, self._shutter_s) / height_px,
        )

    def _in_frame(self, points: Points, viewpoint: Viewpoint) -> NDArray[np.bool_]:
        """Return which of the points, (n, 3), are inside the frame."""
        right, down, depth = in_camera_frame(points[:, 0], points[:, 1], points[:, 2], viewpoint)
        if self._optics.distortion_k1:
            stretch = self._optics.stretch((right**2 + down**2) / depth**2)
            right, down = right * stretch, down * stretch
        half_width, half_height = self.pinhole.width / 2, self.pinhole.height / 2
        focal = self.pinhole.focal_px
        within = (np.abs(right) * focal < half_width * depth) & (np.abs(down) * focal < half_height * depth)
        return np.asarray(within, np.bool_)

    def _report(
        self, view: PictureView, viewpoint: Viewpoint, turn_rate_deg_s: float, farthest_mm: float
    ) -> Quad | None:
        """Return the picture's corners with the detector's errors: turned about the lens, and smaller or larger."""
        stretch = math.exp(self.generator.gauss(0.0, self._model.distance_sd))
        turn_deg = self.generator.gauss(0.0, self._model.bearing_sd_deg)
        if view.distance_mm * stretch > farthest_mm:
            return None
        seen_from = replace(viewpoint, heading_deg=viewpoint.heading_deg - turn_deg)
        corners = _corners(view.panel, 1.0 / stretch)
        first, second, third, fourth = (self._pixel(corner, seen_from, turn_rate_deg_s) for corner in corners)
        return first, second, third, fourth

    def _pixel(self, point: Point, viewpoint: Viewpoint, turn_rate_deg_s: float) -> tuple[float, float]:
        """Return column and row of a point; a rolling shutter sees it from where the camera has turned to by then."""
        at = self._project(point, viewpoint)
        if not self._optics.readout_s or not turn_rate_deg_s:
            return at
        turn_deg = self._optics.row_turn_deg(at[1] / self.pinhole.height, turn_rate_deg_s)
        return self._project(point, replace(viewpoint, heading_deg=viewpoint.heading_deg + turn_deg))

    def _project(self, point: tuple[Length, Length, Length], viewpoint: Viewpoint) -> tuple[Length, Length]:
        right, down, depth = in_camera_frame(*point, viewpoint)
        x, y = self._optics.distorted(right / depth, down / depth)
        focal = self.pinhole.focal_px
        return self.pinhole.width / 2 + focal * x, self.pinhole.height / 2 + focal * y


def _corners(panel: Panel, scale: float = 1.0) -> tuple[Point, Point, Point, Point]:
    """Return the corners of a panel scaled about its centre: x, y, height; in the order of `Quad`."""
    (x, y), height = panel.centre_mm, (panel.top_mm + panel.bottom_mm) / 2
    dx, dy = (panel.x1_mm - panel.x0_mm) / 2 * scale, (panel.y1_mm - panel.y0_mm) / 2 * scale
    rise = (panel.top_mm - panel.bottom_mm) / 2 * scale
    left, right = (x - dx, y - dy), (x + dx, y + dy)
    return (*left, height + rise), (*right, height + rise), (*right, height - rise), (*left, height - rise)


@lru_cache(maxsize=64)
def _grid(panel: Panel) -> Points:
    """Return sample points on a panel, (n, 3): x, y, height."""
    across, along = (axis.ravel() for axis in np.meshgrid(SHARES, SHARES))
    return np.stack(
        [
            panel.x0_mm + across * (panel.x1_mm - panel.x0_mm),
            panel.y0_mm + across * (panel.y1_mm - panel.y0_mm),
            panel.bottom_mm + along * (panel.top_mm - panel.bottom_mm),
        ],
        axis=1,
    )


def _covered(points: Points, picture: Panel, panels: Sequence[Panel], viewpoint: Viewpoint) -> NDArray[np.bool_]:
    """Return which points another panel hides: in plan view it crosses the line of sight, at a height it covers."""
    others = [(p.x0_mm, p.y0_mm, p.x1_mm, p.y1_mm, p.bottom_mm, p.top_mm) for p in panels if p is not picture]
    if not others:
        return np.zeros(len(points), np.bool_)
    x0, y0, x1, y1, bottom, top = np.array(others, np.float64).T[:, :, None]
    to_x, to_y = points[:, 0] - viewpoint.x_mm, points[:, 1] - viewpoint.y_mm
    along_x, along_y = x1 - x0, y1 - y0
    from_x, from_y = x0 - viewpoint.x_mm, y0 - viewpoint.y_mm
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = to_x * along_y - to_y * along_x
        share = (from_x * along_y - from_y * along_x) / crossing
        place = (from_x * to_y - from_y * to_x) / crossing
        height = viewpoint.height_mm + share * (points[:, 2] - viewpoint.height_mm)
    hides = (share > 0.0) & (share < 1.0) & (place >= 0.0) & (place <= 1.0) & (height >= bottom) & (height <= top)
    return np.asarray(hides.any(axis=0), np.bool_)
