"""What the tests of the cameras share: a viewpoint, a world, a detector that never errs, and a measure of a frame."""

import cv2
import numpy as np

from sim_backend.camera.geometric import DetectorModel, Falloff
from sim_backend.camera.scene import Viewpoint
from sim_backend.world.world_file import WorldFile

ORIGIN = Viewpoint(0.0, 0.0, 0.0, 200.0)
ALWAYS = DetectorModel(Falloff(-99.0, -1.0), Falloff(999.0, 1.0), Falloff(99.0, 1.0), Falloff(99.0, 1.0), 0.0, 0.0)
"""Finds everything that is not fully hidden, without any error."""


def before_a_picture(camera=(), **tables):
    """A world with a robot 1.5 m before a picture."""
    return WorldFile.model_validate(
        {
            "floor": {"size_mm": (4000, 3000)},
            "robot": {"start_mm": (1000, 1500)},
            "camera": dict(camera),
            "pictures": [{"name": "lena", "at_mm": (2500, 1500), "facing_deg": 180}],
            **tables,
        }
    )


def farthest_px(frame, corners):
    """How far the farthest of some corners is from the outline of what is red."""
    mask = (frame[..., 2] > 120) & (frame[..., 1] < 60)
    (outline,), _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    # the renderer counts from the middle of the first pixel, the sensor from its edge
    return max(abs(cv2.pointPolygonTest(outline, tuple(np.subtract(corner, 0.5)), True)) for corner in corners)
