"""The simulated webcam: a renderer behind a lens."""

from __future__ import annotations

from collections.abc import Iterable

from sim_backend.camera.lens import Lens, LensEffects
from sim_backend.camera.renderer import Pinhole, Renderer
from sim_backend.camera.scene import Panel, Viewpoint
from sim_backend.camera.textures import Image, TextureLibrary


class SimCamera:
    """What a webcam at a viewpoint would deliver.

    It knows no time: the simulation asks for a frame when one is due, every 1 / `fps` seconds. The same seed and the
    same sequence of calls give the same frames.

    Args:
        size: Width and height of the frames in pixels.
        hfov_deg: Horizontal field of view.
        seed: Seeds the textures and the sensor noise.
        lens: The webcam's imperfections; `lens.PERFECT` for none.
        floor: Texture of the floor.
        textures: A texture library to share between cameras; None makes one from `seed`.
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
        self._renderer = Renderer(self.pinhole, textures or TextureLibrary(seed), floor)
        self._lens = Lens(lens or LensEffects(), size, self.pinhole.focal_px, seed)

    def frame(self, panels: Iterable[Panel], viewpoint: Viewpoint, turn_rate_deg_s: float = 0.0) -> Image:
        """The next frame: (height, width, 3) uint8, blue, green, red.

        Args:
            panels: Everything that stands in the world, in any order.
            viewpoint: Where the lens is in the middle of the exposure.
            turn_rate_deg_s: How fast the camera turns, clockwise; it smears the picture.

        Raises:
            ConfigError: A panel names a texture that does not exist.
        """
        return self._lens.expose(self._renderer.render(panels, viewpoint), turn_rate_deg_s)
