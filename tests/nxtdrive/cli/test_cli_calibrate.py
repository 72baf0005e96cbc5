"""``nxtdrive calibrate``: the sheet, the robot file, and what is refused."""

import io
import json
import re

import cv2
import numpy as np
import pytest
from PIL import Image

from behaviors.mission.robot import CALIBRATED, load_robot_file
from nxtdrive.cli.main import DONE, NOT_ACHIEVED, USAGE, main
from sim_backend.bundled import WORLDS

pytestmark = pytest.mark.usefixtures("here")


def test_the_sheet_has_its_true_size_and_its_markers(here):
    assert main(["calibrate", "--sheet", "sheet.png"]) == DONE
    with Image.open("sheet.png") as sheet:
        assert sheet.info["dpi"] == pytest.approx((254, 254), abs=0.1)
        assert [each / 254 * 25.4 for each in sheet.size] == pytest.approx([297, 210], abs=0.1)
        picture = np.asarray(sheet)
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    corners, ids, _ = detector.detectMarkers(picture)
    assert sorted(ids.ravel()) == [40, 41, 42, 43, 44, 45]
    assert [np.linalg.norm(quad[0][0] - quad[0][1]) / 254 * 25.4 for quad in corners] == pytest.approx(
        [80] * 6, abs=0.3
    )


def test_the_sheet_is_a_page_of_a4_as_pdf(here):
    assert main(["calibrate", "--sheet", "sheet.pdf"]) == DONE
    box = re.search(rb"MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", (here / "sheet.pdf").read_bytes())
    assert [float(each) / 72 * 25.4 for each in box.groups()] == pytest.approx([297, 210], abs=0.2)


def test_a_sheet_of_another_kind_is_refused(refused):
    assert "Use .pdf or .png" in refused("calibrate", "--sheet", "sheet.doc")


def test_an_unknown_word_is_refused_before_a_sheet_is_written(here, refused):
    assert "there is no 'a4' to calibrate" in refused("calibrate", "--sheet", "sheet.pdf", "a4")
    assert not (here / "sheet.pdf").exists()


@pytest.mark.parametrize("path", ["nowhere/robot.toml", "robots"])
def test_a_file_that_cannot_be_written_is_refused_before_the_robot_drives(here, capsys, path):
    (here / "robots").mkdir()
    assert main(["calibrate", "--robot", path]) == USAGE
    said = capsys.readouterr()
    assert said.out == ""
    assert "turning each wheel" not in said.err


@pytest.mark.parametrize("what", ["camera", "motors"])
def test_without_a_sheet_in_view_nothing_is_written(here, capsys, what):
    (here / "robot.toml").write_text("[robot]\nradius_mm = 140.0\n")
    assert main(["calibrate", what, "--nxt", "sim://open", "--robot", "none.toml"]) == NOT_ACHIEVED
    assert capsys.readouterr().err.endswith("none.toml was not written.\n")
    assert main(["calibrate", what, "--nxt", "sim://open"]) == NOT_ACHIEVED
    said = capsys.readouterr().err
    assert "sees no marker" in said
    assert said.endswith("robot.toml was left as it is.\n")
    assert (here / "robot.toml").read_text() == "[robot]\nradius_mm = 140.0\n"


@pytest.mark.parametrize("words", [["windows"], ["camera", "--robot", "bad.toml"]])
def test_what_cannot_be_is_refused(here, words):
    (here / "bad.toml").write_text("[robot]\nradius_mm = -1\n")
    assert main(["calibrate", *words]) == USAGE


def test_a_real_robot_does_not_drive_without_being_asked(refused):
    assert "--yes" in refused("calibrate", "--nxt", "usb://")


@pytest.mark.parametrize("words", [["--nxt", "sim://calibration"], ["--trace", "talk.nxttrace"]])
def test_the_directions_of_the_motors_are_found_alone(here, printed, words):
    assert re.search(r"motors\.dead_zone_percent +│ +│ 8 ", printed("calibrate", "motors", *words))
    file = load_robot_file(here / "robot.toml")
    assert not file.robot.left_reversed | file.robot.right_reversed
    assert 0 < file.calibration.motors.measured["dead_zone_percent"] < 40
    assert file.calibration.missing == ["camera", "wheels", "sonar"]


def test_exchanged_motors_are_noticed(here, capsys):
    (here / "robot.toml").write_text('[robot]\nleft = "C"\nright = "B"\n')
    assert main(["calibrate", "motors"]) == NOT_ACHIEVED
    assert 'set left = "B" and right = "C"' in capsys.readouterr().err


