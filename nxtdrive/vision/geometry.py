"""From pixels to bearings and distances: the pinhole model.

In a level camera a pixel column u lies at the bearing ``atan((u - cx) / f)``, positive right. Something H millimetres
high at the depth Z (along the optical axis) is ``f * H / Z`` pixels high, whatever its bearing; the distance to it is
``Z / cos(bearing)``. For a tilted or rolled camera, its corners are first turned to where a level camera would see
them, which is exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Box, Detection, Quad, quad_of

A4_HEIGHT_MM = 297.0
"""Long side of an A4 sheet. Source: ISO 216."""

MARKER_HEIGHT_MM, QR_HEIGHT_MM = 150.0, 160.0
"""Heights of the marker and the QR code on the sheets that `nxtdrive mission new` writes: with the white around it each
fits on a sheet of A4."""

DEFAULT_HFOV_DEG = 60.0
"""Horizontal field of view of a common webcam; an error scales every distance: see docs/vision.md on calibration."""


Array = NDArray[np.float64]

MIN_AHEAD = 1e-3
"""A ray that points up or down too steeply for a level camera counts as this far ahead, over its length."""
MIN_COS_TWICE_ROLL = 0.3
"""Minimum cosine of twice the roll at which the size of a rolled target is computed from its box: 36 degrees."""


@dataclass(frozen=True, slots=True)
class Mounting:
    """How the camera is turned on the robot: it is rolled about its line of sight, tilted, then turned to the right.

    Attributes:
        yaw_deg: It looks this far to the right.
        tilt_deg: It looks this far up, -45..45.
        roll_deg: It is turned clockwise by this, as seen from behind, -45..45.
    """

    yaw_deg: float = 0.0
    tilt_deg: float = 0.0
    roll_deg: float = 0.0

    @property
    def level(self) -> bool:
        """Whether it is neither tilted nor rolled."""
        return self.tilt_deg == 0.0 == self.roll_deg


STRAIGHT_AHEAD = Mounting()


@dataclass(frozen=True, slots=True)
class Pinhole:
    """A camera without lens distortion and with square pixels, its optical axis through the middle of the frame.

    Attributes:
        width: Of the frames, in pixels.
        focal_px: Focal length in pixels of such a frame.
        mounting: How it is turned on the robot.
        aspect: Height of the frames over their width.
    """

    width: int
    focal_px: float
    mounting: Mounting = STRAIGHT_AHEAD
    aspect: float = 0.75

    def __post_init__(self) -> None:
        if self.width <= 0 or not math.isfinite(self.focal_px) or self.focal_px <= 0:
            raise ConfigError(
                f"a camera with frames {self.width} px wide and a focal length of {self.focal_px} px is not possible.",
                remedy="Both must be positive; calibrate with an A4 sheet at a measured metre.",
            )

    @classmethod
    def from_hfov(cls, width: int, hfov_deg: float = DEFAULT_HFOV_DEG, mounting: Mounting = STRAIGHT_AHEAD) -> Pinhole:
        """Return the camera with a horizontal field of view of `hfov_deg`.

        Raises:
            ConfigError: The angle is not between 0 and 180 degrees.
        """
        if not 0 < hfov_deg < 180:
            raise ConfigError(
                f"a horizontal field of view of {hfov_deg:g} degrees is not possible.",
                remedy="Webcams have 50 to 80 degrees.",
            )
        return cls(width, width / 2 / math.tan(math.radians(hfov_deg) / 2), mounting)

    def resized(self, width: int, height: int | None = None) -> Pinhole:
        """Return the same camera with frames `width` pixels wide and `height` high; by default of the same shape."""
        aspect = self.aspect if height is None else height / width
        if width == self.width and aspect == self.aspect:
            return self
        return Pinhole(width, self.focal_px * width / self.width, self.mounting, aspect)

    def bearing_deg(self, u: float) -> float:
        """Return the bearing of the pixel column `u` off the optical axis of a level camera, positive right."""
        return math.degrees(math.atan((u - self.width / 2) / self.focal_px))

    def directions(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Return where the rays of pixels point: bearings from the robot's forward axis, and how far below level.

        Both in degrees; bearings are positive right, the others negative above the horizon.
        """
        u, v = self._level(u, v)
        right, down = (u - self.width / 2) / self.focal_px, (v - self.width * self.aspect / 2) / self.focal_px
        below_deg = np.degrees(np.arctan2(down, np.hypot(1.0, right)))
        return np.degrees(np.arctan(right)) + self.mounting.yaw_deg, below_deg

    def distance_mm(self, height_px: float, height_mm: float, bearing_deg: float = 0.0) -> float:
        """Return the distance of an upright object `height_mm` high that appears `height_px` high at `bearing_deg`.

        Raises:
            ValueError: A height is not positive.
        """
        if height_px <= 0 or height_mm <= 0:
            raise ValueError(f"heights must be positive, not {height_px} px and {height_mm} mm")
        return self.focal_px * height_mm / height_px / math.cos(math.radians(bearing_deg))

    def locate(self, detection: Detection, height_mm: float) -> tuple[float, float]:
        """Return (bearing_deg, distance_mm) of a detection, to the centre of the target.

        The bearing is from the robot's forward axis, the distance horizontal from the lens. The corners are used where
        the detector reports them: they hold for a target seen at an angle too.
        """
        if not self.mounting.level:
            detection = self._levelled(detection)
        u, height_px = _axis(detection)
        bearing_deg = self.bearing_deg(u)
        return bearing_deg + self.mounting.yaw_deg, self.distance_mm(height_px, height_mm, bearing_deg)

    def edges_mm(self, detection: Detection, height_mm: float) -> tuple[float, float]:
        """Return how far above the lens the lower and the upper edge of a target are, by its apparent size."""
        if not self.mounting.level:
            detection = self._levelled(detection)
        quad = detection.quad
        top = detection.box[1] if quad is None else (quad[0][1] + quad[1][1]) / 2
        above_mm = height_mm * (self.width * self.aspect / 2 - top) / _axis(detection)[1]
        return above_mm - height_mm, above_mm

    def _levelled(self, detection: Detection) -> Detection:
        """Return the detection as the same camera would have it if it were neither tilted nor rolled."""
        quad = detection.quad or _upright(detection.box, math.radians(self.mounting.roll_deg))
        levelled = quad_of(np.stack(self._level(*np.array(quad).T), axis=1))
        return Detection(detection.box, detection.score, levelled)

    def _level(self, u: Array, v: Array) -> tuple[Array, Array]:
        centre_u, centre_v = self.width / 2, self.width * self.aspect / 2
        right, down = (u - centre_u) / self.focal_px, (v - centre_v) / self.focal_px
        roll, tilt = math.radians(self.mounting.roll_deg), math.radians(self.mounting.tilt_deg)
        right, down = right * math.cos(roll) - down * math.sin(roll), right * math.sin(roll) + down * math.cos(roll)
        down, ahead = down * math.cos(tilt) - math.sin(tilt), down * math.sin(tilt) + math.cos(tilt)
        ahead = np.maximum(ahead, MIN_AHEAD)
        return centre_u + self.focal_px * right / ahead, centre_v + self.focal_px * down / ahead


