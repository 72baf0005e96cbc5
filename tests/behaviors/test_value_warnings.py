"""Values of a mission that are valid but probably not intended."""

import pytest

from behaviors.mission import BUILT_IN, load_mission
from behaviors.mission.usual_heights import USUAL_HEIGHTS_MM
from behaviors.mission.value_warnings import value_warnings
from tests.small_mission import COLOR_MISSION as GOOD


@pytest.fixture
def warned(tmp_path):
    """Return the warnings of a mission; the files it names exist."""
    for name in ("any.onnx", "cat.png", "lena.png", "rilakkuma.png"):
        (tmp_path / name).touch()

    def warnings(text):
        (tmp_path / "mission.toml").write_text(text, encoding="utf-8")
        return list(value_warnings(load_mission(tmp_path / "mission.toml")))

    return warnings


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("[mission]", "[mission]\nprofile = 'thesis'"), None),
        (("[target.box]", "[thesis]\nwait_s = 3\n[target.box]"), "thesis: wait_s has no effect"),
        (("[target.box]", "[thesis]\ncontinue_every_s = 3\n[target.box]"), None),
        (("[target.box]", "[thesis]\nadvances = 3\n[adaptive]\nchooses_viewpoints = false\n[target.box]"), None),
        (("[mission]", "[adaptive]\nrounds = 5\n[thesis]\nwait_s = 3\n[mission]\nprofile = 'my.own:Profile'"), None),
        (('["box"]', '["box", "box"]'), "'box' is listed 2 times"),
        (("[target.box]", "[target.cat]\ndetector = 'marker'\nid = 1\n[target.box]"), "target.cat: no effect"),
        (("color =", "height_mm = 29.7\ncolor ="), "Is it in centimetres? Then it is 297 mm"),
        (("color =", "height_mm = 2600\ncolor ="), "more than 2.5 m"),
        (("color =", "height_mm = 2500\ncolor ="), None),
        (("[target.box]", "[robot]\nstop_distance_mm = 400\n[target.box]"), "the safety stop ends an approach 440 mm"),
        (
            (
                "[mission]",
                "[thesis]\narrive_mm = 600\n[robot]\nstop_distance_mm = 400\n[mission]\nprofile = 'my.own:Profile'",
            ),
            "before adaptive.arrive_mm = 420",
        ),
        (
            ("[target.box]", "[robot]\nstop_distance_mm = 320\n[camera]\nforward_mm = -20\n[target.box]"),
            "the safety stop ends an approach 440 mm",
        ),
        (("[target.box]", "[robot]\nstop_distance_mm = 400\n[camera]\nforward_mm = 90\n[target.box]"), None),
        (("[target.box]", "[robot]\nwheel_diameter_mm = 20\n[target.box]"), "drive 149 mm/s at most"),
        (("[target.box]", "[robot]\nwheel_diameter_mm = 81.6\n[target.box]"), None),
        (
            ("[target.box]", "[robot]\nwheel_diameter_mm = 81.6\naxle_track_mm = 35\n[target.box]"),
            "only 35 mm apart",
        ),
        (("[target.box]", "[robot]\nstop_distance_mm = 400\nultrasonic = 0\n[target.box]"), None),
    ],
)
def test_valid_values_that_are_probably_not_intended_are_warned_of(warned, change, expected):
    told = warned(GOOD.replace(*change))
    assert len(told) == (expected is not None)
    assert expected is None or expected in told[0]


@pytest.mark.parametrize(
    "target",
    [
        'detector = "marker"\nid = 7',
        'detector = "qr"\ntext = "7"',
        'detector = "color"\ncolor = "red"',
        'detector = "haar"',
        'detector = "onnx"\nmodel = "any.onnx"\nlabel = "cup"',
    ],
)
def test_targets_that_no_detector_distinguishes_cause_a_warning(warned, target):
    two = f'[mission]\ntargets = ["a", "b"]\n[target.a]\n{target}\n[target.b]\n{target}\nheight_mm = 100\n'
    (told,) = warned(two)
    assert told.startswith("target.b: target.a has the same detector and keys")
    other = two.replace("7", "8", 1).replace("red", "blue", 1).replace("cup", "cat", 1)
    other = other.replace('"haar"', '"haar"\ncascade = "haarcascade_eye"', 1)
    assert warned(other) == []


def test_targets_with_the_same_picture_are_left_to_the_comparison_of_pictures(warned):
    targets = "".join(f'[target.{name}]\ndetector = "picture"\npictures = ["cat.png"]\n' for name in "ab")
    assert warned(f'[mission]\ntargets = ["a", "b"]\n{targets}') == []


def test_no_usual_height_is_taken_for_a_wrong_unit(warned):
    for height_mm in USUAL_HEIGHTS_MM.values():
        assert warned(GOOD.replace("[target.box]", f"[target.box]\nheight_mm = {height_mm}")) == []


CALIBRATED = "hue_deg = 26, reach_deg = 10, min_saturation_percent = 70, min_value_percent = 20"


@pytest.mark.parametrize(("shade", "count"), [("", 1), (f"color.orange = {{ {CALIBRATED} }}\n", 0)])
def test_orange_that_was_not_calibrated_is_warned_of(warned, shade, count):
    text = f'{shade}[mission]\ntargets = ["ball"]\n[target.ball]\ndetector = "color"\ncolor = "orange"\n'
    assert ["wood" in each for each in warned(text)] == [True] * count


def test_the_built_in_mission_is_not_odd(warned):
    assert warned(BUILT_IN.read_text(encoding="utf-8")) == []