@pytest.mark.slow
def test_a_turn_that_fails_names_the_ports_of_the_motors(here, capsys):
    (here / "robot.toml").write_text('[robot]\nleft = "A"\nright = "B"\n')
    assert main(["calibrate", "wheels"]) == NOT_ACHIEVED
    assert "Is the left wheel's motor on port A and the right one's on port B?" in capsys.readouterr().err


@pytest.mark.parametrize("words", [[], ["wheels", "--ruler"]])
def test_the_file_of_another_brick_is_not_overwritten(here, capsys, words):
    (here / "robot.toml").write_text('[calibration]\nbrick_id = "0016530A1B2C"\n')
    assert main(["calibrate", *words]) == NOT_ACHIEVED
    assert "Choose another file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "verdict", "said"),
    [
        (None, "warning", "there is no robot file"),
        ("[robot]\n", "warning", "camera not calibrated"),
        ("[robot]\nradius_mm = 1\n", "problem", "robot.radius_mm"),
        (
            "".join(f"[calibration.{each}]\ndate = 2026-01-02\nmethod = 'm'\n" for each in CALIBRATED),
            "ok",
            "camera 2026-01-02, wheels 2026-01-02",
        ),
    ],
)
def test_the_doctor_says_what_is_calibrated(here, monkeypatch, capsys, text, verdict, said):
    if text is not None:
        (here / "robot.toml").write_text(text)
        monkeypatch.setenv("NXT_ROBOT", "robot.toml")
    main(["doctor", "--nxt", "sim://", "--json"])
    findings = {each["topic"]: each for each in json.loads(capsys.readouterr().out)["findings"]}
    assert findings["calibration"]["verdict"] == verdict
    assert said in findings["calibration"]["text"]


WORLD = """
[floor]
size_mm = [3000, 2000]
[robot]
start_mm = [600, 1000]
wheel_diameter_mm = 58.0
track_mm = 105.0
slip = { jitter_percent = 0 }
"""


def test_wheels_are_measured_by_ruler(here, monkeypatch, capsys):
    (here / "world.toml").write_text(WORLD)
    # what a ruler says of wheels that are larger than the usual 56 mm, and nearer than the usual 112 mm
    driven_mm, over_deg = 1000 * 58 / 56, 1800 * (58 / 56 * 112 / 105 - 1)
    answers = iter(["", f"{driven_mm}", "", "so-so", f"{over_deg}", "140"])
    monkeypatch.setattr("builtins.input", lambda: next(answers))
    assert main(["calibrate", "wheels", "--ruler", "--nxt", "sim://world.toml"]) == DONE
    file = load_robot_file(here / "robot.toml")
    assert file.robot.wheel_diameter_mm == pytest.approx(58.0, abs=0.1)
    assert file.robot.axle_track_mm == pytest.approx(105.0, abs=0.3)
    assert file.robot.radius_mm == 140.0
    assert file.calibration.wheels.method == "ruler"
    # 2 mm in a metre, 3 degrees in five turns
    sure = {"wheel_diameter_mm": 58 * 0.002, "axle_track_mm": 105 * (0.002 + 3 / 1800), "radius_mm": 5.0}
    assert file.calibration.wheels.standard_uncertainty == pytest.approx(sure, rel=0.05)
    assert file.calibration.brick_id == "001653010203"


@pytest.mark.parametrize(
    ("answers", "said"),
    [
        (
            ["", "100", "", "1000", "", "0", ""],
            ["That is 10% of what the wheels counted", "That is 0% of what the wheels"],
        ),
        (["", "1000", "", "3600", "0", ""], ["That is 300% of what the wheels counted"]),
        (["", "1000", "", "0", "14", "140"], ["A radius of 14 mm does not reach the wheels"]),
        (["", "1000", "", "0", "1400", "140"], ["radius_mm: must be 500 or less, not 1400.0"]),
    ],
)
def test_a_slip_of_the_pen_is_asked_again_and_costs_no_drive(here, monkeypatch, capsys, answers, said):
    rest = iter(answers)
    monkeypatch.setattr("builtins.input", lambda: next(rest))
    assert main(["calibrate", "wheels", "--ruler", "--nxt", "sim://open"]) == DONE
    assert list(rest) == []
    printed = capsys.readouterr().err
    assert [printed.count(each) for each in said] == [1] * len(said)
    assert printed.count("Then the robot drives one metre ahead") == 1
    assert "sheet" not in printed


