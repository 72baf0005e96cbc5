"""The vision of a mission: a camera with detectors, and geometric vision."""

import math

import numpy as np
import pytest

from behaviors.ports import CameraLost, Sighting, Vision
from firmware_protocol.errors import CameraError, ConfigError
from nxtdrive.vision.camera import ReplayCamera, SimulatedCamera
from nxtdrive.vision.detection import TargetDetector
from nxtdrive.vision.detectors.picture import PictureDetector
from nxtdrive.vision.geometry import Mounting, Pinhole
from nxtdrive.vision.target_vision import CameraVision, GeometricVision
from sim_backend.camera.geometric import GeometricDetector
from sim_backend.camera.scene import Panel, Viewpoint, standing_panels
from sim_backend.camera.sim_camera import SimCamera

PINHOLE = Pinhole.from_hfov(320, 60)


@pytest.fixture(scope="module")
def targets(astronaut, distractors):
    cat = np.ascontiguousarray(distractors["chelsea"][:, 70:240])
    return {
        "astronaut": TargetDetector(PictureDetector([astronaut]), 297),
        "cat": TargetDetector(PictureDetector([cat]), 297),
    }


@pytest.fixture
def look_at(targets, clock):
    """Vision that sees the given frames, ten a second."""

    def make(frames, **options):
        return CameraVision(ReplayCamera("test", iter(frames), 10, clock), targets, PINHOLE, **options)

    return make


def test_a_target_is_sighted_where_it_is(look_at, scene):
    vision: Vision = look_at([scene.render(1500, 7), scene.render(1500, 7)])
    assert vision.look("astronaut") is None
    sighting = vision.look("astronaut")
    assert sighting.target == "astronaut"
    assert sighting.bearing_deg == pytest.approx(7, abs=0.5)
    assert sighting.distance_mm == pytest.approx(1500 / np.cos(np.radians(7)), rel=0.05)
    assert 0.8 < sighting.confidence <= 1
    assert sighting.time_s == pytest.approx(0.1)
    left, top, width, height = sighting.box
    corners = scene.corners(1500, 7)
    np.testing.assert_allclose((left, top, left + width, top + height), (*corners[0], *corners[2]), atol=3)


def test_an_approach_is_sighted_without_gaps(look_at, scene):
    distances = np.linspace(3000, 350, 25)
    vision = look_at([scene.render(distance, 6 * np.sin(i / 3)) for i, distance in enumerate(distances)])
    sightings = [vision.look("astronaut") for _ in distances]
    assert [sighting is not None for sighting in sightings] == [False] + [True] * 24
    for i in range(1, 25):
        bearing_deg = 6 * np.sin(i / 3)
        assert sightings[i].bearing_deg == pytest.approx(bearing_deg, abs=0.7)
        assert sightings[i].distance_mm * np.cos(np.radians(bearing_deg)) == pytest.approx(distances[i], rel=0.1)


@pytest.mark.slow
def test_a_target_that_was_taken_away_is_not_sighted_any_more(look_at, scene):
    vision = look_at([scene.render(1000)] * 3 + [scene.background] * 10)
    sightings = [vision.look("astronaut") for _ in range(13)]
    assert [sighting is not None for sighting in sightings] == [False, True, True] + [False] * 10


def test_a_target_that_jumps_is_found_in_its_new_place(look_at, scene):
    vision = look_at([scene.render(1000, -20)] * 3 + [scene.render(1000, 20)] * 2)
    sightings = [vision.look("astronaut") for _ in range(5)]
    assert sightings[3] is None
    assert sightings[4].bearing_deg == pytest.approx(20, abs=0.5)


def test_targets_are_kept_apart(look_at, scene):
    vision = look_at([scene.render(1000)] * 4)
    looks = [vision.look(name) is not None for name in ("astronaut", "cat", "astronaut", "cat")]
    assert looks == [False, False, True, False]


