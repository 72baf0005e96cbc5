"""A search for several pictures at once finds each one just as a search for it alone does."""

import cv2
import numpy as np
import pytest

from nxtdrive.vision.detectors.color import ColorDetector
from nxtdrive.vision.detectors.picture import PictureDetector
from nxtdrive.vision.detectors.shared_frame import detect_each
from sim_backend.bundled import PICTURES
from sim_backend.camera.scene import Panel, Viewpoint, picture_panel
from sim_backend.camera.sim_camera import SimCamera

WALLS = [
    Panel(x0, y0, x1, y1, 0, 2500, texture)
    for x0, y0, x1, y1, texture in (
        (-800, -2500, 4500, -2500, "bricks"),
        (4500, -2500, 4500, 2500, "wallpaper"),
        (4500, 2500, -800, 2500, "wood"),
    )
]
HANGING = ("fox", "landscape", "lena", "rilakkuma")
PLACES = [(1500, -14, 0), (2400, -4, 30), (2000, 6, -25), (3200, 16, 10)]
"""Distance in mm, bearing and slant in degrees."""


@pytest.fixture(scope="module")
def twelve(astronaut, distractors):
    """Detectors of the four pictures that hang in the rooms, and of eight that do not."""
    pictures = {name: cv2.imread(str(PICTURES / f"{name}.png")) for name in HANGING}
    photographs = ("coffee", "chelsea", "camera", "coins", "page", "moon", "rocket")
    pictures |= {"astronaut": astronaut} | {name: distractors[name][:, 60:230] for name in photographs}
    return {name: PictureDetector([np.ascontiguousarray(picture)]) for name, picture in pictures.items()}


def room(order):
    """The frame of a camera in a room where the four pictures hang in an order."""
    panels = list(WALLS)
    for name, (distance_mm, bearing_deg, slant_deg) in zip(order, PLACES, strict=True):
        x, y = distance_mm * np.cos(np.radians(bearing_deg)), distance_mm * np.sin(np.radians(bearing_deg))
        panels.append(picture_panel(name, x, y, 180 + bearing_deg + slant_deg, bottom_mm=60))
    return SimCamera(seed=1).frame(panels, Viewpoint(0, 0, 0, 200))


def agree(together, alone):
    """Whether two looks found the same, to a pixel."""
    return len(together) == len(alone) and all(
        np.abs(np.subtract(one.box, other.box)).max() <= 1 for one, other in zip(together, alone, strict=True)
    )


@pytest.mark.slow
@pytest.mark.parametrize("turned", range(4))
def test_twelve_pictures_are_found_as_each_alone(twelve, turned):
    frame = room(HANGING[turned:] + HANGING[:turned])
    assert len(twelve) == 12
    together = detect_each(twelve, frame)
    assert {name for name, found in together.items() if found} == set(HANGING)
    for name, detector in twelve.items():
        assert agree(together[name], detector.detect(frame)), name


def test_three_pictures_are_found_as_each_alone(twelve):
    frame = room(HANGING)
    three = {name: twelve[name] for name in ("fox", "lena", "astronaut")}
    together = detect_each(three, frame)
    assert [name for name, found in together.items() if found] == ["fox", "lena"]
    assert all(agree(together[name], detector.detect(frame)) for name, detector in three.items())


def test_several_photographs_of_a_target_are_found_beside_other_targets(twelve, scene, astronaut, distractors):
    frame = scene.render(1200, 5)
    detectors = {
        "both": PictureDetector([distractors["chelsea"], astronaut]),
        "lena": twelve["lena"],
        "red": ColorDetector("red"),
        "astronaut": twelve["astronaut"],
    }
    together = detect_each(detectors, frame)
    assert [name for name in ("both", "lena", "astronaut") if together[name]] == ["both", "astronaut"]
    assert together["both"] == together["astronaut"]
    assert together["red"] == detectors["red"].detect(frame)