@pytest.mark.parametrize(
    ("answers", "said"),
    [
        (["", "-990"], "the robot drove back. Set left_reversed and right_reversed"),
        (["", "1000", "", "-3600"], "the robot turned to the left. Exchange the ports left and right"),
    ],
)
def test_a_robot_that_moves_the_other_way_is_refused_at_once(here, monkeypatch, capsys, answers, said):
    rest = iter(answers)
    monkeypatch.setattr("builtins.input", lambda: next(rest))
    assert main(["calibrate", "wheels", "--ruler", "--nxt", "sim://open"]) == NOT_ACHIEVED
    printed = capsys.readouterr()
    assert said in printed.err
    assert "negative: back" in printed.out + printed.err


def test_a_ruler_needs_no_world_and_says_what_an_answer_is(here, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.StringIO("\n1 m\n1000\n\n0\n\n"))
    assert main(["calibrate", "wheels", "--ruler"]) == DONE
    assert "'1 m' is not a number. Write one such as 985" in capsys.readouterr().err


@pytest.mark.parametrize("answers", ["", "\n", "\n1000\n\n"])
def test_a_ruler_whose_answers_end_is_an_error(here, monkeypatch, refused, answers):
    monkeypatch.setattr("sys.stdin", io.StringIO(answers))
    assert "the input ended" in refused("calibrate", "wheels", "--ruler")
    assert not (here / "robot.toml").exists()


def test_a_file_with_comments_of_your_own_is_kept_beside_the_new_one(here, monkeypatch, capsys):
    mine = "# Ada, with the small tyres\n[robot]\nradius_mm = 140.0    # with the bumper\n"
    (here / "robot.toml").write_text(mine)
    for _ in range(2):  # the second time the file is one that the command wrote
        monkeypatch.setattr("sys.stdin", io.StringIO("\n1000\n\n0\n\n"))
        assert main(["calibrate", "wheels", "--ruler"]) == DONE
        assert (here / "robot.toml.bak").read_text() == mine
    assert "before is robot.toml.previous" in capsys.readouterr().out
    assert load_robot_file(here / "robot.toml").robot.radius_mm == 140.0


def test_a_calibration_can_be_undone(here, monkeypatch):
    written = []
    for driven_mm in (1000, 1050, 1020):
        monkeypatch.setattr("sys.stdin", io.StringIO(f"\n{driven_mm}\n\n0\n\n"))
        assert main(["calibrate", "wheels", "--ruler"]) == DONE
        written.append((here / "robot.toml").read_text())
    assert written[1] != written[0]
    assert (here / "robot.toml.previous").read_text() == written[1]


@pytest.mark.parametrize("what", [[], ["camera"], ["wheels", "motors"]])
def test_a_ruler_measures_wheels_alone(what):
    assert main(["calibrate", *what, "--ruler"]) == USAGE


@pytest.mark.slow
def test_a_simulated_robot_calibrates_itself(here, answered):
    (here / "robot.toml").write_text(
        "[robot]\nradius_mm = 140.0\nwheel_diameter_mm = 60.0\n[camera]\nhfov_deg = 66.0\n"
    )
    said = answered("calibrate")
    before_px, after_px = said["misfit_px"]
    assert after_px < 1 < before_px
    assert 0 < said["values"]["sonar.noise_mm"] < 20
    file = load_robot_file(here / "robot.toml")
    assert file.robot.radius_mm == 140.0
    assert file.robot.wheel_diameter_mm == pytest.approx(56.0, rel=0.01)
    assert file.robot.axle_track_mm == pytest.approx(112.0, rel=0.01)
    assert file.robot.sonar_forward_mm == pytest.approx(100.0, abs=10)
    assert file.robot.sonar_cone_deg == pytest.approx(30.0, abs=8)
    assert file.camera.hfov_deg == pytest.approx(60.0, rel=0.02)
    assert file.camera.forward_mm == pytest.approx(60.0, abs=10)
    assert (file.camera.tilt_deg, file.camera.roll_deg) == pytest.approx((0, 0), abs=1)
    assert not file.robot.left_reversed | file.robot.right_reversed
    assert file.calibration.missing == []
    assert file.calibration.camera.standard_uncertainty["hfov_deg"] < 0.5
    again_px, _ = answered("calibrate")["misfit_px"]
    assert again_px == pytest.approx(after_px, abs=1)  # the same file in another drive, measured in the same way


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size_mm", "code", "said"),
    [
        ("[279, 197]", DONE, "Check the sheet: the sonar measures 94% of the distances that follow from its size."),
        ("[240, 170]", NOT_ACHIEVED, "the sheet has another size: the sonar measures 81% of the distances"),
    ],
)
def test_a_sheet_that_was_printed_smaller_is_doubted_or_refused(here, capsys, size_mm, code, said):
    text = (WORLDS / "calibration.toml").read_text()
    (here / "world.toml").write_text(text.replace("[297, 210]", size_mm))
    assert main(["calibrate", "wheels", "sonar", "--nxt", "sim://world.toml"]) == code
    assert said in "".join(capsys.readouterr())
    assert (here / "robot.toml").exists() == (code == DONE)


