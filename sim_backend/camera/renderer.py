"""A z-buffer renderer for upright panels, seen by a level pinhole camera.

For an upright rectangle the inverse depth is linear in the image column and constant along each column. One row vector
per panel therefore decides occlusion exactly, and one perspective warp paints the visible part. It needs only OpenCV
and numpy, and gives the same result on every computer. `docs/ranges.md` section 2 compares it with 3D engines.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_backend.camera.projection import ImagePlane, Matrix, Pinhole
from sim_backend.camera.scene import NEAR_MM, Panel, Viewpoint, in_level_frame
from sim_backend.camera.textures import Image, Texture, TextureLibrary

LIGHT_FROM_DEG = 245.0
"""Direction of the light (a window): panels that face it are the brightest."""
BACKGROUND = (214, 220, 222)
"""Blue, green, red of the area above all panels."""

Row = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True)
class Facet:
    """The part of a panel in front of the lens, in the camera's frame.

    Attributes:
        panel: The panel.
        to_image: Maps (s, t, 1) on the whole panel, both 0..1 from the upper left as seen from the front, to the image.
        columns: First covered image column, and one past the last.
        inverse_depth: 1/mm, one value per image column of the whole image; meaningful within `columns`.
        edges: Rows of the upper and lower edge, one per image column.
        widths: Share of the panel's width per pixel, one per image column.
        front: Whether the front is visible.
    """

    panel: Panel
    to_image: Matrix
    columns: tuple[int, int]
    inverse_depth: Row
    edges: tuple[Row, Row]
    widths: Row
    front: bool


@dataclass(frozen=True, slots=True)
class Surface:
    """A plane with a texture on it, as the camera sees it.

    Attributes:
        texture: Texture of the plane.
        to_image: Maps (s, t, 1) on the plane to the image.
        repeats: Repetitions of the texture along s and t within 0..1.
        shade: Brightness, 0..1.
    """

    texture: Texture
    to_image: Matrix
    repeats: tuple[float, float]
    shade: float

    def texel_to_image(self, level: int) -> Matrix:
        """Map from (column, row, 1) of the texture's mip `level` to the image."""
        height, width = self.texture.mips[level].shape[:2]
        scale_x, scale_y = width * self.repeats[0], height * self.repeats[1]
        shift_y = 0.5 / scale_y
        if self.repeats[0] > 1 and self.repeats[1] == 1:
            # a wrapped texture that does not repeat vertically: its lowest row must not bleed into its highest
            scale_y, shift_y = height - 1, 0.0
        from_texel = np.array([[1 / scale_x, 0, 0.5 / scale_x], [0, 1 / scale_y, shift_y], [0, 0, 1]])
        return np.asarray(self.to_image @ from_texel, np.float64)


