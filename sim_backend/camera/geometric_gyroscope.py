"""What the visual gyroscope would measure, by geometry and chance without an image."""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random

from sim_backend.camera.geometric import Falloff
from sim_backend.camera.scene import Viewpoint
from sim_backend.plane import wrapped_deg


@dataclass(frozen=True, slots=True)
class GyroscopeModel:
    """How often the gyroscope measures a turn, and how accurately.

    Attributes:
        share: Probability of a measurement at rest and in good light.
        turned_deg: Falloff over the turn between the two frames.
        moved_mm: Falloff over the way of the lens between them.
        blur_deg: Falloff over the turn during the exposure.
        dark: Falloff over the binary logarithm of the frame's brightness.
        scale: How far a turn is measured for each degree: the lens is in front of the axle, so near things move more.
        sd_deg: Standard deviation of a turn, and
        sd_share: that is added for each degree of it.
    """

    share: float
    turned_deg: Falloff
    moved_mm: Falloff
    blur_deg: Falloff
    dark: Falloff
    scale: float
    sd_deg: float
    sd_share: float

    def measured_deg(
        self, then: Viewpoint, now: Viewpoint, blur_deg: float, brightness: float, random: Random
    ) -> float | None:
        """Return the measured turn, degrees, positive right, or None.

        Args:
            then: Pose of the lens in the first frame.
            now: In the second one.
            blur_deg: How far the camera turned while the second one was exposed.
            brightness: Of the second one; 1 is a well-lit room.
            random: For chance.
        """
        turned_deg = wrapped_deg(now.heading_deg - then.heading_deg)
        moved_mm = math.hypot(now.x_mm - then.x_mm, now.y_mm - then.y_mm)
        light = math.log2(max(1e-6, brightness))
        rate = self.share
        for falloff, value in (
            (self.turned_deg, abs(turned_deg)),
            (self.moved_mm, moved_mm),
            (self.blur_deg, abs(blur_deg)),
            (self.dark, min(0.0, light)),
        ):
            rate *= falloff.rate(value) / falloff.rate(0.0)
        if random.random() >= rate:
            return None
        return self.scale * turned_deg + random.gauss(0.0, self.sd_deg + self.sd_share * abs(turned_deg))


GYROSCOPE_MODEL = GyroscopeModel(
    share=0.92,
    turned_deg=Falloff(5.0, 1.7),
    moved_mm=Falloff(35.0, 16.0),
    blur_deg=Falloff(2.8, 0.7),
    dark=Falloff(-1.1, -0.6),
    scale=1.1,
    sd_deg=0.1,
    sd_share=0.04,
)
"""Source: tools/dev/gyroscope_accuracy.py, 240 pairs of frames for each motion."""
