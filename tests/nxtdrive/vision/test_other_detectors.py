"""The detectors of markers, QR codes, colours and cascades."""

import cv2
import numpy as np
import pytest
import segno
import skimage.data
from hypothesis import given
from hypothesis import strategies as st

from behaviors.mission import Mission, described_by
from behaviors.mission.robot import RobotFile
from firmware_protocol.errors import ConfigError
from nxtdrive.mission.detectors import build_detectors
from nxtdrive.vision.detectors.color import HUES, ColorDetector
from nxtdrive.vision.detectors.haar import DEFAULT_CASCADE, HaarDetector, cascades
from nxtdrive.vision.detectors.marker import FAMILIES, MarkerDetector
from nxtdrive.vision.detectors.qr import QrDetector
from nxtdrive.vision.geometry import Pinhole

PINHOLE = Pinhole.from_hfov(320, 60)


def sheet_with_marker(family, number):
    """An A4 sheet with a marker of 158 mm in its middle."""
    sheet = np.full((594, 420), 255, np.uint8)
    dictionary, _ = FAMILIES[family]
    marker = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(dictionary), number, 316)
    sheet[139 : 139 + 316, 52 : 52 + 316] = marker
    return cv2.cvtColor(sheet, cv2.COLOR_GRAY2BGR)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize(("distance_mm", "bearing_deg", "slant_deg"), [(400, 0, 0), (1000, -12, 40), (2000, 15, -30)])
def test_marker_is_found_where_it_is(make_scene, distractors, family, distance_mm, bearing_deg, slant_deg):
    scene = make_scene(sheet_with_marker(family, 7), distractors["brick"])
    (found,) = MarkerDetector(7, family).detect(scene.render(distance_mm, bearing_deg, slant_deg))
    found_bearing_deg, found_distance_mm = PINHOLE.locate(found, 158)
    assert found_bearing_deg == pytest.approx(bearing_deg, abs=0.4)
    depth_mm = found_distance_mm * np.cos(np.radians(found_bearing_deg))
    assert depth_mm == pytest.approx(distance_mm, rel=0.07)
    assert found.score == 1.0


@pytest.mark.parametrize("quarters", range(4))
def test_marker_is_as_far_away_and_as_high_whichever_of_its_sides_is_up(make_scene, distractors, quarters):
    sheet = np.rot90(sheet_with_marker("aruco_4x4_50", 7)[87:507], quarters)  # square, 210 mm
    (found,) = MarkerDetector(7).detect(make_scene(sheet, distractors["brick"]).render(700, slant_deg=50))
    height_mm = 297 * 316 / 420
    assert PINHOLE.locate(found, height_mm)[1] == pytest.approx(700, rel=0.05)
    assert PINHOLE.edges_mm(found, height_mm) == pytest.approx((-height_mm / 2, height_mm / 2), abs=8)


def test_marker_with_another_number_is_another_target(make_scene, distractors):
    frame = make_scene(sheet_with_marker("aruco_4x4_50", 7), distractors["brick"]).render(600)
    assert MarkerDetector(8).detect(frame) == []
    assert MarkerDetector(7, "apriltag_36h11").detect(frame) == []


def test_marker_finds_none_in_photographs(distractors):
    for family in FAMILIES:
        assert not any(MarkerDetector(7, family).detect(image) for image in distractors.values())


def test_marker_that_does_not_exist_is_refused():
    with pytest.raises(ConfigError, match=r"no marker 50. Its numbers are 0 to 49"):
        MarkerDetector(50)
    with pytest.raises(ConfigError, match=r"no marker family"):
        MarkerDetector(1, "qr")


def sheet_with_code(text, quarters=0):
    """An A4 sheet with a QR code of 158 mm in its middle, turned by quarters."""
    sheet = np.full((594, 420), 255, np.uint8)
    code = cv2.QRCodeEncoder.create().encode(text)[2:-2, 2:-2]  # without the white around it
    big = cv2.resize(np.rot90(code, quarters), (316, 316), interpolation=cv2.INTER_NEAREST)
    sheet[139 : 139 + 316, 52 : 52 + 316] = big
    return cv2.cvtColor(sheet, cv2.COLOR_GRAY2BGR)


