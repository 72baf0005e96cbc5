"""The webcam on the simulated robot: frames at its rate, rendered only on demand."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from random import Random
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim_backend.camera.metering import Metering

if TYPE_CHECKING:
    from sim_backend.camera.geometric import GeometricDetector, Quad
    from sim_backend.camera.optics import Optics
    from sim_backend.camera.scene import Panel, Viewpoint
    from sim_backend.camera.sim_camera import SimCamera
    from sim_backend.camera.textures import Image
    from sim_backend.world.event_tables import CameraFault
    from sim_backend.world.world import World


@dataclass(frozen=True, slots=True)
class Exposure:
    """The data to render a frame later than it was taken.

    Attributes:
        index: Number of the frame.
        panels: Surfaces of the world.
        viewpoint: Pose of the lens.
        turn_rate_deg_s: Turn rate, clockwise.
        brightness: Factor on the brightness.
    """

    index: int
    panels: tuple[Panel, ...]
    viewpoint: Viewpoint
    turn_rate_deg_s: float
    brightness: float


class Webcam:
    """Frames of the robot's webcam.

    Args:
        world: The world.
        now_ms: Returns the simulation time.
        size: Width and height of the frames in pixels.
        seed: Seed of textures and sensor noise.

    Attributes:
        size: As given.
        fps: Frames per second; frame n is delivered at n / fps, and exposed the camera's latency before.
        hfov_deg: Horizontal field of view.
        detector_s: Computing time of the detectors per frame.
        next_frame_ms: When the next frame is to be exposed.
        unplugged_ms: Spans (from, to) of simulation time without frames; may be set at any time.
    """

    def __init__(
        self, world: World, now_ms: Callable[[], int], size: tuple[int, int] = (320, 240), seed: int = 0
    ) -> None:
        self.size, self._world, self._now_ms, self._seed = size, world, now_ms, seed
        self.fps, self.hfov_deg = float(world.file.camera.fps), world.file.camera.hfov_deg
        self.detector_s = world.file.computer.look_s
        self._metering = Metering(world.file.camera.auto_exposure_s)
        self._adapts = world.surroundings.light_changes or bool(world.file.camera.auto_exposure_s)
        self.unplugged_ms: tuple[tuple[int, int], ...] = ()
        self.next_frame_ms = 0.0
        self._latency_ms = world.file.camera.latency_s * 1000.0
        self._exposures: deque[Exposure] = deque()
        self._drawn: tuple[int, Image] | None = None
        self._seen: Exposure | None = None
        self._compared: Exposure | None = None

    @property
    def index(self) -> int:
        """Number of the latest frame."""
        return int(self._now_ms() * self.fps / 1000.0)

    def expose(self) -> None:
        """Take the next frame; it is rendered only when requested."""
        self._drop_old()
        index = int((self._now_ms() + self._latency_ms) * self.fps / 1000.0)
        self._expose(index)
        self.next_frame_ms = (index + 1) * 1000.0 / self.fps - self._latency_ms

    def frame(self) -> Image | None:
        """Return the latest frame, (height, width, 3) uint8, blue, green, red, read-only; None if unplugged or dropped.

        Raises:
            ConfigError: The world names a texture or image file that cannot be read.
        """
        if self._gives_none or self.dropped:
            return None
        exposure = self._fresh()
        if self._drawn is None or (self._drawn[0] != exposure.index and self._fault != "stuck"):
            self._drawn = (exposure.index, self._draw(exposure))
        return self._drawn[1]

    def observe(self, name: str, *, farthest_mm: float = math.inf) -> Quad | None:
        """Simulate the picture detector on the latest frame, by geometry and chance.

        Each call is an independent draw.

        Args:
            name: Name of the picture; an unknown one is never detected.
            farthest_mm: A picture that appears farther away is not detected.

        Returns:
            Corners of the picture in pixels; None without a detection or without a frame.
        """
        if self.unplugged or self.dropped:
            return None
        seen = self._look()
        if self._fault == "fogged":
            return None
        picture = self._world.pictures.get(name)
        if picture is None:
            return None
        brightness = seen.brightness if self._adapts else 1.0
        view = (seen.panels, seen.viewpoint, picture.texture, seen.turn_rate_deg_s)
        return self._detector.observe(*view, brightness=brightness, farthest_mm=farthest_mm)

    def floor_ends(self) -> NDArray[np.float64]:
        """Simulate the detector of the free floor on the frame that was observed last.

        Returns:
            The pixels, (n, 2) columns and rows, at which the floor ends.
        """
        if self._seen is None or self._fault == "fogged":
            return np.empty((0, 2))
        return self._detector.floor_ends(self._seen.panels, self._seen.viewpoint, self._seen.turn_rate_deg_s)

    def turned_deg(self) -> float | None:
        """Simulate the visual gyroscope: how far the camera turned since the frame of the last call, positive right.

        Returns:
            None for the first frame, and where the frames do not show it.
        """
        then, now = self._compared, self._look()
        self._compared = now
        if then is None or self._fault == "fogged":
            return None
        from sim_backend.camera.geometric_gyroscope import GYROSCOPE_MODEL

        blur_deg = self._world.file.camera.shutter_s * now.turn_rate_deg_s
        chance = Random(f"{self._seed}/turn {now.index}")
        return GYROSCOPE_MODEL.measured_deg(then.viewpoint, now.viewpoint, blur_deg, now.brightness, chance)

    @property
    def pictures(self) -> frozenset[str]:
        """Names that `observe` accepts."""
        return frozenset(self._world.pictures)

    @property
    def generator(self) -> Random:
        """The random generator of geometric vision."""
        return self._detector.generator

    @property
    def unplugged(self) -> bool:
        """Whether the webcam delivers no frames now, or only black ones."""
        return self._gives_none or self._fault == "covered"

    @property
    def _gives_none(self) -> bool:
        return self._fault == "unplugged" or any(start <= self._now_ms() < end for start, end in self.unplugged_ms)

    @property
    def _fault(self) -> CameraFault | None:
        return self._world.disturbances.camera

    @property
    def dropped(self) -> bool:
        """Whether the latest frame never arrives."""
        rate = self._world.file.camera.drop_rate
        return rate > 0 and Random(f"{self._seed}/frame {self.index}").random() < rate

    def _look(self) -> Exposure:
        """Return the exposure that geometric vision sees: the latest one, unless the camera repeats its frame."""
        if self._seen is None or self._fault != "stuck":
            self._seen = self._fresh()
        return self._seen

    def _fresh(self) -> Exposure:
        """Return the latest exposure delivered; taken now if nothing has moved since it was due."""
        self._drop_old()
        if not self._exposures or self._exposures[-1].index < self.index:
            self._exposures.clear()
            self._expose(self.index)
        return self._exposures[0]

    def _drop_old(self) -> None:
        """Drop the exposures before the latest one delivered."""
        while len(self._exposures) > 1 and self._exposures[1].index <= self.index:
            self._exposures.popleft()

    def _expose(self, index: int) -> None:
        world = self._world
        viewpoint, now_ms = world.viewpoint(), self._now_ms()
        brightness = world.file.light.exposure
        if self._adapts:
            light = world.surroundings.brightness((viewpoint.x_mm, viewpoint.y_mm), now_ms)
            brightness = self._metering.brightness(light, now_ms / 1000.0)
        turn_rate_deg_s = world.robot.turn_rate_deg_s
        self._exposures.append(Exposure(index, world.panels(), viewpoint, turn_rate_deg_s, brightness))

    def _draw(self, exposure: Exposure) -> Image:
        view = (exposure.panels, exposure.viewpoint, exposure.turn_rate_deg_s)
        image = self._camera.frame(*view, 0.0 if self._fault == "covered" else exposure.brightness)
        if self._fault == "fogged":
            from sim_backend.camera.lens import fogged

            image = fogged(image)
        image.flags.writeable = False
        return image

    @cached_property
    def _detector(self) -> GeometricDetector:
        from sim_backend.camera.geometric import GeometricDetector

        shutter_s = self._world.file.camera.shutter_s
        return GeometricDetector(self.size, self.hfov_deg, self._seed, shutter_s=shutter_s, optics=self._optics)

    @cached_property
    def _camera(self) -> SimCamera:
        from sim_backend.camera.lens import LensEffects
        from sim_backend.camera.sim_camera import SimCamera

        lens = LensEffects(shutter_s=self._world.file.camera.shutter_s)
        return SimCamera(self.size, self.hfov_deg, self._seed, lens, optics=self._optics)

    @property
    def _optics(self) -> Optics:
        from sim_backend.camera.optics import Optics

        camera = self._world.file.camera
        return Optics(camera.distortion_k1, camera.readout_s)
