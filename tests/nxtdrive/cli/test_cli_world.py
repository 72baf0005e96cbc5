"""``nxtdrive world``: rooms are written, checked and drawn; and the example of docs/worlds.md."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest

import nxtdrive
from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, USAGE, main
from nxtdrive.cli.views.room_drawing import NO_ECHO, room_page
from nxtdrive.drawing.floor_view import FloorView
from nxtdrive.drawing.page import draw_page, place_tags
from nxtdrive.drawing.sheet import Sheet
from sim_backend.bundled import PICTURES, WORLDS
from sim_backend.camera.textures import TextureLibrary
from sim_backend.world.loading import load_world, parse_world

PAGE = (Path(__file__).parents[3] / "docs" / "worlds.md").read_text(encoding="utf-8")
EXAMPLE, *FRAGMENTS = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)

SHORT = """
[mission]
name = "short"
targets = ["lena"]
time_limit_s = 1
[target.lena]
detector = "picture"
pictures = ["LENA"]
height_mm = 297
""".replace("LENA", (WORLDS.parent / "pictures" / "lena.png").as_posix())


pytestmark = pytest.mark.usefixtures("here")


def test_a_new_room_is_the_pages_example_and_good(printed):
    assert main(["world", "new", "room.toml"]) == DONE
    assert Path("room.toml").read_text(encoding="utf-8") == EXAMPLE
    assert "room.toml: good" in printed("world", "check", "room.toml")


@pytest.mark.nightly
def test_the_built_in_mission_succeeds_in_the_pages_example():
    Path("room.toml").write_text(EXAMPLE, encoding="utf-8")
    assert nxtdrive.run_mission(nxt="sim://room.toml").achieved


@pytest.mark.parametrize("fragment", FRAGMENTS, ids=lambda text: text.split()[0])
def test_the_pages_fragments_fit_into_its_example(fragment):
    parse_world(tomllib.loads(EXAMPLE + fragment), Path("example.toml"))


def test_all_tables_and_keys_are_listed_with_their_defaults(printed):
    said = printed("world", "keys")
    assert re.search(r"^\[\[boxes\]\]  A box on the floor", said, re.MULTILINE)
    assert re.search(r"^  absorbs +false +Whether it absorbs ultrasound", said, re.MULTILINE)
    assert re.search(r"^  at_mm +required +Centre\.", said, re.MULTILINE)
    assert re.search(r"^  left_port +\"B\" +Output port", said, re.MULTILINE)
    tables = re.findall(r"^\| `\[+([\w.]+)\]+` \|", PAGE, re.MULTILINE)
    assert set(tables) <= {re.sub(r"[\[\]]", "", each) for each in re.findall(r"^(\[\S+)", said, re.MULTILINE)}


def test_a_room_is_overwritten_only_with_force(refused):
    Path("room.toml").write_text("mine", encoding="utf-8")
    assert "room.toml exists already" in refused("world", "new", "room.toml")
    assert main(["world", "new", "room.toml", "--force"]) == DONE
    assert "room is the name of a bundled world. Write room.toml." in refused("world", "new", "room")
    assert Path("room.toml").read_text(encoding="utf-8") == EXAMPLE


def test_a_room_whose_name_is_too_long_is_refused_by_that_name(refused):
    name = 300 * "x"
    assert f"nxtdrive: {name} cannot be written" in refused("world", "new", name)


def test_every_bundled_room_is_good(printed):
    names = sorted(path.stem for path in WORLDS.glob("*.toml"))
    assert printed("world", "check", *names).split("\n")[:-1] == [f"{name}: good" for name in names]


def test_mistakes_of_several_files_are_listed_with_the_images_that_cannot_be_read(capsys, refused):
    text = EXAMPLE.replace("start_mm = [500, 1400]", "start_mm = [1700, 500]")
    Path("bad.toml").write_text(text, encoding="utf-8")
    Path("cat.jpg").write_text("no image", encoding="utf-8")
    Path("image.toml").write_text(EXAMPLE.replace('name = "lena"', 'name = "lena"\nfile = "cat.jpg"'), encoding="utf-8")
    assert main(["world", "check", "--json", "bad.toml", "nowhere", "image.toml", "open"]) == USAGE
    bad, nowhere, image, good = [each["mistakes"] for each in json.loads(capsys.readouterr().out)]
    assert bad[0].startswith("robot.start_mm: the robot stands in the box")
    assert nowhere[0].startswith("there is no world file nowhere")
    assert image == ["pictures[0].file: cat.jpg is not an image OpenCV can read. Use a PNG or JPEG file."]
    assert good == []
    assert refused("world", "check", "bad.toml").startswith("bad.toml: 1 mistake\n  robot.start_mm")


@pytest.mark.parametrize(
    ("key", "odd", "said"),
    [("size_mm", "[297, 210]", "is stretched"), ("centre_height_mm", "1500", "only from far away")],
)
def test_a_picture_that_is_stretched_or_hangs_too_high_is_warned_of(key, odd, said, printed):
    plain = EXAMPLE.replace("size_mm = [210, 297]", "")
    Path("odd.toml").write_text(plain.replace('name = "lena"', f'name = "lena"\n{key} = {odd}', 1), encoding="utf-8")
    good, warning = printed("world", "check", "odd.toml").splitlines()
    assert good == "odd.toml: good"
    assert warning.startswith(f"  warning: pictures[0].{key}: ")
    assert said in warning


CLOSED = """
[floor]
size_mm = [4000, 3000]
[robot]
start_mm = [500, 1500]
[[pictures]]
name = "lena"
at_mm = [3800, 1500]
facing_deg = 180
[[walls]]
from_mm = [2000, 0]
to_mm = [2000, 3000]
"""
FACES_THE_WALL = EXAMPLE.replace("facing_deg = 170 ", "facing_deg = 0 ").replace("at_mm = [3100,", "at_mm = [3560,")
CENTIMETRES = EXAMPLE.replace("size_mm = [210, 297]", "size_mm = [21, 29.7]")
METRES = EXAMPLE.replace("size_mm = [210, 297]", "size_mm = [0.21, 0.297]")
IN_THE_DESK = (
    EXAMPLE
    + """
