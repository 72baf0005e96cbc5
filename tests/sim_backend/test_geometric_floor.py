"""The free floor by geometry: it ends where panels meet it, in the rows where the detector would see it."""

import math
import random
from statistics import pstdev

import numpy as np
import pytest

from sim_backend.camera.geometric import GeometricDetector
from sim_backend.camera.geometric_floor import FARTHEST_MM, FLOOR_MODEL, FloorModel, GeometricFloor
from sim_backend.camera.optics import Optics
from sim_backend.camera.projection import Pinhole
from sim_backend.camera.scene import Panel, Viewpoint, standing_panels
from tests.sim_backend.cameras import ORIGIN

CAMERA = Pinhole(320, 240, 60.0)
EXACT = GeometricFloor(model=FloorModel(row_sd_px=0.0, look_like_floor=frozenset(), specks=0.0))


def wall(ahead_mm, bottom_mm=0.0, texture="wall", half_mm=9000.0):
    return Panel(ahead_mm, -half_mm, ahead_mm, half_mm, bottom_mm, 2500.0, texture)


def test_the_ends_lie_on_the_wall():
    ends = EXACT.ends([wall(1500.0)], ORIGIN, CAMERA)
    assert len(ends) == 24
    assert [x for x, *_ in ends] == pytest.approx([1500.0] * 24)
    bearings_deg = [math.degrees(math.atan2(y, x)) for x, y, _ in ends]
    assert bearings_deg == sorted(bearings_deg)
    assert (bearings_deg[0], bearings_deg[-1]) == pytest.approx((-29.0, 29.0), abs=0.2)


def test_a_turned_camera_sees_the_same_places():
    viewpoint = Viewpoint(700.0, -300.0, 125.0, 200.0)
    turn = math.radians(125.0)
    feet = [
        (700.0 + 900.0 * math.cos(turn) - y * math.sin(turn), -300.0 + 900.0 * math.sin(turn) + y * math.cos(turn))
        for y in (-5000.0, 5000.0)
    ]
    for x, y, _ in EXACT.ends([Panel(*feet[0], *feet[1], 0.0, 2500.0, "wall")], viewpoint, CAMERA):
        assert (x - 700.0) * math.cos(turn) + (y + 300.0) * math.sin(turn) == pytest.approx(900.0)


def test_the_nearest_thing_ends_the_floor():
    box = standing_panels([(800.0, -100.0), (1000.0, -100.0), (1000.0, 100.0), (800.0, 100.0)], 150.0, "crate")
    ahead = {round(y): x for x, y, _ in EXACT.ends([wall(2000.0), *box], ORIGIN, CAMERA)}
    assert {round(x) for x in ahead.values()} == {800, 2000}
    assert all((abs(y) <= 100.0) == (x == pytest.approx(800.0)) for y, x in ahead.items())


def test_a_thing_on_legs_hides_only_the_floor_behind_it():
    ends = EXACT.ends([wall(1000.0, bottom_mm=100.0)], ORIGIN, CAMERA)
    assert [x for x, *_ in ends] == pytest.approx([2000.0] * 24)
    assert [x for x, *_ in EXACT.ends([wall(1000.0, bottom_mm=200.0)], ORIGIN, CAMERA)] == [FARTHEST_MM] * 24


@pytest.mark.parametrize("ahead_mm", range(30, 350, 5))
def test_a_barrel_shows_no_floor_that_ends_far_below_the_frame(ahead_mm):
    detector = GeometricDetector(optics=Optics(distortion_k1=-0.25))
    assert not len(detector.floor_ends([wall(ahead_mm)], ORIGIN))


def test_what_is_behind_the_camera_hides_nothing():
    assert [x for x, *_ in EXACT.ends([wall(-1000.0)], ORIGIN, CAMERA)] == [FARTHEST_MM] * 24
    assert [x for x, *_ in EXACT.ends([], ORIGIN, CAMERA)] == [FARTHEST_MM] * 24


TAKEN_FOR_FLOOR = GeometricFloor(model=FloorModel(row_sd_px=0.0, look_like_floor=frozenset({"crate"}), specks=0.0))


def crate(ahead_mm, top_mm, texture="crate"):
    return Panel(ahead_mm, -9000.0, ahead_mm, 9000.0, 0.0, top_mm, texture)


def depths(*panels):
    ends = TAKEN_FOR_FLOOR.ends(panels, ORIGIN, CAMERA)
    assert not ends[:, 2].any()
    return ends[:, 0].tolist()


def tops(*panels):
    """Where floor seems to end on something above the horizon, as depth and height."""
    return {(round(x, 1), z) for x, _, z in TAKEN_FOR_FLOOR.ends(panels, ORIGIN, CAMERA)}


def test_what_looks_like_the_floor_and_reaches_above_the_lens_is_floor_up_to_its_upper_edge():
    assert tops(crate(1000.0, 250.0), wall(2000.0)) == {(1000.0, 250.0)}
    assert tops(crate(1000.0, 200.0), wall(2000.0)) == {(1000.0, 200.0)}


def test_of_several_such_things_the_one_that_looks_highest_ends_the_floor():
    assert tops(crate(1000.0, 300.0), crate(1500.0, 320.0)) == {(1000.0, 300.0)}
    assert tops(crate(1000.0, 300.0), crate(1500.0, 800.0)) == {(1500.0, 800.0)}


