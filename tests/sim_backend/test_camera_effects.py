"""Lens distortion, rolling shutter, changing light, lost frames, and a slow computer."""

import math
from itertools import pairwise

import cv2
import numpy as np
import pytest

from behaviors.mission import Mission
from nxtdrive.brick import Brick
from nxtdrive.mission.camera import open_mission_camera
from nxtdrive.mission.vision import camera_vision, geometric_vision
from nxtdrive.transports.sim import SimTransport
from sim_backend.bundled import PICTURES
from sim_backend.camera.geometric import PICTURE_MODEL, GeometricDetector
from sim_backend.camera.lens import PERFECT
from sim_backend.camera.metering import Metering
from sim_backend.camera.optics import Optics
from sim_backend.camera.scene import Viewpoint, picture_panel
from sim_backend.camera.sim_camera import SimCamera
from sim_backend.simulation import Simulation
from sim_backend.world.world_file import Camera
from tests.sim_backend.cameras import ALWAYS, ORIGIN, before_a_picture, farthest_px

SIZE = (640, 480)
FOCAL_PX = 320 / math.tan(math.radians(30))


def quad(panel, optics, turn_rate_deg_s=0.0, viewpoint=ORIGIN):
    return GeometricDetector(SIZE, model=ALWAYS, optics=optics).observe(
        [panel], viewpoint, panel.texture, turn_rate_deg_s
    )


@pytest.mark.parametrize(
    ("optics", "turn_rate_deg_s"),
    [
        (Optics(distortion_k1=-0.2), 0.0),
        (Optics(distortion_k1=0.3), 0.0),
        (Optics(readout_s=0.05), 60.0),
        (Optics(readout_s=0.05), -60.0),
        (Optics(distortion_k1=-0.1, readout_s=0.03), 40.0),
    ],
)
@pytest.mark.parametrize("bearing_deg", [-18.0, 0.0, 15.0])
@pytest.mark.parametrize("tilt_deg", [0.0, 8.0])
def test_rendered_and_geometric_cameras_agree(red, optics, turn_rate_deg_s, bearing_deg, tilt_deg):
    bearing = math.radians(bearing_deg)
    panel = picture_panel(red, 1500 * math.cos(bearing), 1500 * math.sin(bearing), 180.0 + bearing_deg, bottom_mm=60.0)
    viewpoint = Viewpoint(0.0, 0.0, 0.0, 200.0, tilt_deg, 0.0)
    frame = SimCamera(SIZE, lens=PERFECT, optics=optics).frame([panel], viewpoint, turn_rate_deg_s)
    assert farthest_px(frame, quad(panel, optics, turn_rate_deg_s, viewpoint)) < 2.5


@pytest.mark.parametrize("k1", [-0.25, -0.1, 0.2])
def test_distortion_is_that_of_opencv(k1):
    panel = picture_panel("lena", 1200.0, 400.0, 180.0, bottom_mm=30.0)
    corners = [(panel.x0_mm, panel.y0_mm, 327.0), (panel.x1_mm, panel.y1_mm, 327.0)]
    points = np.array([[y, 200.0 - height, x] for x, y, height in corners])
    matrix = np.array([[FOCAL_PX, 0, 320], [0, FOCAL_PX, 240], [0, 0, 1]])
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array([k1, 0, 0, 0, 0]))
    assert np.allclose(quad(panel, Optics(distortion_k1=k1))[:2], expected[:, 0], atol=0.01)


def test_a_rolling_shutter_skews_what_the_turning_camera_sees():
    panel = picture_panel("lena", 1000.0, 0.0, 180.0, bottom_mm=60.0)
    (top_left, _, _, bottom_left) = quad(panel, Optics(readout_s=0.05), 60.0)
    # turning right, the lower rows are exposed later: what they show has moved to the left
    assert bottom_left[0] < top_left[0] - 5
    assert quad(panel, Optics(readout_s=0.05), 0.0) == quad(panel, Optics(), 0.0)


def test_a_barrel_that_hides_the_corners_is_refused():
    with pytest.raises(ValueError, match="the corners show nothing"):
        Camera(distortion_k1=-0.4)
    Camera(hfov_deg=40, distortion_k1=-0.4)


