"""The picture detector."""

import math

import cv2
import numpy as np
import pytest
from skimage import data

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detectors.color import ColorDetector
from nxtdrive.vision.detectors.correlation import CorrelationMatcher
from nxtdrive.vision.detectors.frame_pyramid import pyramid
from nxtdrive.vision.detectors.picture import MAX_RATIO, PictureDetector
from nxtdrive.vision.detectors.shared_frame import detect_each
from nxtdrive.vision.focus import detect_near
from nxtdrive.vision.geometry import Pinhole
from sim_backend.bundled import PICTURES

PINHOLE = Pinhole.from_hfov(320, 60)


@pytest.fixture(scope="module")
def detector(astronaut):
    return PictureDetector([astronaut])


def locate(detector, frame):
    """Bearing and depth of the best detection."""
    found = detector.detect(frame)
    assert found
    bearing_deg, distance_mm = PINHOLE.resized(frame.shape[1]).locate(found[0], 297)
    return bearing_deg, distance_mm * math.cos(math.radians(bearing_deg))


@pytest.mark.parametrize("distance_mm", [300, 400, 600, 900, 1300, 1800, 2500, 3200, 4000])
def test_it_finds_the_picture_from_near_to_far(detector, scene, distance_mm):
    bearing_deg, depth_mm = locate(detector, scene.render(distance_mm, 5))
    assert bearing_deg == pytest.approx(5, abs=0.5)
    assert depth_mm == pytest.approx(distance_mm, rel=0.08)


@pytest.mark.parametrize("bearing_deg", [-22, -10, 0, 10, 22])
def test_bearing_is_positive_to_the_right(detector, scene, bearing_deg):
    found_deg, _ = locate(detector, scene.render(1200, bearing_deg))
    assert found_deg == pytest.approx(bearing_deg, abs=0.4)


@pytest.mark.parametrize("slant_deg", [-45, -30, 30, 45])
def test_it_finds_the_picture_seen_from_the_side(detector, scene, slant_deg):
    bearing_deg, depth_mm = locate(detector, scene.render(1500, -3, slant_deg=slant_deg))
    assert bearing_deg == pytest.approx(-3, abs=0.7)
    assert depth_mm == pytest.approx(1500, rel=0.15)


@pytest.mark.parametrize("roll_deg", [-15, 12, 25, 40])
def test_features_find_a_picture_that_hangs_askew(detector, scene, roll_deg):
    frame = scene.render(700, 4, roll_deg=roll_deg)
    bearing_deg, depth_mm = locate(detector, frame)
    assert bearing_deg == pytest.approx(4, abs=0.3)
    assert depth_mm == pytest.approx(700, rel=0.03)
    (found,) = detector.detect(frame)
    (_, top_left), (_, top_right), *_ = found.quad
    assert (top_right > top_left) == (roll_deg > 0)


def test_a_picture_that_hangs_upside_down_is_as_high_as_it_hangs(detector, scene):
    found = detector.detect(scene.render(700, roll_deg=180))[0]
    assert PINHOLE.edges_mm(found, 297) == pytest.approx((-297 / 2, 297 / 2), abs=10)


def test_features_find_a_picture_that_is_partly_covered(detector, scene):
    frame = scene.render(600)
    frame[:, 165:] = (40, 90, 30)
    assert not DetectorWithoutFeatures(scene.picture).detect(frame)
    bearing_deg, depth_mm = locate(detector, frame)
    assert bearing_deg == pytest.approx(0, abs=0.3)
    assert depth_mm == pytest.approx(600, rel=0.03)


class DetectorWithoutFeatures:
    def __init__(self, picture):
        self._matcher = CorrelationMatcher(picture)

    def detect(self, image):
        return self._matcher.match(pyramid(image))


@pytest.mark.parametrize("roll_deg", [-15, -10, -5, 5, 10, 15])
@pytest.mark.parametrize("distance_mm", [500, 1500, 3000])
def test_a_rolled_camera_sees_it_as_far_as_a_level_one(detector, scene, roll_deg, distance_mm):
    bearing_deg, depth_mm = locate(detector, scene.render(distance_mm, 3, roll_deg=roll_deg))
    assert bearing_deg == pytest.approx(3, abs=0.5)
    assert depth_mm == pytest.approx(distance_mm, rel=0.05)


