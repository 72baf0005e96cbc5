"""Geometric vision: its geometry, its random misses, and its agreement with the real detector."""

import math
from statistics import fmean, pstdev

import pytest

from nxtdrive.vision.detection import Detection, box_of
from nxtdrive.vision.detectors import make_detector
from nxtdrive.vision.geometry import Pinhole
from sim_backend.bundled import PICTURES
from sim_backend.camera.geometric import PICTURE_MODEL, GeometricDetector
from sim_backend.camera.scene import Panel, Viewpoint, picture_panel, standing_panels
from sim_backend.camera.sim_camera import SimCamera
from tests.sim_backend.cameras import ALWAYS, ORIGIN


def lena(x=1200.0, y=0.0, facing_deg=180.0, **where):
    return picture_panel("lena", x, y, facing_deg, **({"bottom_mm": 60.0} | where))


def located(quad, size=(320, 240)):
    """Bearing and distance of a picture as the driver computes them."""
    return Pinhole.from_hfov(size[0], 60.0).locate(Detection(box_of(quad), 1.0, quad), 297.0)


def rate(panels, turn_rate_deg_s=0.0, viewpoint=ORIGIN, looks=200):
    detector = GeometricDetector(seed=5)
    return fmean(detector.observe(panels, viewpoint, "lena", turn_rate_deg_s) is not None for _ in range(looks))


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
@pytest.mark.parametrize(("distance_mm", "bearing_deg"), [(500, 5), (1000, -20), (3000, 25)])
def test_bearing_distance_and_corners_are_those_of_the_pinhole(size, distance_mm, bearing_deg):
    viewpoint = Viewpoint(-400.0, 900.0, 77.0, 200.0)
    direction = math.radians(77.0 + bearing_deg)
    panel = lena(-400.0 + distance_mm * math.cos(direction), 900.0 + distance_mm * math.sin(direction), 257.0)
    quad = GeometricDetector(size, model=ALWAYS).observe([panel], viewpoint, "lena")
    bearing, distance = located(quad, size)
    (left, top), (right, bottom) = quad[0], quad[2]
    width, height = right - left, bottom - top
    assert bearing == pytest.approx(bearing_deg)
    assert distance == pytest.approx(distance_mm)
    focal = size[0] / 2 / math.tan(math.radians(30))
    scale = focal / (distance_mm * math.cos(math.radians(bearing_deg)))
    assert (width, height) == pytest.approx((210 * scale, 297 * scale), abs=1)
    assert left + width / 2 == pytest.approx(size[0] / 2 + focal * math.tan(math.radians(bearing_deg)), abs=1)
    assert top == pytest.approx(size[1] / 2 - (60 + 297 - 200) * scale, abs=1)


def test_errors_are_as_large_as_the_model_predicts():
    detector = GeometricDetector(seed=2)
    seen = [detector.observe([lena()], ORIGIN, "lena") for _ in range(400)]
    bearings, distances = zip(*[located(one) for one in seen if one], strict=True)
    assert pstdev(bearings) == pytest.approx(PICTURE_MODEL.bearing_sd_deg, rel=0.15)
    assert pstdev(distances) / 1200.0 == pytest.approx(PICTURE_MODEL.distance_sd, rel=0.15)
    assert fmean(distances) == pytest.approx(1200.0, rel=0.01)


def test_the_same_seed_sees_the_same():
    def looks(seed):
        detector = GeometricDetector(seed=seed)
        return [detector.observe([lena(5200.0)], ORIGIN, "lena") for _ in range(40)]

    assert looks(1) == looks(1)
    assert looks(1) != looks(2)


def test_a_picture_is_not_seen_from_behind_from_outside_the_view_or_under_another_name():
    detector = GeometricDetector(model=ALWAYS)
    assert detector.observe([lena(facing_deg=0.0)], ORIGIN, "lena") is None
    assert detector.observe([lena(-1200.0, facing_deg=0.0)], ORIGIN, "lena") is None
    assert detector.observe([lena(y=1200.0)], ORIGIN, "lena") is None
    assert detector.observe([lena()], ORIGIN, "rilakkuma") is None
    assert detector.observe([], ORIGIN, "lena") is None


@pytest.mark.parametrize(("top_mm", "seen"), [(50.0, True), (120.0, True), (330.0, False), (600.0, False)])
def test_a_box_hides_what_is_lower_than_its_top_on_the_line_of_sight(top_mm, seen):
    box = standing_panels([(600.0, -300.0), (800.0, -300.0), (800.0, 300.0), (600.0, 300.0)], top_mm, "carton")
    assert rate([lena(), *box]) == (pytest.approx(1.0, abs=0.1) if seen else pytest.approx(0.0, abs=0.02))


