"""``nxtdrive mission new``: a mission and a room in which it succeeds."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

import nxtdrive
from behaviors.mission import load_mission
from behaviors.mission.targets import PictureTarget
from nxtdrive.cli.main import DONE, USAGE, main
from nxtdrive.cli.templates.target import plain_name
from nxtdrive.mission.detectors import build_detectors
from nxtdrive.mission.files import read_mission_file
from nxtdrive.tools.dev.onnx_models import red_model
from nxtdrive.vision.geometry import Pinhole
from sim_backend.bundled import PICTURES
from sim_backend.simulation import Simulation
from sim_backend.world.loading import load_world

LENS_FORWARD_MM = 60.0


pytestmark = pytest.mark.usefixtures("here")


def _shapes(height: int, width: int, seed: int) -> np.ndarray:
    """Coloured circles, boxes and lines on a gradient."""
    rng = np.random.default_rng(seed)
    image = np.empty((height, width, 3), np.uint8)
    image[:] = rng.integers(120, 230, 3)
    image[..., 0] = np.linspace(60, 200, width)[None, :]
    size = min(height, width)
    for _ in range(14):
        at = int(rng.integers(0, width)), int(rng.integers(0, height))
        color = tuple(int(each) for each in rng.integers(0, 256, 3))
        radius = max(3, int(size * rng.uniform(0.05, 0.2)))
        if rng.random() < 0.5:
            cv2.circle(image, at, radius, color, -1)
        else:
            cv2.rectangle(image, at, (at[0] + radius, at[1] + 2 * radius), color, -1)
    return image


def _blobs(height: int, width: int, seed: int) -> np.ndarray:
    """Soft stains, as in a photograph that is out of focus."""
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, 256, (7, 7, 3)).astype(np.uint8)
    return cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)


def _text(height: int, width: int, seed: int) -> np.ndarray:
    """A poster with large letters."""
    image = np.full((height, width, 3), (235, 240, 245), np.uint8)
    for row, word in enumerate(("NXT", "Cat", "42!")):
        at = round(0.05 * width), round((0.3 + 0.3 * row) * height)
        cv2.putText(image, word, at, cv2.FONT_HERSHEY_DUPLEX, width / 90, (30, 20 + 60 * row, 160), max(2, width // 40))
    cv2.circle(image, (round(0.8 * width), round(0.8 * height)), round(0.12 * width), (40, 120, 30 + seed), -1)
    return image


def _gray(height: int, width: int, seed: int) -> np.ndarray:
    return cv2.cvtColor(_shapes(height, width, seed), cv2.COLOR_BGR2GRAY)


def _alpha(height: int, width: int, seed: int) -> np.ndarray:
    image = cv2.cvtColor(_shapes(height, width, seed), cv2.COLOR_BGR2BGRA)
    image[: height // 4, : width // 4, 3] = 0
    return image


PHOTOGRAPHS = {
    "portrait.jpg": (_shapes, 800, 600, 297),
    "landscape.jpg": (_shapes, 600, 800, 210),
    "square.png": (_shapes, 500, 500, 200),
    "huge.jpg": (_shapes, 3000, 2200, 420),
    "tiny.png": (_shapes, 84, 60, 297),
    "gray.png": (_gray, 640, 480, 297),
    "alpha.png": (_alpha, 640, 480, 297),
    "soft.jpg": (_blobs, 900, 700, 297),
    "poster.png": (_text, 700, 500, 420),
    "wide.jpg": (_shapes, 400, 1000, 210),
    "narrow.jpg": (_shapes, 1000, 400, 400),
    "postcard.jpg": (_blobs, 500, 740, 105),
    "A6 Größe (1).png": (_shapes, 740, 525, 148),
    "door.jpg": (_blobs, 900, 450, 900),
}


def _save(name: str, *, at: Path = Path()) -> Path:
    draw, height, width, _ = PHOTOGRAPHS[name]
    path = at / name
    assert cv2.imwrite(str(path), draw(height, width, seed=sorted(PHOTOGRAPHS).index(name)))
    return path


def _find_in_the_room_as_written() -> None:
    """Place the target of the mission's file in the frames of the world's, from the start and from the arrival."""
    mission = read_mission_file(Path("m.toml"))
    ((name, detector),) = build_detectors(mission).items()
    simulation = Simulation(load_world("m-world.toml"))
    start, away_mm = simulation.truth.pose, simulation.truth.distance_mm(name)
    for driven_mm in (0.0, away_mm - LENS_FORWARD_MM - mission.adaptive.arrive_mm):
        simulation.world.place_robot((start.x_mm + driven_mm, start.y_mm), 0.0)
        simulation.advance(1000)
        image = simulation.webcam.frame()
        pinhole = Pinhole.from_hfov(image.shape[1], simulation.webcam.hfov_deg)
        _, distance_mm = pinhole.locate(detector.detector.detect(image)[0], detector.height_mm)
        assert distance_mm == pytest.approx(away_mm - driven_mm - LENS_FORWARD_MM, rel=0.2)


PURSUED = ("A6 Größe (1).png", "alpha.png", "door.jpg", "narrow.jpg", "poster.png", "postcard.jpg", "wide.jpg")
"""Those that a mission is run with: each shape, the smallest and the largest target, letters, stains, and what is
transparent."""

PURSUED_AT_NIGHT = {"alpha.png", "door.jpg", "narrow.jpg", "postcard.jpg", "poster.png", "wide.jpg"}
BY_NIGHT_OR_DAY = [
    pytest.param(name, marks=pytest.mark.nightly) if name in PURSUED_AT_NIGHT else name for name in sorted(PHOTOGRAPHS)
]


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_NIGHT_OR_DAY)
def test_a_photograph_becomes_a_mission_that_succeeds_in_its_room(name, capsys, printed):
    height_mm = PHOTOGRAPHS[name][3]
    assert main(["mission", "new", "m.toml", "--picture", str(_save(name)), "--height-mm", str(height_mm)]) == DONE
    assert "Try it there:\n  nxtdrive run m.toml\n" in capsys.readouterr().out
    assert printed("mission", "check", "m.toml") == "m.toml: good\n"
    if name in PURSUED:
        assert nxtdrive.run_mission("m.toml", nxt="sim://m-world.toml?seed=0").achieved
    else:
        _find_in_the_room_as_written()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "name"),
    [
        (["--marker", "7"], "marker-7"),
        (["--marker", "49", "--height-mm", "80"], "marker-49"),
        (["--qr", "7"], "qr-7"),
        (["--qr", "Küche im 1. Stock", "--height-mm", "200"], "qr-Kuche-im-1-Stock"),
    ],
)
def test_a_sheet_to_print_becomes_a_mission_that_succeeds_in_its_room(options, name, printed):
    assert f"Print {name}.png at 100 %" in printed("mission", "new", *options)
    assert printed("mission", "check", f"{name}.toml") == f"{name}.toml: good\n"
    report = nxtdrive.run_mission(f"{name}.toml", nxt=f"sim://{name}-world.toml?seed=0")
    assert report.achieved
    assert report.duration_s < 20.0  # it looks round where it was put


@pytest.mark.parametrize("text", ["the sheet that says {}", "https://school.example/rooms/second-floor/{}"])
def test_sheets_with_long_texts_have_different_names(text):
    assert main(["mission", "new", "--qr", text.format(7)]) == DONE
    assert main(["mission", "new", "--qr", text.format(8)]) == DONE
    assert len(list(Path().glob("*.png"))) == 2


@pytest.mark.parametrize("text", ["go to \N{GRINNING FACE}", "кухня", 'a "quote" \\', "a\x7fb"])
def test_every_text_of_a_code_can_be_read_again(text):
    assert main(["mission", "new", "--qr", text, "m.toml"]) == DONE
    (target,) = read_mission_file(Path("m.toml")).target.values()
    assert target.text == text


def test_a_sheet_that_is_there_already_is_not_reported_to_need_another_file_name(capsys):
    assert main(["mission", "new", "--qr", "кухня", "kitchen.toml"]) == DONE
    assert main(["mission", "new", "--qr", "ванная", "bathroom.toml"]) == USAGE
    assert "qr-code.png exists already. It is named after the text" in capsys.readouterr().err


@pytest.mark.parametrize(("options", "modules", "around"), [(["--marker", "7"], 6, 1), (["--qr", "7"], 21, 3)])
def test_a_sheet_prints_at_its_true_size(options, modules, around):
    assert main(["mission", "new", "m.toml", *options, "--height-mm", "120"]) == DONE
    [sheet] = Path().glob("*.png")
    with Image.open(sheet) as image:
        width_mm = image.width / image.info["dpi"][0] * 25.4
    assert width_mm == pytest.approx(120 * (modules + 2 * around) / modules, rel=1e-3)
    assert load_world("m-world.toml").pictures[0].size_mm[0] == pytest.approx(width_mm, rel=1e-3)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--marker", "7", "--height-mm", "20"], "Print it larger"),
        (["--qr", "x" * 400], "shorter text"),
        (["--qr", ""], "1 to 500"),
        (["--marker", "7", "--height-mm", "3000"], "Print it smaller"),
    ],
)
def test_a_sheet_that_cannot_be_found_is_refused_and_nothing_is_written(options, expected, refused):
    assert expected in refused("mission", "new", *options)
    assert not list(Path().iterdir())


def test_a_sheet_of_ours_is_not_overwritten_unasked(refused):
    Path("marker-7.png").write_bytes(b"mine")
    assert "marker-7.png exists already" in refused("mission", "new", "m.toml", "--marker", "7")
    assert Path("marker-7.png").read_bytes() == b"mine"


def test_missions_that_search_for_the_same_marker_share_its_sheet(capsys):
    assert main(["mission", "new", "first.toml", "--marker", "7"]) == DONE
    assert main(["mission", "new", "second.toml", "--marker", "7"]) == DONE
    assert main(["mission", "new", "larger.toml", "--marker", "7", "--height-mm", "200"]) == USAGE
    assert "marker-7.png exists already" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 3, 5, 11])
def test_the_red_box_stands_in_its_room_and_is_reached_though_the_frame_cuts_it_off(seed):
    assert main(["mission", "new"]) == DONE
    assert nxtdrive.run_mission("my-mission.toml", nxt=f"sim://my-mission-world.toml?seed={seed}").achieved


@pytest.mark.nightly
@pytest.mark.parametrize("label", ["chair"])
def test_what_a_network_finds_is_reached_without_its_height(label):
    """The box is 100 mm high, a chair is taken for 850 mm at first."""
    assert main(["mission", "new"]) == DONE
    Path("red.onnx").write_bytes(red_model({"labels": label}))
    text = Path("my-mission.toml").read_text(encoding="utf-8")
    told = f'[target.box]\ndetector = "onnx"\nmodel = "red.onnx"\nlabel = "{label}"\n\n# Other kinds'
    Path("m.toml").write_text(re.sub(r"\[target\.box\].*?# Other kinds", told, text, flags=re.DOTALL), encoding="utf-8")
    (arrival,) = nxtdrive.run_mission("m.toml", nxt="sim://my-mission-world.toml?seed=1").arrivals
    assert arrival["there"]


def test_a_picture_elsewhere_is_named_by_its_path(tmp_path):
    folder = tmp_path / "pictures of cats"
    folder.mkdir()
    _save("portrait.jpg", at=folder)
    (tmp_path / "missions").mkdir()
    picture = "pictures of cats/portrait.jpg"
    assert main(["mission", "new", "missions/m.toml", "--picture", picture, "--height-mm", "297"]) == DONE
    target = load_mission(Path("missions/m.toml")).target["portrait"]
    assert isinstance(target, PictureTarget)
    assert target.pictures == [str(folder / "portrait.jpg")]
    [picture] = load_world("missions/m-world.toml").pictures
    assert picture.file == folder / "portrait.jpg"


@pytest.mark.slow
def test_the_files_are_called_like_the_picture_and_never_overwritten_unasked(refused):
    command = ["mission", "new", "--picture", str(_save("portrait.jpg")), "--height-mm", "297"]
    assert main(command) == DONE
    Path("portrait-world.toml").write_text("mine", encoding="utf-8")
    Path("portrait.toml").unlink()
    assert "portrait-world.toml exists already" in refused(*command)
    assert not Path("portrait.toml").exists()
    assert main([*command, "--force"]) == DONE
    assert load_world("portrait-world.toml").pictures[0].name == "portrait"


def test_without_a_height_it_says_what_is_needed(refused):
    error = refused("mission", "new", "--picture", _save("landscape.jpg"))
    assert "--height-mm" in error
    assert "A4 landscape is 210" in error


@pytest.mark.parametrize(
    ("image", "height_mm", "expected"),
    [
        (np.full((400, 300, 3), 128, np.uint8), "297", "single colour. Use a picture with more detail"),
        (np.tile(np.linspace(90, 150, 300, dtype=np.uint8), (400, 1)), "297", "detector"),
        (_shapes(30, 30, 1), "297", "only 30x30 pixels"),
        (_shapes(400, 300, 1) // 16, "200", "it has little contrast from afar"),
        (np.repeat(np.tile([0, 0, 0, 255, 255, 255], 50)[None], 400, axis=0), "200", "its details are small"),
        (_shapes(400, 300, 1), "12", "does not find it"),
        (_shapes(400, 300, 1), "29.7", "A height in centimetres? 29.7 cm are 297 mm."),
        (_shapes(400, 300, 1), "2900", "too large"),
    ],
    ids=["plain", "gradient", "few pixels", "dark", "stripes", "a stamp", "centimetres", "a facade"],
)
def test_a_picture_that_cannot_be_found_is_refused_with_what_to_do(image, height_mm, expected, refused):
    cv2.imwrite("p.png", image)
    error = refused("mission", "new", "--picture", "p.png", "--height-mm", height_mm)
    assert expected in error
    assert error.count("larger") <= 1
    assert error.startswith("nxtdrive: p.png")
    assert not list(Path().glob("*.toml"))


def test_the_size_that_follows_from_the_whole_photograph_is_said(capsys):
    cv2.imwrite("kitchen.jpg", cv2.resize(cv2.imread(str(PICTURES / "lena.png")), (400, 300)))
    with pytest.raises(SystemExit):
        main(["mission", "new", "--picture", "kitchen.jpg", "--height-mm", "30cm"])
    assert "height in mm must be a number from 10 to 3000, not '30cm'" in capsys.readouterr().err
    assert main(["mission", "new", "--picture", "kitchen.jpg", "--height-mm", "300"]) == DONE
    assert "400 mm wide and 300 mm high: crop it" in capsys.readouterr().out


def test_anything_that_is_not_a_picture_is_refused(refused):
    Path("cat.jpg").write_text("meow", encoding="utf-8")
    assert "not an image" in refused("mission", "new", "--picture", "cat.jpg", "--height-mm", "297")
    assert main(["mission", "new", "--height-mm", "297"]) == USAGE


@pytest.mark.slow
@pytest.mark.parametrize(("answer", "written"), [("297", True), ("twelve", False), ("3", False)])
def test_in_a_terminal_it_asks_for_the_height(answer, written):
    keyboard, terminal = pty.openpty()
    command = [sys.executable, "-m", "nxtdrive", "mission", "new", "--picture", str(_save("portrait.jpg"))]
    with subprocess.Popen(command, stdin=terminal, stdout=terminal, stderr=subprocess.PIPE, text=True) as process:
        os.write(keyboard, f"{answer}\n".encode())
        _, error = process.communicate(timeout=60)
    os.close(keyboard)
    os.close(terminal)
    assert process.returncode == (DONE if written else USAGE)
    assert Path("portrait.toml").exists() is written
    assert written or f"height in mm must be a number from 10 to 3000, not '{answer}'" in error


@pytest.mark.parametrize("command", ["mission", "world"])
@pytest.mark.parametrize(
    "name", ["", ".", "/", "why?.toml", "two\nlines.toml", "not-utf8-\udcff.toml", "-dash.toml", "in\x7f/my.toml"]
)
def test_a_name_that_cannot_be_typed_as_an_address_is_refused(command, name, refused):
    assert "letters" in refused(command, "new", "--", name)
    assert not list(Path().iterdir())


@pytest.mark.parametrize("command", ["mission", "world"])
@pytest.mark.parametrize("name", ["my-cat.jpg", "IMG_2041.JPG", "sub/photo.heic"])
def test_a_picture_is_not_the_file_to_write_even_when_forced(command, name, refused):
    Path("sub").mkdir()
    Path(name).write_bytes(b"photograph")
    assert f"`nxtdrive mission new --picture {name} --height-mm MM`" in refused(command, "new", name, "--force")
    assert Path(name).read_bytes() == b"photograph"


@pytest.mark.parametrize("option", ["--picture", "--marker", "--qr"])
def test_a_second_target_is_refused(option, refused):
    assert "a new mission has one target" in refused("mission", "new", option, "1", option, "2")


@pytest.mark.parametrize("mission", ["{}", "sub/../{}", "link"])
@pytest.mark.parametrize("stem", ["photo", "photo-world"])
def test_the_photograph_is_not_overwritten_even_when_forced(mission, stem, refused):
    """The room of photo.toml is called photo-world.toml, whatever the mission's suffix is."""
    name = "photo" if stem == "photo" else "photo-world.toml"
    image = cv2.imencode(".png", _shapes(400, 300, 1))[1].tobytes()
    Path(name).write_bytes(image)
    Path("sub").mkdir()
    Path("link").symlink_to(name)
    command = ["mission", "new", "--picture", name, "--height-mm", "297", mission.format("photo"), "--force"]
    assert "is the photograph" in refused(*command)
    assert Path(name).read_bytes() == image


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("großer Hund ü.png", "grosser-Hund-u"),
        ("Cafe\u0301 Ångström.png", "Cafe-Angstrom"),
        ("猫.png", "picture"),
        ("a.b (1).png", "a-b-1"),
    ],
)
def test_a_target_has_its_pictures_name_in_plain_letters(file, name):
    assert plain_name(Path(file).stem, "picture") == name