class Renderer:
    """Renders panels on a textured floor, seen by a level pinhole camera.

    Args:
        camera: Image size and focal length. Tilt and roll are left to the caller; see `optics.CameraWarp`.
        textures: Source of the textures.
        floor: Texture of the floor.
    """

    def __init__(self, camera: Pinhole | ImagePlane, textures: TextureLibrary, floor: str = "floor") -> None:
        self.camera = camera
        self._textures = textures
        self._floor = textures[floor]
        self._empty = np.full((camera.height, camera.width, 3), BACKGROUND, np.uint8)
        self._column_rays = (np.arange(camera.width) - camera.centre_px[0]) / camera.focal_px
        self._rows = np.arange(camera.height, dtype=np.float32)[:, None]

    def render(self, panels: Iterable[Panel], viewpoint: Viewpoint) -> Image:
        """Return the image of `panels` from `viewpoint`: (height, width, 3) blue, green, red."""
        camera = self.camera
        image = self._empty.copy()
        nearest = np.zeros((camera.height, camera.width), np.float32)
        facets = [facet for panel in panels if (facet := self._facet(panel, viewpoint)) is not None]
        facets.sort(key=lambda facet: -float(facet.inverse_depth[slice(*facet.columns)].max()))
        for facet in facets:
            self._draw(facet, image, nearest)
        self._draw_floor(viewpoint, image, nearest)
        return image

    def _facet(self, panel: Panel, viewpoint: Viewpoint) -> Facet | None:
        """Return the panel in the camera's frame; None if the camera cannot see it."""
        camera = self.camera
        ends = [in_level_frame(x, y, viewpoint) for x, y in panel.foot_points_mm]
        (right0, depth0), (right1, depth1) = ends
        # twice the area of the triangle lens - foot 0 - foot 1; positive if the front is visible
        area = right1 * depth0 - right0 * depth1
        if abs(area) < 1e-6 * panel.width_mm or max(depth0, depth1) <= NEAR_MM:
            return None
        focal, (centre_u, centre_v) = camera.focal_px, camera.centre_px
        us = [centre_u + focal * right / depth for right, depth in _clipped(ends)]
        first, past = max(0, math.ceil(min(us))), min(camera.width, math.ceil(max(us)))
        if first >= past:
            return None
        along_right, along_depth = right1 - right0, depth1 - depth0
        inverse_depth = (along_right - self._column_rays * along_depth) / area
        upper = viewpoint.height_mm - panel.top_mm
        lower = viewpoint.height_mm - panel.bottom_mm
        to_image = np.array(
            [
                [focal * along_right + centre_u * along_depth, 0.0, focal * right0 + centre_u * depth0],
                [centre_v * along_depth, focal * (lower - upper), focal * upper + centre_v * depth0],
                [along_depth, 0.0, depth0],
            ]
        )
        edges = (centre_v + focal * upper * inverse_depth, centre_v + focal * lower * inverse_depth)
        with np.errstate(divide="ignore"):
            widths = 1.0 / (focal * abs(area) * inverse_depth**2)
        return Facet(panel, to_image, (first, past), inverse_depth, edges, widths, area > 0.0)

    def _draw(self, facet: Facet, image: Image, nearest: NDArray[np.float32]) -> None:
        """Paint the pixels of the facet that nothing nearer hides."""
        first, past = facet.columns
        upper, lower = (edge[first:past].astype(np.float32) for edge in facet.edges)
        top = max(0, math.ceil(float(upper.min())))
        bottom = min(self.camera.height, math.ceil(float(lower.max())))
        if top >= bottom:
            return
        rows = self._rows[top:bottom]
        inverse_depth = facet.inverse_depth[first:past].astype(np.float32)
        depths = nearest[top:bottom, first:past]
        visible = (depths < inverse_depth) & (rows >= upper) & (rows < lower)
        left, above, width, height = cv2.boundingRect(visible.view(np.uint8))
        if width == 0:
            return
        np.copyto(depths, inverse_depth, where=visible)
        surface = self._surface(facet)
        texels = self._texels_per_pixel(facet, surface)[first + left : first + left + width]
        for start, stop, level in _runs(surface.texture.levels(texels)):
            shown = visible[above : above + height, left + start : left + stop]
            _paint(image, shown, (first + left + start, top + above), surface, level)

    def _surface(self, facet: Facet) -> Surface:
        panel = facet.panel
        texture = self._textures[panel.texture_of(front=facet.front)]
        return Surface(texture, facet.to_image, (texture.repeats(panel.width_mm), 1), _shade(panel, facet.front))

    def _texels_per_pixel(self, facet: Facet, surface: Surface) -> Row:
        """Return texels per pixel for each image column: the geometric mean of both directions."""
        across = facet.widths * surface.texture.width * surface.repeats[0]
        upright_mm = facet.panel.top_mm - facet.panel.bottom_mm
        with np.errstate(divide="ignore"):  # a column beside the panel may look along it
            along = surface.texture.height / (upright_mm * self.camera.focal_px * facet.inverse_depth)
        return np.sqrt(np.abs(across * along))

    def _draw_floor(self, viewpoint: Viewpoint, image: Image, nearest: NDArray[np.float32]) -> None:
        """Paint the floor in pixels without a panel."""
        camera, texture = self.camera, self._floor
        focal, (centre_u, centre_v) = camera.focal_px, camera.centre_px
        horizon = max(0, math.floor(centre_v) + 1)
        if horizon >= camera.height:
            return
        visible = nearest[horizon:] == 0.0
        left, above, width, height = cv2.boundingRect(visible.view(np.uint8))
        if width == 0:
            return
        heading = math.radians(viewpoint.heading_deg)
        cos, sin = math.cos(heading), math.sin(heading)
        depth = np.array([cos, sin, -viewpoint.x_mm * cos - viewpoint.y_mm * sin])
        right = np.array([-sin, cos, viewpoint.x_mm * sin - viewpoint.y_mm * cos])
        drop = np.array([0.0, 0.0, viewpoint.height_mm])
        to_image = np.array([focal * right + centre_u * depth, focal * drop + centre_v * depth, depth])
        tile = texture.tile_mm or 1000.0
        depths = focal * viewpoint.height_mm / (np.arange(horizon, camera.height) - centre_v)
        # floor texels are foreshortened along the view; use the geometric mean of both directions
        texels = texture.width / tile * depths / focal * np.sqrt(depths / viewpoint.height_mm)
        surface = Surface(texture, to_image, (1.0 / tile, 1.0 / tile), 1.0)
        for start, stop, level in _runs(texture.levels(texels[above : above + height])):
            shown = visible[above + start : above + stop, left : left + width]
            _paint(image, shown, (left, horizon + above + start), surface, level)


