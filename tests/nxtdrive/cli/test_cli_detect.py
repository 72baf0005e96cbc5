"""``nxtdrive detect``: from a source to boxes, bearings and a file."""

import os
import re
import shutil
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.commands.detect import FoundTarget, _place
from nxtdrive.cli.main import DONE, USAGE, main
from nxtdrive.tools.dev.onnx_models import constant_model, outputs_of, red_model
from nxtdrive.vision.detectors.onnx_runtimes import load
from sim_backend.bundled import PICTURES
from tests.small_mission import MISSION

HEIGHT_PX, SIZE = 60, (320, 240)
RED = (0, 0, 220)


def _scene(centre_u):
    """A red square `HEIGHT_PX` high on gray."""
    image = np.full((SIZE[1], SIZE[0], 3), 120, np.uint8)
    left, top = centre_u - HEIGHT_PX // 2, 90
    cv2.rectangle(image, (left, top), (left + HEIGHT_PX - 1, top + HEIGHT_PX - 1), RED, -1)
    return image


@pytest.fixture
def picture(tmp_path):
    path = tmp_path / "scene.png"
    cv2.imwrite(str(path), _scene(240))
    return path


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    for i, centre in enumerate((80, 160, 240)):
        cv2.imwrite(str(folder / f"{i}.png"), _scene(centre))
    cv2.imwrite(str(folder / "3.png"), np.full((120, 160, 3), 120, np.uint8))
    return folder


def test_the_simulated_robot_is_in_the_missions_own_room(tmp_path, answered):
    mission = tmp_path / "small.toml"
    mission.write_text(MISSION, encoding="utf-8")
    room = "[floor]\nsize_mm = [2000, 2000]\n[robot]\nstart_mm = [500, 1000]\n"
    room += '[[pictures]]\nname = "lena"\nat_mm = [1500, 1000]\nfacing_deg = 180\n'
    (tmp_path / "small-world.toml").write_text(room, encoding="utf-8")
    result = answered(
        "detect", "try", "sim", "--mission", mission, "--target", "lena", "--frames", 1, "--out", tmp_path / "seen.png"
    )
    assert result["looks"][0]["found"][0]["distance_mm"] == pytest.approx(940, rel=0.05)  # the lens is 60 mm ahead


def test_a_picture_gives_bearing_distance_and_a_drawing(picture, tmp_path, answered):
    out = tmp_path / "seen.png"
    result = answered("detect", "try", picture, "--color", "red", "--height-mm", 100, "--hfov-deg", 60, "--out", out)
    assert (result["frames"], result["seen"], result["out"]) == (1, 1, str(out))
    found = result["looks"][0]["found"][0]
    focal_px = 160 / np.tan(np.radians(30))
    bearing = np.arctan2(80, focal_px)
    assert found["bearing_deg"] == pytest.approx(np.degrees(bearing), abs=0.5)
    assert found["distance_mm"] == pytest.approx(focal_px * 100 / HEIGHT_PX / np.cos(bearing), rel=0.05)
    assert not np.array_equal(cv2.imread(str(out)), cv2.imread(str(picture)))


@pytest.mark.parametrize("named", ["--robot", "NXT_ROBOT", "--mission"])
def test_the_camera_and_the_colours_of_the_robot_file_count(picture, tmp_path, monkeypatch, answered, named):
    robot = tmp_path / "robot.toml"
    shade = "hue_deg = 90.0\nreach_deg = 10.0\nmin_saturation_percent = 40.0\nmin_value_percent = 20.0\n"
    robot.write_text(f"[camera]\nhfov_deg = 30.0\nyaw_deg = 5.0\n[color.green]\n{shade}", encoding="utf-8")
    image = _scene(240)
    image[image[:, :, 2] > 200] = (0, 220, 110)
    cv2.imwrite(str(picture), image)
    words = ["--color", "green", "--height-mm", 100]
    if named == "--robot":
        words += ["--robot", robot]
    elif named == "NXT_ROBOT":
        monkeypatch.setenv("NXT_ROBOT", str(robot))
    else:
        target = '[mission]\ntargets = ["a"]\nrobot_file = "robot.toml"\n[target.a]\n'
        (tmp_path / "own.toml").write_text(f'{target}detector = "color"\ncolor = "green"\n', encoding="utf-8")
        words = ["--mission", tmp_path / "own.toml", "--target", "a", "--height-mm", 100]
    found = answered("detect", "try", picture, *words, "--out", tmp_path / "seen.png")["looks"][0]["found"][0]
    focal_px = 160 / np.tan(np.radians(15))
    bearing = np.arctan2(80, focal_px)
    assert found["bearing_deg"] == pytest.approx(np.degrees(bearing) + 5.0, abs=0.3)
    assert found["distance_mm"] == pytest.approx(focal_px * 100 / HEIGHT_PX / np.cos(bearing), rel=0.05)