FAULT = """
[[events]]
name = "the plug comes loose"
when = { at_s = 0 }
sensor = 4
fault = "unplugged"
"""


@pytest.mark.nightly
@pytest.mark.parametrize(("what", "code"), [(["sonar"], NOT_ACHIEVED), (["camera", "sonar"], DONE)])
def test_a_sonar_that_does_not_answer_is_left_out(here, capsys, what, code):
    (here / "world.toml").write_text((WORLDS / "calibration.toml").read_text() + FAULT)
    assert main(["calibrate", *what, "--nxt", "sim://world.toml"]) == code
    said = capsys.readouterr()
    assert "the sonar gave 0 echoes with the wall straight ahead" in (said.err if code else said.out)
    if code == DONE:
        assert load_robot_file(here / "robot.toml").calibration.missing == ["wheels", "sonar", "motors"]
    else:
        assert not (here / "robot.toml").exists()


def test_a_robot_without_a_sonar_is_not_driven_to_calibrate_it(here, capsys):
    (here / "robot.toml").write_text("[robot]\nultrasonic = 0\n")
    assert main(["calibrate", "sonar"]) == NOT_ACHIEVED
    said = capsys.readouterr()
    assert "ultrasonic is 0" in said.err
    assert not said.out


@pytest.mark.slow
def test_a_robot_without_bumper_whose_sonar_does_not_answer_does_not_drive(here, capsys):
    (here / "robot.toml").write_text("[robot]\ntouch = 0\n")
    (here / "world.toml").write_text((WORLDS / "calibration.toml").read_text() + FAULT)
    assert main(["calibrate", "camera", "--nxt", "sim://world.toml"]) == NOT_ACHIEVED
    assert "cannot notice obstacles" in capsys.readouterr().err


COLOR = '[mission]\ntargets = ["box"]\n[target.box]\ndetector = "color"\ncolor = "green"\n'


def test_a_colour_is_learned_and_used(here, printed, answered):
    (here / "m.toml").write_text(COLOR)
    assert "100% now" in answered("calibrate", "colors")["remark"]
    shade = load_robot_file(here / "robot.toml").color["green"]
    assert shade.hue_deg == pytest.approx(127, abs=8)
    assert re.search(rf"hue_deg +{shade.hue_deg:g}\b", printed("mission", "show", "m.toml", "--robot", "robot.toml"))


def test_the_name_of_the_robot_file_can_be_pasted_into_a_command(printed):
    said = " ".join(printed("calibrate", "colors", "--robot", "my robot.toml").split())
    assert "with --robot 'my robot.toml', or with NXT_ROBOT='my robot.toml' in" in said


@pytest.mark.parametrize("name", ["my robot.toml", "robot.toml"])
def test_the_doctor_names_the_file_to_complete(here, capsys, name):
    (here / name).write_text("[robot]\n")
    main(["doctor", "--nxt", "sim://", "--robot", name, "--json"])
    (found,) = (each for each in json.loads(capsys.readouterr().out)["findings"] if each["topic"] == "calibration")
    assert found["remedy"].endswith(" --robot 'my robot.toml'") == (name != "robot.toml")


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["colors", "--color", "red"], NOT_ACHIEVED, "not red"),
        (["colors", "--color", "mauve"], USAGE, "no colour 'mauve'"),
        (["colors", "wheels"], USAGE, "alone"),
        (["camera", "--color", "red"], USAGE, "alone"),
    ],
)
def test_a_colour_that_cannot_be_is_refused(here, capsys, words, code, said):
    assert main(["calibrate", *words]) == code
    assert said in capsys.readouterr().err
    assert not (here / "robot.toml").exists()


def test_the_doctor_says_how_to_use_a_robot_file_that_is_here(here, capsys):
    (here / "robot.toml").write_text("[robot]\n")
    main(["doctor", "--nxt", "sim://", "--json"])
    (found,) = (each for each in json.loads(capsys.readouterr().out)["findings"] if each["topic"] == "calibration")
    assert found["verdict"] == "warning"
    assert "missions do not use it" in found["text"]
    assert "--robot robot.toml" in found["remedy"]
    assert "NXT_ROBOT=robot.toml" in found["remedy"]
