"""Input of the camera for each frame: upright panels, and the pose of the lens.

The map is image-like: x to the right, y down, heading 0 along +x and 90 along +y (clockwise), lengths in millimetres.

Each surface is an upright rectangle on the line from foot point 0 to foot point 1. Its *front* is the side from which
point 0 is on the left and point 1 on the right; the texture reads correctly from there. Example: the panel from
(1000, -100) to (1000, 100) shows its front to a camera at the origin with heading 0.

The order of coincident panels is undefined; hang a picture some millimetres in front of its wall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sim_backend.plane import Length, along_and_across, sides_of

PICTURE_BACK = "cardboard"
NEAR_MM = 20.0
"""Near plane; nothing nearer is seen."""


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """Pose of the lens.

    Attributes:
        x_mm: Lens position on the map.
        y_mm: Lens position on the map.
        heading_deg: Direction of the optical axis in plan view, clockwise; 0 along +x, 90 along +y.
        height_mm: Lens above the floor.
        tilt_deg: Elevation of the optical axis, positive up.
        roll_deg: Rotation about the optical axis, positive clockwise as seen from behind the camera.
    """

    x_mm: float
    y_mm: float
    heading_deg: float
    height_mm: float
    tilt_deg: float = 0.0
    roll_deg: float = 0.0

    @property
    def level(self) -> bool:
        """Whether the camera is neither tilted nor rolled."""
        return self.tilt_deg == 0.0 == self.roll_deg


@dataclass(frozen=True, slots=True)
class Panel:
    """An upright rectangle with a texture: a wall, one side of a box, a picture on a stand.

    Attributes:
        x0_mm: Foot point 0, at the left as seen from the front.
        y0_mm: Foot point 0.
        x1_mm: Foot point 1, at the right as seen from the front.
        y1_mm: Foot point 1.
        bottom_mm: Lower edge above the floor.
        top_mm: Upper edge above the floor.
        texture: Name of the front's texture in the texture library (`textures.py`), for example "wall" or "lena".
        back: Name of the back's texture; None shows `texture` on both sides (mirrored from behind).
    """

    x0_mm: float
    y0_mm: float
    x1_mm: float
    y1_mm: float
    bottom_mm: float
    top_mm: float
    texture: str
    back: str | None = None

    @property
    def width_mm(self) -> float:
        """Length of the foot line."""
        return math.hypot(self.x1_mm - self.x0_mm, self.y1_mm - self.y0_mm)

    @property
    def foot_points_mm(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Foot points 0 and 1 on the map."""
        return (self.x0_mm, self.y0_mm), (self.x1_mm, self.y1_mm)

    @property
    def centre_mm(self) -> tuple[float, float]:
        """Middle of the foot line on the map."""
        return (self.x0_mm + self.x1_mm) / 2, (self.y0_mm + self.y1_mm) / 2

    def shows_front_to(self, x_mm: float, y_mm: float) -> bool:
        """Return whether the point (x_mm, y_mm) is on the front side."""
        along_x, along_y = self.x1_mm - self.x0_mm, self.y1_mm - self.y0_mm
        return along_x * (y_mm - self.y0_mm) - along_y * (x_mm - self.x0_mm) > 0.0

    def texture_of(self, *, front: bool) -> str:
        """Return the name of the texture of a side."""
        return self.texture if front or self.back is None else self.back


def in_level_frame(x_mm: Length, y_mm: Length, viewpoint: Viewpoint) -> tuple[Length, Length]:
    """Return the coordinates of points on the map to the right of the camera's heading and along it, mm."""
    along, across = along_and_across(x_mm - viewpoint.x_mm, y_mm - viewpoint.y_mm, viewpoint.heading_deg)
    return across, along


def in_camera_frame(
    x_mm: Length, y_mm: Length, height_mm: Length, viewpoint: Viewpoint
) -> tuple[Length, Length, Length]:
    """Return the coordinates of points to the right of the optical axis, below it and along it, mm."""
    right, depth = in_level_frame(x_mm, y_mm, viewpoint)
    down = viewpoint.height_mm - height_mm
    if viewpoint.level:
        return right, down, depth
    tilt, roll = math.radians(viewpoint.tilt_deg), math.radians(viewpoint.roll_deg)
    cos, sin = math.cos(tilt), math.sin(tilt)
    down, depth = down * cos + depth * sin, depth * cos - down * sin
    cos, sin = math.cos(roll), math.sin(roll)
    return right * cos + down * sin, down * cos - right * sin, depth


def picture_panel(
    name: str,
    x_mm: float,
    y_mm: float,
    facing_deg: float,
    *,
    width_mm: float = 210.0,
    height_mm: float = 297.0,
    bottom_mm: float = 100.0,
) -> Panel:
    """Return a picture, by default an A4 sheet, with a plain back.

    Args:
        name: Picture in the texture library.
        x_mm: Centre of the sheet on the map.
        y_mm: Centre of the sheet on the map.
        facing_deg: Direction of the front; a viewer in that direction sees the picture.
        width_mm: Width of the sheet.
        height_mm: Height of the sheet.
        bottom_mm: Lower edge above the floor.
    """
    facing = math.radians(facing_deg)
    half_x, half_y = math.sin(facing) * width_mm / 2, -math.cos(facing) * width_mm / 2
    return Panel(
        x_mm - half_x,
        y_mm - half_y,
        x_mm + half_x,
        y_mm + half_y,
        bottom_mm,
        bottom_mm + height_mm,
        name,
        PICTURE_BACK,
    )


def standing_panels(corners_mm: Sequence[tuple[float, float]], height_mm: float, texture: str) -> list[Panel]:
    """Return the sides of an upright prism (a box, a post, a person) on the floor.

    Args:
        corners_mm: Foot points in clockwise order on the map (y down), so that the fronts look outwards.
        height_mm: Height of the sides.
        texture: Texture of every side.
    """
    return [Panel(x1, y1, x0, y0, 0.0, height_mm, texture) for (x0, y0), (x1, y1) in sides_of(corners_mm)]