def test_observers_see_every_look(look_at, scene):
    vision = look_at([scene.render(1000), scene.background])
    looks = []
    vision.on_look(lambda *look: looks.append(look))
    vision.look("astronaut")
    vision.look("astronaut")
    (first, name, sighting, detections), (second, _, _, nothing) = looks
    assert (first.index, second.index) == (0, 1)
    assert (name, sighting) == ("astronaut", None)
    assert len(detections) == 1
    assert nothing == []


def test_a_sighting_has_the_time_of_exposure(look_at, scene):
    vision = look_at([scene.render(1000)] * 3, latency_s=0.25)
    glimpses = [vision.glance(["astronaut"]) for _ in range(3)]
    assert [each.time_s for each in glimpses] == pytest.approx([-0.25, -0.15, -0.05])
    assert glimpses[-1].seen["astronaut"].time_s == glimpses[-1].time_s


def test_an_unknown_target_is_refused(look_at, scene):
    with pytest.raises(ConfigError, match=r"no target 'dog'. There are: astronaut, cat"):
        look_at([scene.background]).look("dog")


def test_a_camera_without_frames_is_reported(targets, clock):
    class Unplugged:
        fps = 10.0
        size = (320, 240)
        detector_s = 0.0

        def frame(self):
            return None

    vision = CameraVision(SimulatedCamera(Unplugged(), clock), targets, PINHOLE)
    with pytest.raises(CameraError, match=r"no frame for 0.5 s"):
        vision.glance(["cat"])
    assert clock.now() == pytest.approx(0.5)


def test_a_covered_camera_counts_as_one_without_frames(look_at, scene):
    noise = np.random.default_rng(1).integers(0, 12, (240, 320, 3), np.uint8)
    vision = look_at([noise, scene.render(1000), scene.render(1000)])
    with pytest.raises(CameraLost, match=r"frames are black. Open its shutter"):
        vision.glance(["astronaut"])
    assert [vision.look("astronaut") is not None for _ in range(2)] == [False, True]