GAINS = {
    "a third of the light": (0.33, 0.33, 0.33),
    "lamp light": (0.5, 0.9, 1.3),
    "shade": (1.35, 1.0, 0.6),
    "three times the light": (3.0, 3.0, 3.0),
}


@pytest.mark.parametrize("light", sorted(GAINS))
@pytest.mark.parametrize("distance_mm", [600, 1500, 2500, 3500])
def test_it_bears_exposure_and_white_balance(detector, scene, light, distance_mm):
    frame = scene.render(distance_mm, 2).astype(np.float32) * np.array(GAINS[light], np.float32)
    bearing_deg, depth_mm = locate(detector, frame.clip(0, 255).astype(np.uint8))
    assert bearing_deg == pytest.approx(2, abs=0.5)
    assert depth_mm == pytest.approx(distance_mm, rel=0.06)


@pytest.mark.parametrize("place", [(-0.2, -0.2), (0.0, 0.0), (0.2, 0.25)])
@pytest.mark.parametrize("distance_mm", [700, 1400, 2200, 3000])
def test_it_bears_glare_on_a_fifth_of_the_print(detector, scene, place, distance_mm):
    frame = scene.render(distance_mm)
    height = PINHOLE.focal_px * 297 / distance_mm
    width = height * scene.picture.shape[1] / scene.picture.shape[0]
    centre = round(160 + place[0] * width), round(120 + place[1] * height)
    radius = (0.2 * width * height / math.pi) ** 0.5
    cv2.circle(frame, centre, round(radius), (255, 255, 255), -1, cv2.LINE_AA)
    bearing_deg, depth_mm = locate(detector, cv2.GaussianBlur(frame, (0, 0), 0.7))
    assert bearing_deg == pytest.approx(0, abs=0.7)
    assert depth_mm == pytest.approx(distance_mm, rel=0.08)


@pytest.mark.parametrize(("name", "distance_mm"), [("landscape", 1500), ("landscape", 2200), ("lena", 1000)])
def test_pictures_of_few_details_are_found_with_three_times_the_light(make_scene, distractors, name, distance_mm):
    picture = cv2.imread(str(PICTURES / f"{name}.png"))
    frame = make_scene(picture, distractors["brick"]).render(distance_mm, 2).astype(np.float32) * 3
    _, depth_mm = locate(DetectorWithoutFeatures(picture), frame.clip(0, 255).astype(np.uint8))
    assert depth_mm == pytest.approx(distance_mm, rel=0.08)


GLARED = [("rilakkuma", 1000), ("rilakkuma", 1500), ("lena", 3000), ("landscape", 3000), ("landscape", 3500)]


@pytest.mark.parametrize(("name", "distance_mm"), GLARED)
def test_drawings_are_found_with_glare_on_a_fifth_of_them(make_scene, distractors, name, distance_mm):
    picture = cv2.imread(str(PICTURES / f"{name}.png"))
    frame = make_scene(picture, distractors["brick"]).render(distance_mm)
    height = PINHOLE.focal_px * 297 / distance_mm
    radius = height * (0.2 * picture.shape[1] / picture.shape[0] / math.pi) ** 0.5
    cv2.circle(frame, (160, round(120 + 0.15 * height)), round(radius), (255, 255, 255), -1, cv2.LINE_AA)
    _, depth_mm = locate(DetectorWithoutFeatures(picture), cv2.GaussianBlur(frame, (0, 0), 0.7))
    assert depth_mm == pytest.approx(distance_mm, rel=0.1)


@pytest.mark.parametrize("distance_mm", [700, 1000, 1500, 2200])
def test_a_print_on_white_paper_is_found_with_glare_on_a_fifth_of_it(make_scene, distractors, distance_mm):
    picture = np.full((297, 210, 3), 245, np.uint8)
    cv2.circle(picture, (105, 110), 70, (40, 40, 200), -1, cv2.LINE_AA)
    cv2.rectangle(picture, (30, 215), (180, 245), (150, 80, 20), -1)
    frame = make_scene(picture, distractors["brick"]).render(distance_mm).astype(np.float32) * 0.93
    height = PINHOLE.focal_px * 297 / distance_mm
    radius = height * (0.2 * picture.shape[1] / picture.shape[0] / math.pi) ** 0.5
    cv2.circle(frame, (160, round(120 + 0.15 * height)), round(radius), (255, 255, 255), -1, cv2.LINE_AA)
    _, depth_mm = locate(DetectorWithoutFeatures(picture), cv2.GaussianBlur(frame, (0, 0), 0.7).astype(np.uint8))
    assert depth_mm == pytest.approx(distance_mm, rel=0.1)