def test_an_angle_on_the_command_line_replaces_the_robot_files(picture, tmp_path, answered):
    (tmp_path / "robot.toml").write_text("[camera]\nhfov_deg = 30.0\n", encoding="utf-8")
    words = [picture, "--color", "red", "--height-mm", 100, "--out", tmp_path / "seen.png", "--hfov-deg", 60]
    assert (
        answered("detect", "try", *words, "--robot", tmp_path / "robot.toml")["looks"][0]["found"]
        == (answered("detect", "try", *words)["looks"][0]["found"])
    )


def test_a_picture_that_cannot_be_written_is_refused_before_the_detector_runs(folder, tmp_path, capsys):
    out = tmp_path / "nowhere" / "seen.png"
    assert main(["detect", "try", str(folder), "--color", "red", "--out", str(out)]) == USAGE
    captured = capsys.readouterr()
    assert f"{out} cannot be written" in captured.err
    assert "frame" not in captured.out


def test_the_photograph_of_a_missions_target_is_not_replaced(folder, tmp_path, refused):
    photograph = tmp_path / "lena.png"
    photograph.write_bytes((PICTURES / "lena.png").read_bytes())
    before = photograph.read_bytes()
    mission = tmp_path / "mission.toml"
    target = '[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\nheight_mm = 297\n'
    mission.write_text(f'[mission]\nname = "lena"\ntargets = ["lena"]\n\n{target}')
    words = ["--mission", str(mission), "--target", "lena", "--out", str(photograph)]
    assert "the command reads it" in refused("detect", "try", folder, *words)
    assert photograph.read_bytes() == before


def test_a_video_that_cannot_be_written_is_called_that(folder, tmp_path, refused):
    out = tmp_path / "nowhere" / "seen.webm"
    assert f"{out}: the video cannot be written." in refused("detect", "try", folder, "--color", "red", "--out", out)


def test_a_drawing_never_replaces_a_picture_of_the_folder_that_is_read(folder, refused):
    image = min(folder.iterdir())
    before = image.read_bytes()
    assert "the command reads it" in refused("detect", "try", folder, "--color", "red", "--out", image)
    assert image.read_bytes() == before


@pytest.mark.parametrize("words", [["--out", "scene.png"], ["--picture", "detected.png"]])
def test_a_drawing_never_replaces_a_picture_that_is_read(picture, words, here, refused):
    photograph = picture if words[0] == "--out" else picture.replace(here / "detected.png")
    before = photograph.read_bytes()
    target = ["--color", "red"] if words[0] == "--out" else []
    assert "the command reads it" in refused("detect", "try", photograph.name, *target, *words)
    assert photograph.read_bytes() == before


@pytest.mark.parametrize("name", ["SEEN.PNG", "SEEN.WEBM"])
def test_the_ending_of_the_result_may_be_in_capitals(picture, tmp_path, name, answered):
    answered("detect", "try", picture, "--color", "red", "--out", tmp_path / name)
    assert [each.name for each in tmp_path.iterdir() if each != picture] == [name]


def test_bearings_are_positive_to_the_right(folder, tmp_path, answered):
    result = answered("detect", "try", folder, "--color", "red", "--out", tmp_path / "seen.webm")
    assert (result["frames"], result["seen"]) == (4, 3)
    left, middle, right = (look["found"][0]["bearing_deg"] for look in result["looks"][:3])
    assert left < -5 < middle < 5 < right
    assert result["looks"][3]["found"] == []


def test_a_folder_becomes_a_video_even_with_images_of_several_sizes(folder, tmp_path, answered):
    out = tmp_path / "seen.webm"
    answered("detect", "try", folder, "--color", "red", "--out", out)
    assert b"webm" in out.read_bytes()[:64]
    film = cv2.VideoCapture(str(out))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 4
    assert (film.get(cv2.CAP_PROP_FRAME_WIDTH), film.get(cv2.CAP_PROP_FRAME_HEIGHT)) == SIZE
    film.release()


