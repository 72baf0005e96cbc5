"""A camera that is mounted beside the middle, turned, tilted or rolled, and whose frames arrive late."""

import math

import numpy as np
import pytest

from sim_backend.camera.geometric import GeometricDetector
from sim_backend.camera.lens import PERFECT
from sim_backend.camera.scene import Viewpoint, picture_panel
from sim_backend.camera.sim_camera import SimCamera
from sim_backend.simulation import Simulation
from sim_backend.world.world_file import Camera
from tests.sim_backend.cameras import ALWAYS, before_a_picture, farthest_px

FOCAL_PX = 320 / math.tan(math.radians(30))
SIZE = (640, 480)


def quad(panel, viewpoint):
    return GeometricDetector(SIZE, model=ALWAYS).observe([panel], viewpoint, panel.texture)


def seen(simulation, name="lena"):
    found = (simulation.webcam.observe(name) for _ in range(20))
    return next((corners for corners in found if corners is not None), None)


def middle(corners):
    return np.mean(corners, axis=0)


@pytest.mark.parametrize("tilt_deg", [-10.0, 0.0, 12.0])
@pytest.mark.parametrize("roll_deg", [-30.0, 0.0, 7.0, 180.0])
@pytest.mark.parametrize("bearing_deg", [-10.0, 8.0])
def test_rendered_and_geometric_cameras_see_the_same_corners(red, tilt_deg, roll_deg, bearing_deg):
    bearing = math.radians(bearing_deg)
    panel = picture_panel(red, 1500 * math.cos(bearing), 1500 * math.sin(bearing), 200.0)
    viewpoint = Viewpoint(0.0, 0.0, 0.0, 200.0, tilt_deg, roll_deg)
    frame = SimCamera(SIZE, lens=PERFECT).frame([panel], viewpoint)
    assert farthest_px(frame, quad(panel, viewpoint)) < 2.0


def test_a_camera_tilted_up_sees_what_is_ahead_lower_down():
    panel = picture_panel("lena", 1500.0, 0.0, 180.0, bottom_mm=200 - 297 / 2)
    u, v = middle(quad(panel, Viewpoint(0.0, 0.0, 0.0, 200.0, 10.0)))
    assert u == pytest.approx(320)
    assert v == pytest.approx(240 + FOCAL_PX * math.tan(math.radians(10)), abs=3)


def test_a_camera_rolled_clockwise_sees_what_is_right_higher_up():
    panel = picture_panel("lena", 1500.0, 200.0, 180.0, bottom_mm=200 - 297 / 2)
    u, v = middle(quad(panel, Viewpoint(0.0, 0.0, 0.0, 200.0, 0.0, 90.0)))
    assert (u, v) == (pytest.approx(320, abs=1), pytest.approx(240 - FOCAL_PX * 200 / 1500, abs=1))


def test_a_camera_beside_the_middle_and_turned_sees_from_there():
    straight, beside, turned = (
        middle(seen(Simulation(before_a_picture(camera))))[0] for camera in ({}, {"right_mm": 100}, {"yaw_deg": 10})
    )
    focal_px = 160 / math.tan(math.radians(30))
    assert beside - straight == pytest.approx(-focal_px * 100 / 1440, abs=2)
    assert turned - straight == pytest.approx(-focal_px * math.tan(math.radians(10)), abs=2)


def test_a_picture_above_the_frame_is_not_in_view():
    simulation = Simulation(before_a_picture({"tilt_deg": -28}))
    assert not simulation.truth.in_view("lena")
    assert seen(simulation) is None
    assert Simulation(before_a_picture({"tilt_deg": -5})).truth.in_view("lena")


@pytest.mark.parametrize("latency_s", [0.0, 0.3])
@pytest.mark.parametrize("rendered", [False, True])
def test_a_frame_shows_what_was_in_front_of_the_camera_its_latency_ago(latency_s, rendered):
    simulation = Simulation(before_a_picture({"latency_s": latency_s}))

    def facing_away():
        return simulation.camera_frame().std() < 30 if rendered else seen(simulation) is None

    simulation.advance(1000)
    assert not facing_away()
    simulation.world.place_robot((1000, 1500), 180)
    simulation.advance(round(latency_s * 1000))
    assert not facing_away() or latency_s == 0
    simulation.advance(100)
    assert facing_away()


def test_a_late_camera_shows_the_start_until_its_first_frame_arrives():
    simulation = Simulation(before_a_picture({"latency_s": 0.5}))
    simulation.world.place_robot((1000, 1500), 5.0)
    start = middle(seen(simulation))[0]
    simulation.advance(20)
    simulation.world.place_robot((1000, 1500), 90.0)
    simulation.advance(380)
    assert middle(seen(simulation))[0] == pytest.approx(start, abs=1.5)
    simulation.advance(400)
    assert seen(simulation) is None


def test_a_camera_that_would_see_the_zenith_is_refused():
    with pytest.raises(ValueError, match=r"lower hfov_deg \(120\) or tilt_deg"):
        Camera(hfov_deg=120, tilt_deg=30)
    with pytest.raises(ValueError, match=r"lower hfov_deg \(90\) or tilt_deg"):
        Camera(hfov_deg=90, tilt_deg=30, distortion_k1=-0.09)  # a barrel sees farther
    SimCamera((320, 240), 90.0).frame([], Viewpoint(0.0, 0.0, 0.0, 200.0, 30.0, 45.0))
