"""The simulated webcam: a renderer behind a lens."""

from __future__ import annotations

from collections.abc import Iterable

from sim_backend.camera.lens import Lens, LensEffects
from sim_backend.camera.optics import PINHOLE_OPTICS, CameraWarp, Optics
from sim_backend.camera.projection import Pinhole
from sim_backend.camera.renderer import Renderer
from sim_backend.camera.scene import Panel, Viewpoint
from sim_backend.camera.textures import Image, TextureLibrary


class SimCamera:
    """Frames of a webcam at a viewpoint.

    It has no clock: the simulation requests each frame at its time. The same seed and sequence of calls give the same
    frames.

    Args:
        size: Width and height of the frames in pixels.
        hfov_deg: Horizontal field of view.
        seed: Seed of the textures and the sensor noise.
        lens: The webcam's imperfections; `lens.PERFECT` for none.
        optics: Its lens distortion and shutter.
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
        optics: Optics = PINHOLE_OPTICS,
        floor: str = "floor",
        textures: TextureLibrary | None = None,
    ) -> None:
        self.pinhole = Pinhole(*size, hfov_deg)
        self._textures, self._floor = textures or TextureLibrary(seed), floor
        self._level = Renderer(self.pinhole, self._textures, floor)
        self._optics = optics
        self._views: dict[tuple[float, float], tuple[Renderer, CameraWarp]] = {}
        self._lens = Lens(lens or LensEffects(), size, self.pinhole.focal_px, seed)

    def frame(
        self, panels: Iterable[Panel], viewpoint: Viewpoint, turn_rate_deg_s: float = 0.0, brightness: float = 1.0
    ) -> Image:
        """Return the next frame: (height, width, 3) uint8, blue, green, red.

        Args:
            panels: All surfaces of the world, in any order.
            viewpoint: Pose of the lens in the middle of the exposure.
            turn_rate_deg_s: Turn rate of the camera, clockwise; it blurs the frame, and a rolling shutter skews it.
            brightness: Factor on the brightness of this frame.

        Raises:
            ConfigError: A panel names a texture that does not exist.
        """
        return self._lens.expose(self._render(panels, viewpoint, turn_rate_deg_s), turn_rate_deg_s, brightness)

    def _render(self, panels: Iterable[Panel], viewpoint: Viewpoint, turn_rate_deg_s: float) -> Image:
        """Return the view without blur, noise and exposure; that of a real camera is warped from a level pinhole's."""
        if viewpoint.level and self._optics == PINHOLE_OPTICS:
            return self._level.render(panels, viewpoint)
        turn = viewpoint.tilt_deg, viewpoint.roll_deg
        if turn not in self._views:
            view = CameraWarp(self.pinhole, self._optics, *turn)
            self._views[turn] = Renderer(view.window, self._textures, self._floor), view
        renderer, view = self._views[turn]
        return view.apply(renderer.render(panels, viewpoint), turn_rate_deg_s)