@pytest.mark.parametrize("text", ["7", "kitchen", "größer"])
@pytest.mark.parametrize(
    ("distance_mm", "bearing_deg", "quarters"), [(400, 0, 0), (600, -8, 1), (750, 6, 2), (900, 0, 0)]
)
def test_qr_code_is_found_where_it_is(make_scene, distractors, text, distance_mm, bearing_deg, quarters):
    scene = make_scene(sheet_with_code(text, quarters), distractors["brick"])
    (found,) = QrDetector(text).detect(scene.render(distance_mm, bearing_deg))
    found_bearing_deg, found_distance_mm = PINHOLE.locate(found, 158)
    assert found_bearing_deg == pytest.approx(bearing_deg, abs=0.4)
    depth_mm = found_distance_mm * np.cos(np.radians(found_bearing_deg))
    assert depth_mm == pytest.approx(distance_mm, rel=0.05)
    assert found.score == 1.0
    assert np.argmin(np.sum(found.quad, axis=1)) == 0


def test_qr_code_with_another_text_is_another_target(make_scene, distractors):
    frame = make_scene(sheet_with_code("7"), distractors["brick"]).render(500)
    assert QrDetector("17").detect(frame) == []
    assert QrDetector("7").detect(frame) != []


def test_the_nearer_of_two_equal_qr_codes_comes_first():
    frame = np.full((480, 640, 3), 255, np.uint8)
    near = cv2.resize(sheet_with_code("7"), (297, 420))
    frame[30:450, 20:317] = near
    frame[90:300, 400:548] = cv2.resize(near, (148, 210))
    heights = [one.box[3] for one in QrDetector("7").detect(frame)]
    assert len(heights) == 2
    assert heights[0] > 1.5 * heights[1]


def test_qr_finds_a_code_that_is_light_on_dark():
    frame = frame_with_codes(segno.make("kitchen", micro=False), segno.make("7", micro=False))
    (found,) = QrDetector("7").detect(255 - frame)
    assert found == QrDetector("7").detect(frame)[0]


def test_qr_survives_a_code_that_opencv_cannot_decode():
    frame = frame_with_codes(segno.make("点茗", mode="hanzi", micro=False), segno.make("7", micro=False))
    assert len(QrDetector("7").detect(frame)) == 1


def frame_with_codes(*codes):
    """A frame with codes that segno made, side by side."""
    frame = np.full((240, 640, 3), 255, np.uint8)
    for place, code in enumerate(codes):
        modules = np.array([[255 * (1 - bit) for bit in row] for row in code.matrix], np.uint8)
        size = 120 // len(modules) * len(modules)
        big = cv2.resize(modules, (size, size), interpolation=cv2.INTER_NEAREST)
        frame[60 : 60 + size, 60 + 300 * place : 60 + 300 * place + size] = big[:, :, None]
    return frame


@pytest.mark.parametrize(
    ("text", "how"),
    [
        ("日本", {"mode": "kanji"}),
        ("Привет", {"mode": "kanji"}),
        ("Привет", {"encoding": "utf-8"}),
        ("Küche", {"encoding": "iso-8859-1"}),
        ("Küche", {"encoding": "utf-8", "eci": True}),
    ],
)
def test_qr_reads_the_encodings_of_other_generators(text, how):
    frame = frame_with_codes(segno.make(text, micro=False, **how), segno.make("7", micro=False))
    assert len(QrDetector(text).detect(frame)) == 1
    assert len(QrDetector("7").detect(frame)) == 1