def _axis(detection: Detection) -> tuple[float, float]:
    """Return the column of the target's centre and its height in pixels there."""
    if detection.quad is None:
        return detection.centre[0], detection.box[3]
    top_left, top_right, bottom_right, bottom_left = detection.quad
    left, right = math.dist(top_left, bottom_left), math.dist(top_right, bottom_right)
    # Depth is linear along the image, so 1/height is: the middle's height is the harmonic mean of the sides'.
    return crossing(detection.quad)[0], 2 * left * right / (left + right)


def _upright(box: Box, roll: float) -> Quad:
    """Return the corners of something upright that a camera rolled by `roll` sees in a box.

    The box of a rectangle w wide and h high that is turned by the roll is ``w cos + h sin`` wide and ``w sin + h cos``
    high, which is solved for both; near 45 degrees, where that has no solution, the box's shape is kept.
    """
    left, top, box_width, box_height = box
    cos, sin = math.cos(roll), abs(math.sin(roll))
    scale = 1 / (cos + sin)
    width, height = box_width * scale, box_height * scale
    if (divisor := cos * cos - sin * sin) > MIN_COS_TWICE_ROLL:
        width = max(width / 4, (cos * box_width - sin * box_height) / divisor)
        height = max(height / 4, (cos * box_height - sin * box_width) / divisor)
    u, v, sin = left + box_width / 2, top + box_height / 2, -math.sin(roll)
    corners = ((-width, -height), (width, -height), (width, height), (-width, height))
    a, b, c, d = ((u + (x * cos - y * sin) / 2, v + (x * sin + y * cos) / 2) for x, y in corners)
    return a, b, c, d


def crossing(quad: Quad) -> tuple[float, float]:
    """Return the intersection (u, v) of a convex quad's diagonals, the image of the target's centre."""
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = quad
    along = (cx - ax, cy - ay)
    across = (dx - bx, dy - by)
    determinant = along[0] * across[1] - along[1] * across[0]
    if determinant == 0:
        return (ax + bx + cx + dx) / 4, (ay + by + cy + dy) / 4
    t = ((bx - ax) * across[1] - (by - ay) * across[0]) / determinant
    return ax + t * along[0], ay + t * along[1]