def test_a_video_can_be_tried_and_limited(folder, tmp_path, answered):
    answered("detect", "try", folder, "--color", "red", "--out", tmp_path / "film.webm")
    result = answered(
        "detect", "try", tmp_path / "film.webm", "--color", "red", "--frames", 2, "--out", tmp_path / "again.png"
    )
    assert result["frames"] == 2


def test_the_result_has_a_place_of_its_own_by_default(picture, here, capsys):
    assert main(["detect", "try", str(picture), "--color", "red"]) == DONE
    assert (here / "detected.png").is_file()
    text = capsys.readouterr().out
    assert "red at +" in text
    assert "drawn into detected.png" in text


def test_nothing_seen_is_reported(picture, tmp_path, printed):
    assert "nothing" in printed("detect", "try", picture, "--marker", "7", "--out", tmp_path / "x.png")


@pytest.mark.parametrize(("kind", "read"), [("qr", "QR code '7'"), ("marker", "marker 7")])
def test_a_sheet_with_another_code_is_reported(here, printed, kind, read):
    assert main(["mission", "new", f"--{kind}", "7"]) == DONE
    assert f"read instead: {read}" in printed("detect", "try", f"{kind}-7.png", f"--{kind}", "8")


def test_an_april_tag_is_looked_for_by_its_family(tmp_path, refused, printed):
    tag = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36H11), 300, 200)
    sheet, out = tmp_path / "tag.png", str(tmp_path / "seen.png")
    cv2.imwrite(str(sheet), cv2.copyMakeBorder(tag, 60, 60, 60, 60, cv2.BORDER_CONSTANT, value=255))
    wanted = ["detect", "try", str(sheet), "--out", out, "--marker", "300"]
    assert "seen in 1 of 1 frame," in printed(*wanted, "--family", "apriltag_36h11")
    assert "aruco_4x4_50 has no marker 300" in refused(*wanted)


def test_a_family_needs_a_marker(picture, capsys):
    assert main(["detect", "try", str(picture), "--color", "red", "--family", "apriltag_36h11"]) == USAGE
    assert "--family needs --marker" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--label", "cup"),
        ("--labels", "labels.txt"),
        ("--layout", "yolo"),
        ("--size", "640"),
        ("--runtime", "opencv"),
        ("--colors", "bgr"),
        ("--normalisation", "unit"),
        ("--min-score", "0.5"),
    ],
)
def test_an_option_of_networks_is_not_ignored_without_one(option, value, picture, refused):
    assert f"{option} needs --onnx" in refused("detect", "try", picture, "--color", "red", option, value)


@pytest.mark.parametrize(("kind", "height_mm"), [("--marker", 150), ("--qr", 160)])
def test_a_sheet_has_the_height_at_which_nxtdrive_prints_it(kind, height_mm, here, capsys, printed):
    assert main(["mission", "new", kind, "7"]) == DONE
    (sheet,) = here.glob("*.png")
    assumed = printed("detect", "try", sheet.name, kind, "7")
    assert f"height: {height_mm} mm, as `nxtdrive mission new` prints it; measure yours" in assumed
    assert main(["detect", "try", sheet.name, kind, "7", "--height-mm", str(height_mm)]) == DONE
    assert re.findall(r"\d+ mm \(score", capsys.readouterr().out)[0] in assumed


def test_the_address_of_the_simulated_brick_is_its_camera(tmp_path, capsys):
    out = str(tmp_path / "seen.webm")
    assert main(["detect", "try", "sim://", "--color", "orange", "--frames", "1", "--out", out]) == DONE
    assert "seen in 1 of 1 frame," in capsys.readouterr().out


def test_an_assumed_height_is_reported(picture, tmp_path, capsys, printed):
    out = str(tmp_path / "seen.png")
    assert main(["detect", "try", str(picture), "--color", "red", "--out", out]) == DONE
    assert "height: 297 mm, that of an upright sheet of A4" in capsys.readouterr().out
    assert "height:" not in printed("detect", "try", picture, "--color", "red", "--out", out, "--height-mm", "100")


@pytest.mark.parametrize(
    ("cascade", "assumed"),
    [
        ("haarcascade_frontalface_alt2", "200 mm, as is usual for 'face'"),
        ("haarcascade_profileface", "200 mm, as is usual for 'face'"),
        ("haarcascade_fullbody", "1700 mm, as is usual for 'person'"),
        ("haarcascade_eye", "250 mm, a guess"),
        ("mine.xml", "250 mm, a guess"),
    ],
)
def test_what_a_cascade_finds_is_not_taken_for_a_sheet_of_a4(cascade, assumed, picture, here, printed):
    shutil.copy(Path(cv2.__file__).parent / "data" / "haarcascade_eye.xml", "mine.xml")
    words = ["detect", "try", str(picture), "--haar", cascade]
    assert f"height: {assumed}; measure yours and give --height-mm" in printed(*words)
    assert "height:" not in printed(*words, "--height-mm", "230")