@pytest.mark.slow
@given(st.integers(2, 60), st.integers(2, 60), st.integers(0, 2**32 - 1))
def test_qr_survives_scraps_of_codes(height, width, seed):
    """Parts of a code at any place and size, stretched over the frame, with noise."""
    rng = np.random.default_rng(seed)
    code = sheet_with_code("7")[100:480, 30:400]
    top, left = rng.integers(0, 300), rng.integers(0, 300)
    scrap = cv2.resize(code[top : top + 8 * height, left : left + 8 * width], (4 * width, 4 * height))
    frame = np.full((240, 320, 3), 200, np.uint8)
    frame[: 4 * height, : 4 * width] = scrap
    noisy = np.clip(frame + rng.normal(0, rng.integers(1, 60), frame.shape), 0, 255).astype(np.uint8)
    assert len(QrDetector("7").detect(noisy)) <= 1


def test_qr_finds_none_in_photographs(distractors):
    assert not any(QrDetector("7").detect(image) for image in distractors.values())


@pytest.mark.parametrize("color", HUES)
def test_color_is_found_where_it_is(make_scene, distractors, color):
    paint = cv2.cvtColor(np.full((297, 210, 3), (HUES[color], 220, 200), np.uint8), cv2.COLOR_HSV2BGR)
    found = ColorDetector(color).detect(make_scene(paint, distractors["moon"]).render(1500, -8))
    bearing_deg, distance_mm = PINHOLE.locate(found[0], 297)
    assert bearing_deg == pytest.approx(-8, abs=0.5)
    assert distance_mm == pytest.approx(1500, rel=0.06)
    assert found[0].score > 0.9


def test_color_is_not_another_color(make_scene, distractors):
    paint = cv2.cvtColor(np.full((297, 210, 3), (HUES["green"], 220, 200), np.uint8), cv2.COLOR_HSV2BGR)
    frame = make_scene(paint, distractors["moon"]).render(1000)
    assert [color for color in HUES if ColorDetector(color).detect(frame)] == ["green"]


@pytest.mark.parametrize("hue", [0, 4, 20, 90, 160, 179])
@pytest.mark.parametrize("reach_deg", [16.0, 60.0])
def test_a_color_is_what_it_was_calibrated_to_be(hue, reach_deg):
    def frame(hue: float) -> np.ndarray:
        image = np.full((240, 320, 3), 128, np.uint8)
        paint = np.full((1, 1, 3), (round(hue) % 180, 100, 90), np.uint8)
        image[80:160, 100:200] = cv2.cvtColor(paint, cv2.COLOR_HSV2BGR)[0, 0]
        return image

    shade = {"hue_deg": 2.0 * hue, "reach_deg": reach_deg, "min_saturation_percent": 30.0, "min_value_percent": 30.0}
    detector = ColorDetector("red", **shade)
    for within in (-0.4, 0, 0.4):
        assert detector.detect(frame(hue + within * reach_deg))
    for beyond in (-0.7, 0.7):
        assert not detector.detect(frame(hue + beyond * reach_deg))
    assert not ColorDetector("red", **{**shade, "min_saturation_percent": 50.0}).detect(frame(hue))
    assert not ColorDetector("red", **{**shade, "min_value_percent": 50.0}).detect(frame(hue))


def test_a_mission_looks_for_a_color_as_the_robot_file_has_it():
    shade = {"hue_deg": 240.0, "reach_deg": 16.0, "min_saturation_percent": 40.0, "min_value_percent": 20.0}
    tables = {"mission": {"targets": ["a"]}, "target": {"a": {"detector": "color", "color": "red"}}}
    described = described_by(Mission.model_validate(tables), RobotFile.model_validate({"color": {"red": shade}}))
    paint = cv2.cvtColor(np.full((1, 1, 3), (120, 220, 200), np.uint8), cv2.COLOR_HSV2BGR)
    frame = np.full((240, 320, 3), 128, np.uint8)
    frame[80:160, 100:200] = paint[0, 0]
    assert build_detectors(described)["a"].detector.detect(frame)
    assert not build_detectors(Mission.model_validate(tables))["a"].detector.detect(frame)