def test_a_camera_follows_the_light_with_its_time_constant():
    metering = Metering(1.0)
    assert metering.brightness(1.0, 0.0) == 1.0
    assert metering.brightness(2.0, 0.0) == 2.0
    assert metering.brightness(2.0, 1.0) == pytest.approx(1 + math.exp(-1), rel=0.01)
    assert metering.brightness(2.0, 20.0) == pytest.approx(1.0, rel=0.01)
    assert Metering(0.0).brightness(0.3, 5.0) == 0.3


def test_a_bright_place_blinds_the_camera_until_it_has_adapted():
    shade = {"at_mm": (1060, 1500), "radius_mm": 500, "exposure": 8}
    simulation = Simulation(before_a_picture({"auto_exposure_s": 1.0}, shades=[shade]))
    simulation.world.place_robot((3000, 1500), 0)
    simulation.advance(500)
    simulation.world.place_robot((1000, 1500), 0)
    simulation.advance(110)
    assert not any(simulation.webcam.observe("lena") for _ in range(10))
    assert simulation.camera_frame().mean() > 230
    simulation.advance(5000)
    assert any(simulation.webcam.observe("lena") for _ in range(10))
    assert simulation.camera_frame().mean() < 220


def test_light_that_drifts_comes_and_goes():
    simulation = Simulation(before_a_picture(light={"drift_percent": 90, "drift_s": 8}))
    levels = []
    for _ in range(8):
        simulation.advance(1000)
        levels.append(simulation.camera_frame().mean())
    assert max(levels) > 2 * min(levels)
    assert [b > a for a, b in pairwise(levels)].count(True) in range(2, 6)


def test_detections_become_rarer_in_the_dark_and_in_glare():
    darkest, brightest = 2.0**PICTURE_MODEL.dark.half, 2.0**PICTURE_MODEL.glare.half
    rates = [PICTURE_MODEL.visibility(each) for each in (0.1, darkest, 0.3, 1.0, brightest, 6.0)]
    assert rates[0] < 0.1 < rates[1] < 0.9 < rates[2] <= rates[3] == 1.0
    assert rates[5] < 0.1 < rates[4] < 0.9


def test_a_slow_shutter_smears_what_a_turn_shows():
    def sightings(shutter_s, motors):
        simulation = Simulation(before_a_picture({"shutter_s": shutter_s}), seed=3)
        with Brick(SimTransport(simulation)) as brick:
            for port, power in zip("BC", motors, strict=True):
                brick.motor(port).dc(power)
            seen = 0
            for _ in range(80):
                brick.sleep(0.1)
                seen += simulation.webcam.observe("lena") is not None
            return seen

    turning = (12, -12)
    assert sightings(0.1, (0, 0)) == sightings(0.01, (0, 0)) > 0
    assert sightings(0.3, turning) < 0.7 * sightings(0.01, turning)


def test_some_frames_are_lost_and_the_same_ones_for_a_seed():
    def lost(seed):
        simulation = Simulation(before_a_picture({"drop_rate": 0.3}), seed=seed)
        frames = []
        for _ in range(100):
            simulation.advance(100)
            frames.append(simulation.webcam.dropped)
            assert simulation.webcam.dropped is False or simulation.webcam.observe("lena") is None
        return frames

    assert lost(1) == lost(1) != lost(2)
    assert 15 < lost(1).count(True) < 45


MISSION = Mission.model_validate(
    {
        "mission": {"targets": ["lena"]},
        "target": {"lena": {"detector": "picture", "pictures": [str(PICTURES / "lena.png")]}},
    }
)


def looks(camera, tables, geometric, number):
    with Brick(SimTransport(Simulation(before_a_picture(camera, **tables), seed=1))) as brick:
        vision = (
            geometric_vision(brick, MISSION) if geometric else camera_vision(open_mission_camera("sim", brick), MISSION)
        )
        times = []
        for _ in range(number):
            vision.look("lena")
            times.append(brick.now())
        return times


@pytest.mark.parametrize("geometric", [False, True])
def test_a_lost_frame_costs_the_time_until_the_next(geometric):
    plain, losing = (looks({"drop_rate": rate}, {}, geometric, 6)[-1] for rate in (0.0, 0.5))
    assert losing > plain + 0.2


@pytest.mark.parametrize("geometric", [False, True])
def test_a_look_takes_the_computer_its_time(geometric):
    times = looks({}, {"computer": {"look_s": 0.35}}, geometric, 4)
    assert all(later - earlier >= 0.349 for earlier, later in pairwise([0.0, *times]))
