"""The detectors on what the simulated webcam shows: the pictures of the built-in worlds, in a room."""

import math

import pytest

from nxtdrive.vision.detectors import make_detector
from nxtdrive.vision.geometry import Pinhole
from sim_backend.bundled import PICTURES
from sim_backend.camera.scene import Panel, Viewpoint, picture_panel
from sim_backend.camera.sim_camera import SimCamera

PINHOLE = Pinhole.from_hfov(320, 60)
NAMES = ("lena", "rilakkuma")
WALLS = [
    Panel(x0, y0, x1, y1, 0, 2500, "wallpaper")
    for x0, y0, x1, y1 in ((-800, -2500, 4500, -2500), (4500, -2500, 4500, 2500), (4500, 2500, -800, 2500))
]


@pytest.fixture(scope="module")
def targets():
    return {name: make_detector({"detector": "picture", "pictures": [f"{name}.png"]}, PICTURES) for name in NAMES}


def room(name, distance_mm, bearing_deg, slant_deg=0.0):
    """The frame of a camera at the origin that looks along +x at a picture."""
    angle = math.radians(bearing_deg)
    x, y = distance_mm * math.cos(angle), distance_mm * math.sin(angle)
    picture = picture_panel(name, x, y, 180 + slant_deg, bottom_mm=60)
    return SimCamera(seed=1).frame([*WALLS, picture], Viewpoint(0, 0, 0, 200))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("distance_mm", [400, 550, 800, 1200, 1700, 2300, 2500, 2750, 3000])
@pytest.mark.parametrize("bearing_deg", [-9, 6])
def test_a_picture_is_seen_where_it_hangs(targets, name, distance_mm, bearing_deg):
    found = targets[name].detector.detect(room(name, distance_mm, bearing_deg))
    assert len(found) == 1
    found_bearing_deg, found_distance_mm = PINHOLE.locate(found[0], targets[name].height_mm)
    assert found_bearing_deg == pytest.approx(bearing_deg, abs=0.6)
    assert found_distance_mm == pytest.approx(distance_mm, rel=0.1)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("slant_deg", [-40, 40])
def test_a_picture_is_seen_from_the_side(targets, name, slant_deg):
    found = targets[name].detector.detect(room(name, 1500, 3, slant_deg))
    bearing_deg, distance_mm = PINHOLE.locate(found[0], targets[name].height_mm)
    assert bearing_deg == pytest.approx(3, abs=0.8)
    assert distance_mm == pytest.approx(1500, rel=0.15)


@pytest.mark.parametrize("distance_mm", [400, 1000, 2000, 3000])
def test_one_picture_is_not_taken_for_another(targets, distance_mm):
    for name, other in (NAMES, NAMES[::-1]):
        assert targets[name].detector.detect(room(other, distance_mm, 5)) == []


def test_the_back_of_a_picture_is_not_the_picture(targets):
    for name in NAMES:
        assert targets[name].detector.detect(room(name, 800, 0, slant_deg=180)) == []