def test_color_needs_a_compact_patch():
    frame = np.full((240, 320, 3), 128, np.uint8)
    cv2.line(frame, (10, 10), (300, 220), (0, 0, 255), 6)
    assert ColorDetector("red").detect(frame) == []


def test_color_that_does_not_exist_is_refused():
    with pytest.raises(ConfigError, match=r"no colour 'mauve'. Use one of: red"):
        ColorDetector("mauve")


@pytest.mark.parametrize("distance_mm", [500, 800])
def test_haar_finds_a_real_face(scene, distance_mm):
    found = HaarDetector().detect(scene.render(distance_mm, 5))
    u, v = found[0].centre
    corners = scene.corners(distance_mm, 5)
    # the face is in the upper middle of the portrait
    assert corners[0][0] < u < corners[1][0]
    assert corners[0][1] < v < corners[2][1] - 0.4 * np.ptp(corners[:, 1])


def test_haar_finds_no_face_where_there_is_none(distractors):
    haar = HaarDetector()
    assert {name for name, image in distractors.items() if haar.detect(image)} == set()


@pytest.mark.parametrize("height_px", [60, 120, 160])
def test_haar_does_not_take_a_logo_for_a_face_as_one_cascade_alone_does(height_px):
    sheet = np.full((594, 420, 3), 255, np.uint8)
    cv2.circle(sheet, (210, 230), 140, (40, 30, 200), -1, cv2.LINE_AA)
    cv2.fillPoly(sheet, [np.array([(210, 130), (300, 290), (120, 290)])], (255, 255, 255), cv2.LINE_AA)
    cv2.rectangle(sheet, (80, 430), (340, 480), (150, 60, 20), -1)
    frame = np.full((240, 320, 3), 90, np.uint8)
    width_px = round(height_px * 420 / 594)
    frame[20 : 20 + height_px, 100 : 100 + width_px] = cv2.resize(
        sheet, (width_px, height_px), interpolation=cv2.INTER_AREA
    )
    alone = cv2.CascadeClassifier(str(next(file for file in _cascade_files() if file.stem == DEFAULT_CASCADE)))
    assert len(alone.detectMultiScale(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY))) == 1
    assert HaarDetector().detect(frame) == []


@pytest.mark.parametrize("height_px", [178, 196, 202, 214])
def test_haar_takes_no_coin_for_a_face_as_two_cascades_do(height_px):
    sheet = skimage.data.coins()[:300, :215]
    frame = np.full((240, 320, 3), 90, np.uint8)
    width_px = round(height_px * 215 / 300)
    small = cv2.resize(sheet, (width_px, height_px), interpolation=cv2.INTER_AREA)
    frame[5 : 5 + height_px, 10 : 10 + width_px] = small[..., None]
    assert HaarDetector().detect(frame) == []


def test_haar_takes_a_file_and_lists_what_there_is(tmp_path):
    assert "haarcascade_frontalface_default" in cascades()
    HaarDetector(str(next(iter(_cascade_files()))))
    with pytest.raises(ConfigError, match=r"no cascade 'bear'.*haarcascade_frontalface_alt2"):
        HaarDetector("bear")


@pytest.mark.parametrize("content", ["not xml", "<opencv_storage></opencv_storage>", "<?xml version='1.0'?><a/>"])
def test_haar_refuses_anything_that_is_not_a_cascade(tmp_path, content):
    file = tmp_path / "bear.xml"
    file.write_text(content)
    with pytest.raises(ConfigError, match=r"bear\.xml is not a cascade"):
        HaarDetector(str(file))


def test_haar_explains_an_opencv_that_has_none(monkeypatch):
    monkeypatch.delattr(cv2, "CascadeClassifier", raising=False)
    with pytest.raises(ConfigError, match=r"has no Haar detector.*opencv-python-headless<5"):
        HaarDetector()


def _cascade_files():
    from pathlib import Path

    return sorted((Path(cv2.__file__).parent / "data").glob("*frontalface*.xml"))