def test_what_stands_beside_or_behind_hides_nothing():
    beside = Panel(600.0, 200.0, 600.0, 900.0, 0.0, 900.0, "carton")
    behind = Panel(1300.0, -900.0, 1300.0, 900.0, 0.0, 900.0, "wall")
    at_my_back = Panel(-100.0, -900.0, -100.0, 900.0, 0.0, 900.0, "wall")
    (view,) = GeometricDetector().views([beside, behind, lena(), at_my_back], ORIGIN, "lena")
    assert view.hidden == 0.0


def test_half_of_it_hidden_is_measured_as_a_half():
    cover = Panel(1100.0, -300.0, 1100.0, 0.0, 0.0, 900.0, "wall")
    (view,) = GeometricDetector().views([lena(), cover], ORIGIN, "lena")
    assert view.hidden == pytest.approx(0.5)
    # the same by the edge of the frame
    cut = lena(1200.0, 1200.0 * math.tan(math.radians(30)))
    (view,) = GeometricDetector().views([cut], ORIGIN, "lena")
    assert view.hidden == pytest.approx(0.5)


def test_a_hidden_picture_does_not_hide_another_of_the_same_name():
    wall = Panel(500.0, -300.0, 500.0, 100.0, 0.0, 900.0, "wall")
    detector = GeometricDetector(model=ALWAYS)
    seen = detector.observe([lena(900.0, -150.0), lena(2000.0, 700.0), wall], ORIGIN, "lena")
    assert seen is not None
    assert located(seen)[1] == pytest.approx(math.hypot(2000.0, 700.0))


@pytest.mark.parametrize(
    "worse",
    [
        [rate([lena(distance)]) for distance in (1000.0, 5200.0, 9000.0)],
        [rate([lena(facing_deg=180.0 + slant)]) for slant in (0.0, 61.0, 75.0)],
        [rate([lena()], turn_rate) for turn_rate in (0.0, 175.0, 400.0)],
    ],
    ids=["farther", "more slanted", "turning faster"],
)
def test_hits_become_rarer(worse):
    assert worse[0] > 0.97
    assert worse[0] > worse[1] > worse[2]
    assert worse[2] < 0.03


def board(distance_mm, top_mm):
    """A board across the way, half as far as the picture."""
    return Panel(distance_mm / 2, -200.0, distance_mm / 2, 200.0, 0.0, top_mm, "carton")


SITUATIONS = {
    "in front": (lambda far: [lena(far)], 0.0),
    "far": (lambda far: [lena(2.2 * far)], 0.0),
    "too far": (lambda far: [lena(6.0 * far)], 0.0),
    "slanted": (lambda far: [lena(far, facing_deg=140.0)], 0.0),
    "slanted the other way": (lambda far: [lena(far, facing_deg=220.0)], 0.0),
    "too slanted": (lambda far: [lena(far, facing_deg=105.0)], 0.0),
    "turning slowly": (lambda far: [lena(far)], 45.0),
    "turning fast": (lambda far: [lena(far)], 500.0),
    "behind": (lambda far: [lena(far, facing_deg=0.0)], 0.0),
    "behind a low board": (lambda far: [lena(far), board(far, 100.0)], 0.0),
    "behind a high board": (lambda far: [lena(far), board(far, 300.0)], 0.0),
    "cut by the edge of the frame": (lambda far: [lena(far, far * math.tan(math.radians(30.0)) + 40.0)], 0.0),
}
"""Arrangements that grow with a distance, and the turn rate."""

PLACES_MM = (1000.0, 1150.0, 1300.0, 1450.0, 1600.0, 1750.0)
MODEL_MARGIN = 0.25
"""The model holds for the average over places; at single places the detector sees better or worse."""


@pytest.mark.slow
@pytest.mark.parametrize("situation", SITUATIONS)
def test_the_law_agrees_with_the_real_detector_on_rendered_frames(situation):
    arrange, turn_rate_deg_s = SITUATIONS[situation]
    wall = Panel(12000.0, -9000.0, 12000.0, 9000.0, 0.0, 3000.0, "wall")
    detector = make_detector({"detector": "picture", "pictures": [str(PICTURES / "lena.png")]}).detector
    camera = SimCamera(seed=4)
    rooms = [[*arrange(place), wall] for place in PLACES_MM]
    real = fmean(bool(detector.detect(camera.frame(room, ORIGIN, turn_rate_deg_s))) for room in rooms)
    modelled = fmean(rate(room, turn_rate_deg_s, looks=50) for room in rooms)
    assert modelled == pytest.approx(real, abs=MODEL_MARGIN)