def _paint(image: Image, shown: NDArray[np.bool_], origin: tuple[int, int], surface: Surface, level: int) -> None:
    """Warp a surface into the window of `image` that starts at `origin` (column, row), where `shown` is true."""
    height, width = shown.shape
    left, top = origin
    to_window = np.array([[1.0, 0.0, -left], [0.0, 1.0, -top], [0.0, 0.0, 1.0]])
    window = cv2.warpPerspective(
        surface.texture.mips[level],
        to_window @ surface.texel_to_image(level),
        (width, height),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE if surface.repeats == (1, 1) else cv2.BORDER_WRAP,
    )
    if surface.shade != 1.0:
        window = cv2.convertScaleAbs(window, alpha=surface.shade)
    cv2.copyTo(window, shown.view(np.uint8), image[top : top + height, left : left + width])


def _clipped(ends: Sequence[tuple[float, float]]) -> Sequence[tuple[float, float]]:
    """Return the ends of the foot line, clipped at the near plane; at least one end must be in front."""
    (right0, depth0), (right1, depth1) = ends
    if min(depth0, depth1) >= NEAR_MM:
        return ends
    share = (NEAR_MM - depth0) / (depth1 - depth0)
    cut = (right0 + share * (right1 - right0), NEAR_MM)
    return (cut, ends[1]) if depth0 < depth1 else (ends[0], cut)


def _shade(panel: Panel, front: bool) -> float:
    """Return the brightness of the visible side by direction, from 0.78 (away from the light) to 1.0 (facing it)."""
    along = math.degrees(math.atan2(panel.y1_mm - panel.y0_mm, panel.x1_mm - panel.x0_mm))
    facing = along + (90.0 if front else -90.0)
    return 0.89 + 0.11 * math.cos(math.radians(facing - LIGHT_FROM_DEG))


def _runs(levels: NDArray[np.intp]) -> Iterator[tuple[int, int, int]]:
    """Yield runs of equal levels: start, stop, level."""
    breaks = [0, *(np.flatnonzero(np.diff(levels)) + 1).tolist(), len(levels)]
    for start, stop in pairwise(breaks):
        yield start, stop, int(levels[start])