DIM = [("landscape", 2500), ("landscape", 3000), ("landscape", 3500), ("rilakkuma", 2500), ("rilakkuma", 3000)]


@pytest.mark.parametrize(("name", "distance_mm"), DIM)
def test_a_reflection_is_left_out_in_a_dim_frame_that_shows_it_blurred(make_scene, distractors, name, distance_mm):
    picture = cv2.imread(str(PICTURES / f"{name}.png"))
    frame = make_scene(picture, distractors["brick"]).render(distance_mm).astype(np.float32) * 0.65
    height = PINHOLE.focal_px * 297 / distance_mm
    radius = height * (0.1 * picture.shape[1] / picture.shape[0] / math.pi) ** 0.5
    cv2.circle(frame, (160, round(120 + 0.15 * height)), round(radius), (255, 255, 255), -1, cv2.LINE_AA)
    blurred = cv2.GaussianBlur(frame, (0, 0), 1.2)
    _, depth_mm = locate(DetectorWithoutFeatures(picture), blurred.astype(np.uint8))
    assert depth_mm == pytest.approx(distance_mm, rel=0.1)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_picture_that_reaches_out_of_the_frame_is_found(detector, scene, side):
    bearing_deg, depth_mm = locate(DetectorWithoutFeatures(scene.picture), scene.render(900, side * 27))
    assert depth_mm == pytest.approx(900, rel=0.1)
    assert bearing_deg == pytest.approx(side * 27, abs=1.5)


@pytest.mark.slow
def test_it_finds_nothing_in_other_pictures_in_any_light(detector, distractors):
    for gain in sorted(GAINS.values()):
        for name, image in distractors.items():
            lit = (image.astype(np.float32) * np.array(gain, np.float32)).clip(0, 255).astype(np.uint8)
            assert detector.detect(lit) == [], (name, gain)


def test_without_features_it_needs_the_whole_picture_upright(astronaut, scene):
    detector = DetectorWithoutFeatures(astronaut)
    assert detector.detect(scene.render(700))
    assert not detector.detect(scene.render(700, roll_deg=45))


@pytest.mark.parametrize("change", ["dark", "bright", "blue cast", "soft"])
def test_it_bears_bad_light_and_focus(detector, scene, change):
    frame = scene.render(1500, 2)
    if change == "soft":
        frame = cv2.GaussianBlur(frame, (0, 0), 1.5)
    else:
        gain = {"dark": (0.35, 0.35, 0.35), "bright": (1.2, 1.2, 1.2), "blue cast": (1.2, 1.0, 0.75)}[change]
        frame = (frame * np.array(gain)).clip(0, 255).astype(np.uint8)
    bearing_deg, _ = locate(detector, frame)
    assert bearing_deg == pytest.approx(2, abs=0.5)


def test_larger_frames_are_searched_as_well(detector, make_scene, astronaut, distractors):
    scene = make_scene(astronaut, cv2.resize(distractors["brick"], (640, 480)))
    bearing_deg, depth_mm = locate(detector, scene.render(3000, 8))
    assert bearing_deg == pytest.approx(8, abs=0.3)
    assert depth_mm == pytest.approx(3000, rel=0.08)


@pytest.mark.parametrize(
    ("ground", "disc", "sheet"), [(0, (200, 60, 255), (60, 160, 255)), (165, (255, 190, 255), (170, 220, 255))]
)
def test_a_black_or_bright_picture_is_found_in_an_overexposed_frame(make_scene, distractors, ground, disc, sheet):
    picture = np.full((297, 210, 3), ground, np.uint8)
    cv2.circle(picture, (80, 100), 45, disc, -1)
    cv2.rectangle(picture, (60, 180), (170, 250), sheet, -1)
    scene = make_scene(picture, distractors["brick"])
    overexposed = scene.render(900)
    overexposed[:70] = 255
    _, depth_mm = locate(PictureDetector([picture]), overexposed)
    assert depth_mm == pytest.approx(900, rel=0.08)