def test_a_dim_room_is_seen(look_at, scene):
    vision = look_at([scene.render(1000) // 3] * 2)
    assert [vision.look("astronaut") is not None for _ in range(2)] == [False, True]


class Sensor:
    """Sees a target for a span of time."""

    fps = 10.0
    size = (320, 240)
    detector_s = 0.0
    unplugged = dropped = False

    def __init__(self, clock, seen_from_s, seen_until_s):
        self.clock = clock
        self.span_s = seen_from_s, seen_until_s

    def observe(self, name):
        if not self.span_s[0] <= self.clock.now() <= self.span_s[1]:
            return None
        return ((200.0, 100.0), (240.0, 100.0), (240.0, 160.0), (200.0, 160.0))


def test_geometric_vision_confirms_as_camera_vision_does(clock):
    vision: Vision = GeometricVision(Sensor(clock, 0.25, 0.55), clock, {"cat": 200.0}, PINHOLE)
    sightings = [vision.look("cat") for _ in range(7)]
    assert [sighting is not None for sighting in sightings] == [False] * 4 + [True] * 2 + [False]
    assert clock.now() == pytest.approx(0.6)
    focal_px = 160 / math.tan(math.radians(30))
    bearing_deg = math.degrees(math.atan2(60, focal_px))
    distance_mm = math.hypot(60, focal_px) * 200 / 60
    assert sightings[4] == Sighting(
        "cat",
        pytest.approx(bearing_deg),
        pytest.approx(distance_mm),
        1.0,
        pytest.approx(0.4),
        (200, 100, 40, 60),
        edges_mm=pytest.approx((-400 / 3, 200 / 3)),
        lower_deg=pytest.approx(math.degrees(math.atan2(40, math.hypot(60, focal_px)))),
    )


def test_geometric_vision_measures_with_the_camera_that_the_mission_describes(clock):
    def distance_mm(hfov_deg, height_mm):
        vision = GeometricVision(Sensor(clock, 0.0, 99.0), clock, {"cat": height_mm}, Pinhole.from_hfov(320, hfov_deg))
        vision.look("cat")
        return vision.look("cat").distance_mm

    assert distance_mm(60.0, 100.0) == pytest.approx(distance_mm(60.0, 200.0) / 2)
    assert distance_mm(51.0, 200.0) > 1.15 * distance_mm(60.0, 200.0)


def test_geometric_vision_finds_only_the_targets_of_the_mission(clock):
    with pytest.raises(ConfigError, match=r"no target 'dog'.*There are: cat"):
        GeometricVision(Sensor(clock, 0.0, 9.0), clock, {"cat": 200.0}, PINHOLE).look("dog")


def test_an_unplugged_camera_is_blindness_and_not_an_empty_room(clock):
    sensor = Sensor(clock, 0.0, 10.0)
    sensor.unplugged = True
    with pytest.raises(CameraLost):
        GeometricVision(sensor, clock, {"lena": 297.0}, PINHOLE).glance(["lena"])


class Place:
    """A sensor of the floor at a place: a wall, and a box in front of it."""

    fps, detector_s = 10.0, 0.0
    unplugged = dropped = False

    def __init__(self, size, tilt_deg):
        corners = [(900.0, 60.0), (1200.0, 60.0), (1200.0, 360.0), (900.0, 360.0)]
        self.panels = [Panel(2000.0, -9000.0, 2000.0, 9000.0, 0.0, 2500.0, "wall")]
        self.panels += standing_panels(corners, 300.0, "blue_box")
        self.viewpoint = Viewpoint(0.0, 0.0, 0.0, 200.0, tilt_deg)
        self.size, self.sensor = size, GeometricDetector(size, seed=2)

    def observe(self, name):
        return None

    def floor_ends(self):
        return self.sensor.floor_ends(self.panels, self.viewpoint)

    def turned_deg(self):
        return None


@pytest.mark.parametrize(("size", "tilt_deg"), [((320, 240), 0.0), ((640, 480), 0.0), ((320, 240), -8.0)])
def test_camera_and_geometric_vision_agree_on_the_free_floor(clock, size, tilt_deg):
    place, pinhole = Place(size, tilt_deg), Pinhole.from_hfov(size[0], 60.0, Mounting(tilt_deg=tilt_deg))
    frame = SimCamera(size, seed=1).frame(place.panels, place.viewpoint)
    camera = CameraVision(ReplayCamera("test", iter([frame]), 10, clock), {}, pinhole)
    geometric = GeometricVision(place, clock, {}, pinhole)
    both = []
    for vision in (camera, geometric):
        seen = vision.glance([])
        assert vision.free_floor(None) == ()
        both.append(vision.free_floor(seen.time_s))
        assert len(vision.free_floor(None)) == len(both[-1])
    assert abs(len(both[0]) - len(both[1])) <= 1

    def distance_mm(ray):
        return 200.0 / math.tan(math.radians(ray.end_deg))

    pairs = [(one, min(both[1], key=lambda other: abs(other.bearing_deg - one.bearing_deg))) for one in both[0]]
    near = [(one, other) for one, other in pairs if abs(one.end_deg - other.end_deg) < 0.5]
    assert len(near) >= len(pairs) - 2, "but for the edges of the box"
    assert {round(distance_mm(one) * math.cos(math.radians(one.bearing_deg)), -3) for one, _ in near} == {1000, 2000}
    for one, other in near:
        assert one.bearing_deg == pytest.approx(other.bearing_deg, abs=1.0)
        assert one.near_deg == pytest.approx(other.near_deg, abs=0.2)
        assert distance_mm(one) == pytest.approx(distance_mm(other), rel=0.08)


def test_vision_without_a_look_has_no_floor(look_at, scene):
    vision = look_at([scene.background])
    assert vision.free_floor(0.0) == ()