def test_a_picture_whose_name_no_toml_file_can_hold_is_refused(refused):
    path = Path("cat\udcff.png")
    path.write_bytes(cv2.imencode(".png", _shapes(400, 300, 1))[1].tobytes())
    assert "Rename it" in refused("mission", "new", "--picture", path, "--height-mm", "200")


def test_control_characters_in_a_pictures_name_are_escaped(capsys):
    path = Path("cat\x7f\t.png")
    path.write_bytes(cv2.imencode(".png", _shapes(400, 300, 1))[1].tobytes())
    assert main(["mission", "new", "--picture", str(path), "--height-mm", "200"]) == DONE
    assert load_mission(Path("cat.toml")).target["cat"].pictures == [str(path.resolve())]
    load_world("cat-world.toml")


@pytest.mark.parametrize(
    ("nxt", "opened"),
    [
        ("sim://", "sim://my-mission-world.toml"),
        ("sim://?seed=3", "sim://my-mission-world.toml?seed=3"),
        ("sim://empty", "sim://empty"),
    ],
)
def test_a_simulated_robot_stands_in_the_missions_own_room_unless_another_is_named(nxt, opened, capsys):
    assert main(["mission", "new"]) == DONE
    text = Path("my-mission.toml").read_text(encoding="utf-8").replace("# time_limit_s = 600", "time_limit_s = 1")
    Path("my-mission.toml").write_text(text, encoding="utf-8")
    main(["run", "my-mission.toml", "--nxt", nxt, "--camera", "geometric", "--no-video"])
    assert f"connecting to {opened}\n" in capsys.readouterr().out