[[boxes]]
name = "desk"
at_mm = [1200, 400]
size_mm = [400, 400]
height_mm = 700
[[people]]
name = "tom"
enters_from_mm = [1100, 400]
"""
)
SMALL_ROOM = "[floor]\nsize_mm = [400, 300]\n[robot]\nstart_mm = [150, 150]\n"


@pytest.mark.parametrize(
    ("world", "warning"),
    [
        (
            FACES_THE_WALL,
            "pictures[0].facing_deg: lena looks at a wall, a box or another picture right in front of it, so the robot "
            "cannot see it from anywhere; move one of them, or turn it round by facing_deg = 180.",
        ),
        (
            CLOSED,
            "pictures[0].at_mm: no path leads from the robot's start to where it would see lena; the robot needs a gap "
            "of 230 mm.",
        ),
        (CENTIMETRES, "pictures[0].size_mm: lena is tiny; if that is in centimetres, write [210, 297]."),
        (METRES, "pictures[0].size_mm: lena is tiny; if that is in metres, write [210, 297]."),
        (
            IN_THE_DESK,
            "people[1].enters_from_mm: tom comes in inside the box 'desk'. Move the door to its edge or to a wall of "
            "the room.",
        ),
        (SMALL_ROOM, "floor.size_mm: the room is tiny; if that is in centimetres, write [4000, 3000]."),
    ],
    ids=["faces the wall", "closed", "print in cm", "print in m", "in the desk", "room in cm"],
)
def test_a_room_in_which_the_robot_cannot_succeed_is_warned_of_by_check_and_by_a_run(world, warning, capsys, printed):
    Path("odd.toml").write_text(world, encoding="utf-8")
    assert printed("world", "check", "odd.toml") == f"odd.toml: good\n  warning: {warning}\n"
    Path("short.toml").write_text(SHORT, encoding="utf-8")
    main(["run", "short.toml", "--nxt", "sim://odd.toml", "--no-video"])
    assert capsys.readouterr().err.startswith(f"nxtdrive: warning: odd.toml: {warning}\n")


@pytest.mark.parametrize(
    "what",
    [
        'picture = "lena"\nto_mm = [1000, 1500]',
        'picture = "lena"\nfacing_deg = 90',
        "robot = true\nto_mm = [3000, 1500]\nfacing_deg = 0",
    ],
)
def test_a_closed_room_that_an_event_opens_is_not_warned_of(what, printed):
    event = f'[[events]]\nname = "change"\nwhen = {{ at_s = 1 }}\n{what}\n'
    Path("odd.toml").write_text(CLOSED + event, encoding="utf-8")
    assert printed("world", "check", "odd.toml") == "odd.toml: good\n"


@pytest.mark.parametrize("more", ["mass_kg = 0.2", ""])
def test_a_box_that_closes_the_doorway_is_warned_of_unless_it_can_be_pushed(more, printed):
    doorway = CLOSED.replace("to_mm = [2000, 3000]", "to_mm = [2000, 2500]")
    box = f'[[boxes]]\nname = "crate"\nat_mm = [2000, 2750]\nsize_mm = [300, 480]\nheight_mm = 300\n{more}\n'
    Path("odd.toml").write_text(doorway + box, encoding="utf-8")
    assert ("no path leads" in printed("world", "check", "odd.toml")) == (not more)


@pytest.mark.parametrize(
    ("size", "said"),
    [
        ("[400, 300]", "it needs 115 mm around it; if floor.size_mm is in centimetres, write [4000, 3000]"),
        ("[400, 90]", "floor.size_mm: no robot fits in; if that is in centimetres, write [4000, 900]"),
        ("[4, 0.9]", "floor.size_mm: no robot fits in; if that is in metres, write [4000, 900]"),
    ],
)
def test_a_room_in_which_no_robot_fits_is_refused_with_the_unit_that_was_probably_meant(size, said, refused):
    room = f"[floor]\nsize_mm = {size}\n[robot]\nstart_mm = [50, 45]\n"
    Path("small.toml").write_text(room, encoding="utf-8")
    assert said in refused("world", "check", "small.toml")


def test_every_unreadable_image_is_listed_together_with_the_other_mistakes(refused):
    Path("cat.jpg").write_text("no image", encoding="utf-8")
    text = EXAMPLE.replace('name = "lena"', 'name = "lena"\nfile = "cat.jpg"').replace('"crate"\n', '"cat.jpg"\n')
    text = text.replace("heading_deg = 270", "heading = 270")
    Path("bad.toml").write_text(text, encoding="utf-8")
    report = refused("world", "check", "bad.toml")
    assert report.startswith("bad.toml: 3 mistakes")
    for path in ("robot.heading", "pictures[0].file: cat.jpg is not", "boxes[0].texture: cat.jpg is not"):
        assert path in report


def test_a_program_that_meets_an_unreadable_image_names_it_without_a_list_of_textures():
    Path("cat.jpg").write_text("no image", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        TextureLibrary()["cat.jpg"]
    assert str(caught.value) == "cat.jpg is not an image OpenCV can read. Use a PNG or JPEG file."


@pytest.mark.parametrize("name", sorted(path.stem for path in WORLDS.glob("*.toml")))
def test_a_room_is_drawn_as_text_with_all_names_and_its_size(name, printed):
    text, world = printed("world", "show", name), load_world(name)
    drawing = text[: text.rindex("+")]
    for each in (*world.pictures, *world.boxes):
        assert each.name in text
        assert each.name in drawing or not each.present
    assert f"{world.floor.size_mm[0]:g} x {world.floor.size_mm[1]:g} mm" in text
    assert max(map(len, drawing.splitlines())) <= 80


@pytest.mark.parametrize(("columns", "widest"), [(40, 40), (5, 22), (200, 74)])
def test_a_room_is_drawn_as_text_no_wider_than_the_terminal(columns, widest, printed, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", str(columns))
    text = printed("world", "show", "arena")
    drawing = text[: text.rindex("+") + 1]
    assert {len(line) for line in drawing.splitlines()} == {widest}
    assert "<lena" in drawing


def test_a_room_is_drawn_as_an_image(refused):
    assert main(["world", "show", "arena", "--out", "arena.png"]) == DONE
    image = cv2.imread("arena.png")
    assert len(np.unique(image @ (1, 256, 256**2))) > 10
    assert refused("world", "show", "arena", "--out", "nowhere/arena.png").count("cannot be written") == 1


@pytest.mark.parametrize("suffix", ["odd", "xbm", "wmf"])  # Pillow knows these two, but cannot write this image so
def test_an_image_format_that_no_room_can_be_drawn_in_is_called_that(capsys, suffix):
    assert main(["world", "show", "arena", "--out", f"arena.{suffix}"]) == USAGE
    said = f"arena.{suffix} cannot be written: no image format ends in '.{suffix}'. Use .png."
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("key", ["picture", "texture"])
def test_a_room_is_not_drawn_over_an_image_that_it_shows(capsys, key):
    cat = Path("cat.png")
    cat.write_bytes((PICTURES / "fox.png").read_bytes())
    before = cat.read_bytes()
    room = "[floor]\nsize_mm = [2000, 2000]\n[robot]\nstart_mm = [500, 1000]\n"
    room += {
        "picture": '[[pictures]]\nname = "cat"\nfile = "cat.png"\nat_mm = [1500, 1000]\nfacing_deg = 180\n',
        "texture": '[[boxes]]\nname = "b"\nat_mm = [1500, 99]\nsize_mm = [90, 90]\nheight_mm = 99\ntexture = "cat.png"',
    }[key]
    Path("cat-world.toml").write_text(room)
    assert main(["world", "show", "cat-world.toml", "--out", "cat.png"]) == USAGE
    assert "cat.png cannot be written: the command reads it" in capsys.readouterr().err
    assert cat.read_bytes() == before


def test_a_room_as_text_shows_what_its_sensors_measure_and_where_they_are(printed):
    drawing, _, legend = printed("world", "show", "track").rpartition("+\n")
    rows = drawing.splitlines()
    assert all("k" in row for row in rows[5:20])
    assert rows[1].count("r") == rows[1].count("y") == rows[-2].count("g") == rows[-2].count("b") > 3
    assert "U!" in drawing, "the magnet and the sound are at the same place"
    assert "port 2: color, 80 mm forward and 30 right" in legend
    assert "k  black tape, 40 mm wide, along (1200, 500) (2800, 500)" in legend
    assert "r  red patch at (250, 200), 300 x 300 mm" in legend
    assert "U  magnet at (2000, 1300), 30° within 500 mm" in legend
    assert "!  sound at (2000, 1300), 75 dB from 10 s for 5 s" in legend


def test_inner_walls_are_listed_below_the_text(printed):
    assert "=  wall from (1500, 2000) to (1500, 2800), 600 high" in printed("world", "show", "room")


def test_the_image_shows_tape_and_patches_in_their_colours_in_map_and_legend():
    page, (image, view) = _painted("track")
    text = [key.text for key in page.keys]
    assert text[-8:-2] == ["floor, white", "black tape", "red patch", "yellow patch", "green patch", "blue patch"]
    assert text[-2:] == ["source of sound", "magnet or iron, and its range"]
    assert "a sensor on it" in text
    colors = [image.getpixel(view.at(place)) for place in ((2000, 500), (250, 200), (3750, 200), (250, 2400))]
    black, red, yellow, green = colors
    assert max(black) < 80
    assert red[0] > 2 * red[1] > red[2]
    assert min(yellow[:2]) > 1.5 * yellow[2]
    assert green[1] > 1.2 * max(green[0], green[2])
    assert min(image.getpixel(view.at((700, 1300)))) > 220, "the floor is white"


def test_what_is_larger_than_the_room_ends_at_its_walls():
    patch = "[[patches]]\ncolor = 'red'\nat_mm = [300, 500]\nsize_mm = [1000000, 200]\n"
    text = f"[floor]\nsize_mm = [600, 1000]\n[robot]\nstart_mm = [200, 200]\n{patch}"
    Path("small.toml").write_text(text, encoding="utf-8")
    _, (image, view) = _painted("small.toml")
    assert [image.getpixel(view.at((x_mm, 550))) == (255, 255, 255) for x_mm in (-80, 80, 520, 680)] == [1, 0, 0, 1]


def test_a_world_without_paint_keeps_its_plain_floor_in_the_image():
    page, (image, view) = _painted("room")
    assert image.getpixel(view.at((800, 800))) == (255, 255, 255)
    assert not any("floor" in key.text for key in page.keys)


def test_the_image_holds_a_person_who_comes_in_at_the_edge():
    Path("edge.toml").write_text(EXAMPLE.replace("[2600, 150]", "[2600, 0]"), encoding="utf-8")
    page, _ = _painted("edge.toml")
    assert page.area.top < -180


def _painted(world):
    page = room_page(load_world(world))
    sheet = Sheet(1000, 800)
    view = FloorView(sheet, page.area, page.axes, (0.0, 0.0), (1000.0, 800.0))
    page.paint(view)
    return page, (sheet.finished(), view)


def test_the_name_of_a_small_box_hides_none_of_its_corners():
    box = "[[boxes]]\nname = 'shoe box'\nat_mm = [1800, 2600]\nsize_mm = [330, 200]\nheight_mm = 60\n"
    Path("box.toml").write_text(f"[floor]\nsize_mm = [5000, 4000]\n[robot]\nstart_mm = [800, 2000]\n{box}", "utf-8")
    page = room_page(load_world("box.toml"))
    view = FloorView(Sheet(1000, 800), page.area, page.axes, (0.0, 0.0), (1000.0, 800.0))
    [(left, top, right, bottom)] = place_tags(view, page)
    corners = view.all_at([(1800 + x, 2600 + y) for x in (-165, 165) for y in (-100, 100)])
    assert not any(left < x < right and top < y < bottom for x, y in corners)


@pytest.mark.parametrize("command", ["mission", "world"])
def test_check_counts_the_mistakes_that_it_does_not_list(command, refused):
    text = "".join(f"[[boxes]]\nname = 'b{number}'\nat_mm = [0, 0]\nsize_mm = [1, 0]\n" for number in range(30))
    if command == "mission":
        text = "[mission]\ntargets = ['a']\n[target.a]\ndetector = 'color'\ncolor = 'red'\n[robot]\n"
        text += "".join(f"k{number} = 1\n" for number in range(30))
    else:
        text = f"[floor]\nsize_mm = [1000, 1000]\n[robot]\nstart_mm = [500, 500]\n{text}"
    Path("many.toml").write_text(text, encoding="utf-8")
    heading, *lines = refused(command, "check", "many.toml").splitlines()
    more = int(re.fullmatch(r" *and (\d+) more", lines.pop())[1])
    assert heading == f"many.toml: {len(lines) + more} mistakes"


@pytest.mark.parametrize("size_mm", [(600, 1_000_000), (1_000_000, 600), (600, 600)])
def test_a_drawing_has_a_limited_size_whatever_the_room_and_its_names(size_mm, printed):
    box = f"[[boxes]]\nname = '{'long' * 50}'\nat_mm = [500, 500]\nsize_mm = [50, 50]\nheight_mm = 90\n"
    text = f"[floor]\nsize_mm = {list(size_mm)}\n[robot]\nstart_mm = [200, 200]\n{box}"
    Path("odd.toml").write_text(text, encoding="utf-8")
    rows = [line for line in printed("world", "show", "odd.toml").splitlines() if line[:1] in ("|", "+")]
    assert len(rows) < 100
    assert len({len(row) for row in rows}) == 1
    assert len(rows[0]) <= 80
    assert main(["world", "show", "odd.toml", "--out", "odd.png"]) == DONE
    assert max(cv2.imread("odd.png").shape) <= 1700


def test_a_room_as_text_names_and_as_an_image_marks_what_gives_no_echo(printed):
    text = "[floor]\nsize_mm = [3000, 3000]\n[robot]\nstart_mm = [500, 500]\n"
    text += "[[walls]]\nfrom_mm = [2000, 0]\nto_mm = [2000, 900]\nabsorbs = true\n"
    for name, absorbs in (("curtain", "true"), ("crate", "false")):
        text += f"[[boxes]]\nname = '{name}'\nat_mm = [1500, 1500]\nsize_mm = [50, 50]\nheight_mm = 90\n"
        text += f"absorbs = {absorbs}\n"
    text += "[[people]]\nname = 'anna'\nenters_from_mm = [2500, 2500]\nabsorbs = true\n"
    Path("soft.toml").write_text(text, encoding="utf-8")
    silent = [line for line in printed("world", "show", "soft.toml").splitlines() if line.endswith(", gives no echo")]
    assert [line.split()[1] for line in silent] == ["wall", "box", "'anna'"]
    keys, marked = {}, {}
    for absorbs in (True, False):
        Path("soft.toml").write_text(text if absorbs else text.replace("absorbs = true", ""), encoding="utf-8")
        page = room_page(load_world("soft.toml"))
        keys[absorbs] = {key.text for key in page.keys}
        marked[absorbs] = np.all(np.asarray(draw_page(page)) == NO_ECHO, axis=-1).sum()
    assert keys[True] - keys[False] == {"gives no ultrasonic echo"}
    assert marked[True] > 1000
    assert not marked[False]
