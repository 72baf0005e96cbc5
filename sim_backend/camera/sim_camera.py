"""The simulated webcam: a renderer behind a lens."""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np

from sim_backend.camera.lens import Lens, LensEffects
from sim_backend.camera.projection import Matrix, Pinhole, level_plane
from sim_backend.camera.renderer import Renderer
from sim_backend.camera.scene import Panel, Viewpoint
from sim_backend.camera.textures import Image, TextureLibrary


class SimCamera:
    """Frames of a webcam at a viewpoint.

    It has no clock: the simulation requests a frame when one is due. The same seed and sequence of calls give the same
    frames.

    Args:
        size: Width and height of the frames in pixels.
        hfov_deg: Horizontal field of view.
        seed: Seed of the textures and the sensor noise.
        lens: The webcam's imperfections; `lens.PERFECT` for none.
        floor: Texture of the floor.
        textures: Texture library to share between cameras; by default one made from `seed`.
    """

    def __init__(
        self,
        size: tuple[int, int] = (320, 240),
        hfov_deg: float = 60.0,
        seed: int = 0,
        lens: LensEffects | None = None,
        *,
        floor: str = "floor",
        textures: TextureLibrary | None = None,
    ) -> None:
        self.pinhole = Pinhole(*size, hfov_deg)
        self._textures, self._floor = textures or TextureLibrary(seed), floor
        self._level = Renderer(self.pinhole, self._textures, floor)
        self._turned: dict[tuple[float, float], tuple[Renderer, Matrix]] = {}
        self._lens = Lens(lens or LensEffects(), size, self.pinhole.focal_px, seed)

    def frame(self, panels: Iterable[Panel], viewpoint: Viewpoint, turn_rate_deg_s: float = 0.0) -> Image:
        """The next frame: (height, width, 3) uint8, blue, green, red.

        Args:
            panels: All surfaces of the world, in any order.
            viewpoint: Pose of the lens in the middle of the exposure.
            turn_rate_deg_s: Turn rate of the camera, clockwise; it blurs the frame.

        Raises:
            ConfigError: A panel names a texture that does not exist.
        """
        return self._lens.expose(self._render(panels, viewpoint), turn_rate_deg_s)

    def _render(self, panels: Iterable[Panel], viewpoint: Viewpoint) -> Image:
        """The view without the lens's effects; that of a tilted or rolled camera is warped from a level one's."""
        if viewpoint.level:
            return self._level.render(panels, viewpoint)
        turn = viewpoint.tilt_deg, viewpoint.roll_deg
        if turn not in self._turned:
            window, to_frame = level_plane(self.pinhole, *turn)
            self._turned[turn] = Renderer(window, self._textures, self._floor), to_frame
        renderer, to_frame = self._turned[turn]
        size = self.pinhole.width, self.pinhole.height
        return np.asarray(cv2.warpPerspective(renderer.render(panels, viewpoint), to_frame, size), np.uint8)