@pytest.mark.parametrize("readout_s", [0.0, 0.03])
def test_what_goes_on_beyond_the_frame_ends_at_its_upper_edge(readout_s):
    detector = GeometricDetector(optics=Optics(readout_s=readout_s))
    within = detector.floor_ends([crate(1000.0, 400.0)], ORIGIN, turn_rate_deg_s=20.0)
    assert len(within) >= 22
    assert all(0.0 < v < 120.0 for _, v in within)
    beyond = detector.floor_ends([crate(1000.0, 2400.0)], ORIGIN, turn_rate_deg_s=20.0)
    assert len(beyond) >= 22
    assert {v for _, v in beyond} == {0.0}


def test_in_front_of_it_the_floor_ends_as_ever():
    assert depths(crate(1000.0, 400.0), wall(900.0)) == pytest.approx([900.0] * 24)


def test_over_a_low_thing_that_looks_like_the_floor_it_seems_to_continue():
    # its upper edge hides what is nearer than 2 m behind it
    assert depths(crate(1000.0, 100.0), wall(3000.0)) == pytest.approx([3000.0] * 24)
    assert depths(crate(1000.0, 100.0), wall(1500.0)) == pytest.approx([2000.0] * 24)
    assert depths(crate(1000.0, 100.0), crate(1500.0, 40.0, "wall")) == pytest.approx([FARTHEST_MM] * 24)
    assert depths(crate(1000.0, 100.0)) == pytest.approx([FARTHEST_MM] * 24)


def test_under_a_hanging_one_the_floor_ends_as_ever():
    hanging = Panel(1000.0, -9000.0, 1000.0, 9000.0, 100.0, 400.0, "crate")
    assert depths(hanging, wall(1500.0)) == pytest.approx([1500.0] * 24)
    assert tops(hanging, wall(2500.0)) == {(1000.0, 400.0)}


def test_beside_it_the_floor_ends_as_ever():
    narrow = Panel(1000.0, -100.0, 1000.0, 100.0, 0.0, 400.0, "crate")
    ends = TAKEN_FOR_FLOOR.ends([narrow, wall(2000.0)], ORIGIN, CAMERA)
    on_floor = ends[ends[:, 2] == 0.0]
    assert on_floor[:, 0] == pytest.approx(2000.0)
    assert {abs(y) < 200.0 for _, y, _ in on_floor} == {False}
    assert 10 <= len(on_floor) < 24


def test_errors_are_as_large_as_the_model_predicts():
    generator, floor = random.Random(4), GeometricFloor(FloorModel(0.8, frozenset(), 0.1))
    errors = [floor.error_px(generator) for _ in range(4000)]
    low = [error for error in errors if error > 4.0]
    assert len(low) / len(errors) == pytest.approx(0.1 * 56.0 / 60.0, abs=0.02)
    assert max(low) <= 60.0
    assert pstdev(error for error in errors if error < 0.0) == pytest.approx(0.8 * math.sqrt(1 - 2 / math.pi), rel=0.1)


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
def test_pixels_are_those_of_the_pinhole_and_as_exact_as_the_model_predicts(size):
    detector, scale = GeometricDetector(size), size[0] / 320
    row = size[1] / 2 + Pinhole(*size, 60.0).focal_px * 200.0 / 1000.0
    errors = []
    for _ in range(50):
        ends = detector.floor_ends([wall(1000.0)], ORIGIN)
        assert [u for u, _ in ends] == pytest.approx([(column + 0.5) / 24 * size[0] for column in range(24)])
        errors += [(v - row) / scale for _, v in ends]
    usual = [error for error in errors if abs(error) < 4 * FLOOR_MODEL.row_sd_px]
    assert len(usual) > 0.97 * len(errors)
    assert pstdev(usual) == pytest.approx(FLOOR_MODEL.row_sd_px, rel=0.1)


def test_the_same_seed_sees_the_same():
    def looks(seed):
        detector = GeometricDetector(seed=seed)
        return [detector.floor_ends([wall(1000.0)], ORIGIN).tolist() for _ in range(5)]

    assert looks(1) == looks(1)
    assert looks(1) != looks(2)


def test_what_ends_below_the_frame_is_left_out():
    detector = GeometricDetector()
    assert len(detector.floor_ends([wall(400.0)], ORIGIN)) == 0
    partly = detector.floor_ends([wall(2000.0), wall(400.0, half_mm=100.0)], ORIGIN)
    assert 10 <= len(partly) < 24
    for ahead_mm in (430.0, 460.0, 465.0, 500.0):
        assert all(0.0 <= v < 240.0 for _ in range(50) for _, v in detector.floor_ends([wall(ahead_mm)], ORIGIN))


@pytest.mark.parametrize(("x_mm", "heading_deg"), [(0.0, 0.0), (2000.0, 180.0)])
def test_a_panel_hides_the_floor_by_the_texture_of_the_side_that_is_seen(x_mm, heading_deg):
    picture = Panel(1000.0, -500.0, 1000.0, 500.0, 0.0, 300.0, "lena", back="cardboard")
    ends = GeometricFloor().ends([picture], Viewpoint(x_mm, 0.0, heading_deg, 200.0), CAMERA)
    on_it = (np.abs(ends[:, 0] - 1000.0) < 1.0) & (ends[:, 2] == 0.0)
    assert on_it.any() == picture.shows_front_to(x_mm, 0.0)