def test_a_usual_height_of_a_networks_label_is_called_that(picture, network, tmp_path, answered):
    words = ["--onnx", network, "--label", "cup", "--out", tmp_path / "out.png"]
    assert answered("detect", "try", picture, *words)["detector"]["height"].startswith(
        "100 mm, as is usual for 'cup'; measure"
    )


def test_a_target_of_the_users_mission(picture, tmp_path, answered):
    mission = tmp_path / "m.toml"
    mission.write_text(
        '[mission]\ntargets = ["box"]\n[target.box]\ndetector = "color"\ncolor = "red"\nheight_mm = 100\n'
    )
    result = answered("detect", "try", picture, "--target", "box", "--mission", mission, "--out", tmp_path / "x.png")
    by_hand = answered("detect", "try", picture, "--color", "red", "--height-mm", 100, "--out", tmp_path / "x.png")
    assert result["looks"][0]["found"] == by_hand["looks"][0]["found"]


def test_the_built_in_targets(tmp_path, answered):
    from behaviors.mission.targets import PictureTarget
    from nxtdrive.mission.files import read_mission_file

    target = read_mission_file(None).target["lena"]
    assert isinstance(target, PictureTarget)
    result = answered("detect", "try", target.pictures[0], "--target", "lena", "--out", tmp_path / "x.png")
    assert result["seen"] == 1


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["nowhere.png", "--color", "red"], "no camera, file or folder"),
        (["SCENE", "--target", "nobody"], "lena"),
        (["SCENE", "--color", "mauve"], "magenta"),
        (["SCENE", "--color", "red", "--mission", "my.toml"], "--target"),
        (["SCENE", "--picture", "missing.jpg"], "missing.jpg"),
        (["SCENE", "--haar", "nonsense"], "nonsense"),
        (["SCENE", "--haar", ""], "there is no cascade ''"),
        (["SCENE", "--color", "red", "--out", "x.gif"], "webm"),
        (["SCENE", "--color", "red", "--out", "x.mp4"], "webm"),
    ],
)
def test_mistakes_are_one_sentence_that_helps(words, hint, picture, here, refused):
    assert hint in refused("detect", "try", *(str(picture) if word == "SCENE" else word for word in words))


def test_a_user_who_interrupts_still_gets_the_drawing(folder, tmp_path, monkeypatch, answered):
    decode = cv2.imdecode
    decoded = []

    def interrupted(*args):
        decoded.append(1)
        if len(decoded) > 2:
            raise KeyboardInterrupt
        return decode(*args)

    monkeypatch.setattr(cv2, "imdecode", interrupted)
    out = tmp_path / "seen.webm"
    result = answered("detect", "try", folder, "--color", "red", "--out", out)
    assert result["frames"] == 2
    assert [file.name for file in tmp_path.glob("seen*")] == [out.name]


@pytest.fixture
def network(tmp_path):
    (tmp_path / "cups.onnx").write_bytes(constant_model(outputs_of("yolo")))
    return tmp_path / "cups.onnx"


def test_a_network_finds_its_label_and_says_what_it_is(picture, tmp_path, printed):
    (tmp_path / "red.onnx").write_bytes(red_model({"names": "{0: 'box'}", "license": "CC0-1.0"}))
    words = ["detect", "try", str(picture), "--onnx", str(tmp_path / "red.onnx"), "--label", "box"]
    said = printed(*words, "--out", tmp_path / "out.png")
    for line in (
        "layout boxes, 320x240 pixels, onnxruntime",
        "labels: box",
        "licence: CC0-1.0",
        "height: 250 mm, a guess; measure yours",
    ):
        assert line in said
    assert "box at +16." in said
    assert " ms per frame" in said


def test_what_the_network_is_goes_into_json_too(picture, network, tmp_path, answered):
    told = answered(
        "detect", "try", picture, "--onnx", network, "--label", "cup", "--height-mm", 95, "--out", tmp_path / "out.png"
    )
    assert told["detector"]["labels"] == "bowl, cup, cat"
    assert "height:" not in told["detector"]
    assert told["seen"] == 1


