"""From pixels to bearings and distances: the pinhole model of a level camera.

A pixel column u lies at the bearing ``atan((u - cx) / f)``, positive right. Something H millimetres high at the depth Z
(along the optical axis) is ``f * H / Z`` pixels high, whatever its bearing; the distance to it is ``Z / cos(bearing)``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Detection, Quad

A4_HEIGHT_MM = 297.0
"""Long side of an A4 sheet. Source: ISO 216."""

DEFAULT_HFOV_DEG = 60.0
"""Horizontal field of view of a common webcam; an error scales every distance: see docs/vision.md on calibration."""


@dataclass(frozen=True, slots=True)
class Pinhole:
    """A camera without lens distortion and with square pixels, its optical axis through the middle of the frame.

    Attributes:
        width: Of the frames, in pixels.
        focal_px: Focal length in pixels of such a frame.
    """

    width: int
    focal_px: float

    def __post_init__(self) -> None:
        if self.width <= 0 or not math.isfinite(self.focal_px) or self.focal_px <= 0:
            raise ConfigError(
                f"A camera with frames {self.width} px wide and a focal length of {self.focal_px} px cannot exist.",
                remedy="Both must be positive; calibrate with an A4 sheet at a measured metre.",
            )

    @classmethod
    def from_hfov(cls, width: int, hfov_deg: float = DEFAULT_HFOV_DEG) -> Pinhole:
        """Return the camera with a horizontal field of view of `hfov_deg`.

        Raises:
            ConfigError: the angle is not between 0 and 180 degrees.
        """
        if not 0 < hfov_deg < 180:
            raise ConfigError(
                f"A horizontal view of {hfov_deg:g} degrees cannot be.", remedy="Webcams have 50 to 80 degrees."
            )
        return cls(width, width / 2 / math.tan(math.radians(hfov_deg) / 2))

    @property
    def hfov_deg(self) -> float:
        """Horizontal field of view, degrees."""
        return 2 * math.degrees(math.atan(self.width / 2 / self.focal_px))

    def resized(self, width: int) -> Pinhole:
        """Return the same camera with frames `width` pixels wide."""
        return self if width == self.width else Pinhole(width, self.focal_px * width / self.width)

    def bearing_deg(self, u: float) -> float:
        """Return the bearing of the pixel column `u`, positive right."""
        return math.degrees(math.atan((u - self.width / 2) / self.focal_px))

    def distance_mm(self, height_px: float, height_mm: float, bearing_deg: float = 0.0) -> float:
        """Return the distance of an upright object `height_mm` high that appears `height_px` high at `bearing_deg`.

        Raises:
            ValueError: a height is not positive.
        """
        if height_px <= 0 or height_mm <= 0:
            raise ValueError(f"heights must be positive, not {height_px} px and {height_mm} mm")
        return self.focal_px * height_mm / height_px / math.cos(math.radians(bearing_deg))

    def locate(self, detection: Detection, height_mm: float) -> tuple[float, float]:
        """Return (bearing_deg, distance_mm) of a detection, to the centre of the target.

        The corners are used where the detector knows them: they hold for a target seen at an angle, too.
        """
        u, height_px = _axis(detection)
        bearing_deg = self.bearing_deg(u)
        return bearing_deg, self.distance_mm(height_px, height_mm, bearing_deg)


def focal_from(height_px: float, height_mm: float = A4_HEIGHT_MM, distance_mm: float = 1000.0) -> float:
    """Compute the focal length in pixels from one measurement.

    Args:
        height_px: Apparent height of the sheet in a frame, in pixels.
        height_mm: Real height of the sheet.
        distance_mm: Measured from the camera to the sheet, which stands upright in the middle of the frame.

    Raises:
        ValueError: one of them is not positive.
    """
    if min(height_px, height_mm, distance_mm) <= 0:
        raise ValueError(f"all must be positive: {height_px} px, {height_mm} mm, {distance_mm} mm")
    return height_px * distance_mm / height_mm


def _axis(detection: Detection) -> tuple[float, float]:
    """Return the column of the target's centre and its height in pixels there."""
    if detection.quad is None:
        return detection.centre[0], detection.box[3]
    top_left, top_right, bottom_right, bottom_left = detection.quad
    left, right = math.dist(top_left, bottom_left), math.dist(top_right, bottom_right)
    # Depth is linear along the picture, so 1/height is: the middle's height is the harmonic mean of the sides'.
    return crossing(detection.quad)[0], 2 * left * right / (left + right)


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