@pytest.mark.parametrize("distance_mm", [1000, 2000, 3000])
def test_a_dark_picture_on_a_white_wall_is_found_with_three_times_the_light(make_scene, distance_mm):
    picture = cv2.cvtColor(data.rocket()[:, 180:460], cv2.COLOR_RGB2BGR)
    wall = np.full((240, 320, 3), (120, 130, 140), np.uint8)
    wall[:150] = 190
    frame = make_scene(picture, wall).render(distance_mm, 2).astype(np.float32) * 3 ** (1 / 2.2)
    _, depth_mm = locate(DetectorWithoutFeatures(picture), frame.clip(0, 255).astype(np.uint8))
    assert depth_mm == pytest.approx(distance_mm, rel=0.08)


def test_it_finds_nothing_in_other_pictures(detector, distractors):
    assert {name for name, image in distractors.items() if detector.detect(image)} == set()


def test_it_finds_nothing_in_frames_without_content(detector):
    noise = np.random.default_rng(1).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    for frame in (np.zeros((240, 320, 3), np.uint8), np.full((240, 320, 3), 255, np.uint8), noise, noise[:7, :9]):
        assert detector.detect(frame) == []


@pytest.mark.parametrize("shape", [(1, 16_000), (16_000, 1), (1, 1), (2, 700)])
def test_it_finds_nothing_in_frames_of_any_shape(detector, shape):
    assert detector.detect(np.random.default_rng(0).integers(0, 256, (*shape, 3), np.uint8)) == []


def test_a_grey_copy_of_the_picture_is_another_picture(detector, make_scene, astronaut, distractors):
    grey = cv2.cvtColor(cv2.cvtColor(astronaut, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    red = (grey * np.array((0.2, 0.3, 1.0))).astype(np.uint8)
    for copy in (255 - grey, 255 - red):
        assert detector.detect(make_scene(copy, distractors["coffee"]).render(800)) == []


def test_several_photographs_are_one_target(astronaut, distractors, make_scene):
    cat = np.ascontiguousarray(distractors["chelsea"][:, 70:240])
    both = PictureDetector([astronaut, cat])
    for picture in (astronaut, cat):
        found = both.detect(make_scene(picture, distractors["brick"]).render(1000))
        assert len(found) == 1


def test_the_same_frame_gives_the_same_answer(detector, scene):
    frame = scene.render(700, roll_deg=12)
    assert detector.detect(frame) == detector.detect(frame)


def test_a_look_near_the_old_place_agrees_with_a_look_at_all(detector, scene):
    for distance_mm in (400, 1000, 3000):
        frame = scene.render(distance_mm, 6)
        (everywhere,) = detector.detect(frame)
        (near,) = detect_near(detector, frame, everywhere.box)
        np.testing.assert_allclose(near.box, everywhere.box, atol=0.05 * everywhere.box[3] + 1)


def test_a_look_near_a_place_outside_the_frame_finds_nothing(detector, scene):
    assert detect_near(detector, scene.render(1000), (900, 900, 20, 30)) == []


def test_useless_pictures_are_refused():
    with pytest.raises(ConfigError, match=r"at least one"):
        PictureDetector([])
    with pytest.raises(ConfigError, match=r"30x20 pixels"):
        PictureDetector([np.zeros((20, 30, 3), np.uint8)])
    for shape in ((MAX_RATIO * 40 + 1, 40), (40, MAX_RATIO * 40 + 1)):
        with pytest.raises(ConfigError, match=r"too narrow"):
            PictureDetector([np.random.default_rng(0).integers(0, 256, (*shape, 3), np.uint8)])
    with pytest.raises(ConfigError, match=r"single colour"):
        PictureDetector([np.full((200, 100, 3), 7, np.uint8)])


def test_detectors_that_share_a_frame_find_what_each_finds_alone(scene, astronaut, distractors):
    frame = scene.render(1200, 5)
    detectors = {
        "astronaut": PictureDetector([astronaut]),
        "cat": PictureDetector([distractors["chelsea"]]),
        "both": PictureDetector([distractors["chelsea"], astronaut]),
        "red": ColorDetector("red"),
    }
    together = detect_each(detectors, frame)
    for name, detector in detectors.items():
        alone = detector.detect(frame)
        assert [one.box for one in together[name]] == [one.box for one in alone]
        for one, other in zip(together[name], alone, strict=True):
            # the sums of a product of matrices are rounded differently for another number of rows
            np.testing.assert_allclose(one.quad, other.quad, atol=1e-4)
            assert one.score == pytest.approx(other.score, abs=1e-6)
    assert [name for name in ("astronaut", "cat", "both") if together[name]] == ["astronaut", "both"]