def test_the_command_has_all_keys_of_a_network_in_a_mission(printed):
    from behaviors.mission.targets import OnnxTarget

    said = printed("detect", "try", "--help")
    keys = OnnxTarget.model_fields.keys() - {"detector", "model"}  # whose option is --onnx
    assert [key for key in keys if f"--{key.replace('_', '-')} " not in said] == []


def test_what_a_network_does_not_say_of_itself_can_be_given(picture, tmp_path, answered):
    (tmp_path / "open.onnx").write_bytes(constant_model(outputs_of("boxes"), shape=(1, 3, "height", "width")))
    words = ["--onnx", tmp_path / "open.onnx", "--label", "cup", "--out", tmp_path / "out.png"]
    plain = answered("detect", "try", picture, *words)
    assert "layout boxes, 416x416 pixels, onnxruntime" in plain["detector"]["model"]
    told = answered("detect", "try", picture, *words, "--layout", "detr-post", "--size", 64, "--runtime", "opencv")
    assert "layout detr-post, 64x64 pixels, OpenCV" in told["detector"]["model"]
    assert plain["seen"] == 1
    assert answered("detect", "try", picture, *words, "--min-score", 0.9)["seen"] == 0


def test_the_colours_that_a_network_gets_can_be_given(picture, tmp_path, answered):
    (tmp_path / "red.onnx").write_bytes(red_model())
    words = ["--onnx", tmp_path / "red.onnx", "--label", "box", "--out", tmp_path / "out.png"]
    assert answered("detect", "try", picture, *words, "--colors", "rgb", "--normalisation", "unit")["seen"] == 1
    assert answered("detect", "try", picture, *words, "--colors", "bgr")["seen"] == 0


@pytest.mark.parametrize(
    ("option", "value", "hint"),
    [
        ("--size", "100", "a multiple of 32"),
        ("--min-score", "1", "between 0 and 1"),
        ("--layout", "detr", "Set layout to one of"),
    ],
)
def test_a_wrong_option_of_a_network_names_the_right_ones(option, value, hint, picture, network, refused):
    assert hint in refused("detect", "try", picture, "--onnx", network, "--label", "cup", option, value)


@pytest.mark.parametrize("words", [[], ["--label", "mug"]])
def test_without_a_label_of_the_network_its_labels_are_listed(picture, network, refused, words):
    assert "bowl, cup, cat" in refused("detect", "try", picture, "--onnx", network, *words)


def test_mission_check_tries_the_network(network, refused):
    mission = network.with_name("m.toml")
    text = '[mission]\ntargets = ["mug"]\n[target.mug]\ndetector = "onnx"\nmodel = "cups.onnx"\n'
    mission.write_text(text + 'label = "mug"\n')
    assert "has no label 'mug'. It has: bowl, cup, cat" in refused("mission", "check", mission)
    mission.write_text(text + 'label = "cup"\n')
    assert main(["mission", "check", str(mission)]) == DONE
    assert main(["mission", "show", str(mission)]) == DONE


NO_UTF_8 = os.fsdecode(b"\xff")
"""At such names OpenCV crashes the whole program."""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such names")
@pytest.mark.parametrize(
    "words",
    [
        ["detect", "try", f"{NO_UTF_8}.avi", "--color", "red"],
        ["detect", "try", f"http://{NO_UTF_8}/", "--color", "red"],
        ["detect", "try", "scene.png", "--color", "red", "--out", f"{NO_UTF_8}.webm"],
        ["detect", "try", "scene.png", "--qr", NO_UTF_8],
        ["mission", "new", "--qr", NO_UTF_8],
    ],
)
def test_names_that_opencv_cannot_take_are_refused(picture, words, here, refused):
    (here / f"{NO_UTF_8}.avi").write_bytes(b"RIFF")
    assert "UTF-8" in refused(*words)


def test_no_image_format_has_a_suffix_that_is_not_in_utf_8(tmp_path, refused):
    assert "no image format ends in" in refused("screenshot", tmp_path / f"screen.{NO_UTF_8}", "--nxt", "sim://")


def test_a_model_that_opencv_cannot_name_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="UTF-8"):
        load(tmp_path / f"{NO_UTF_8}.onnx", "opencv")


def test_straight_ahead_has_one_spelling():
    assert _place(FoundTarget(-0.01, 184, 0.97, (0, 0, 9, 9), ())) == "+0.0 deg 184 mm (score 0.97)"
