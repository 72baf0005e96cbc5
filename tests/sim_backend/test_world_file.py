"""World files: valid ones load, and all mistakes are reported at once."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from behaviors.mission.robot import RobotTable
from firmware_protocol.errors import ConfigError
from sim_backend.bundled import WORLDS
from sim_backend.camera.textures import SURFACES
from sim_backend.world.event_tables import Event, When
from sim_backend.world.loading import load_world, parse_world
from sim_backend.world.sensor_tables import (
    ColorMount,
    CompassMount,
    I2CMount,
    LightMount,
    Magnet,
    Patch,
    Sound,
    SoundMount,
    Surroundings,
    TemperatureMount,
    TouchMount,
    Ultrasonic,
    UltrasonicMount,
)
from sim_backend.world.toml_types import TEXTURES
from sim_backend.world.world_file import (
    Box,
    Camera,
    Floor,
    Light,
    Person,
    Picture,
    Robot,
    Slip,
    Wall,
    WorldFile,
)

GOOD = """
[floor]
size_mm = [3000, 2000]
[robot]
start_mm = [400, 1000]
"""


def mistakes_in(text: str) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        parse_world(tomllib.loads(text), Path("test.toml"))
    return [line.strip() for line in str(caught.value).splitlines()[1:]]


@pytest.mark.parametrize("path", sorted(WORLDS.glob("*.toml")), ids=lambda path: path.stem)
def test_every_bundled_world_is_good(path):
    assert load_world(path.stem) == load_world(path)


def test_a_file_of_another_program_is_not_checked_key_by_key(tmp_path):
    (tmp_path / "pyproject.toml").write_text("[project]\nname = 'a'\n[tool.ruff]\nline-length = 120\n")
    with pytest.raises(ConfigError, match=r"pyproject\.toml is not a world: it has no \[floor\] and no \[robot\]\."):
        load_world(tmp_path / "pyproject.toml")


def test_a_mission_in_place_of_a_world_is_called_one(tmp_path):
    (tmp_path / "cat.toml").write_text('[mission]\ntargets = ["cat"]\n')
    with pytest.raises(ConfigError, match=r"cat\.toml is a mission, not a world"):
        load_world(tmp_path / "cat.toml")


@pytest.mark.parametrize("folder", [".", "rooms", "/"])
def test_a_folder_in_place_of_a_world_is_called_one(folder, here):
    Path("rooms").mkdir()
    with pytest.raises(ConfigError, match=rf"^{re.escape(folder)} is a folder, not a world"):
        load_world(folder)


def test_a_bundled_world_is_found_beside_a_folder_of_its_name(here):
    Path("open").mkdir()
    assert load_world("open").pictures


def test_a_file_hides_a_bundled_world_only_if_it_has_its_whole_name(here):
    for name in ("open", "open.toml"):
        Path(name).write_text("[floor]\nsize_mm = [900, 900]\n[robot]\nstart_mm = [400, 400]\n")
    assert load_world("open").pictures
    assert not load_world("open.toml").pictures


def test_a_file_of_your_own_that_is_not_there_is_no_bundled_world(here):
    with pytest.raises(ConfigError, match=r"there is no world file room\.toml\. Did you mean 'room'"):
        load_world("room.toml")


@pytest.mark.parametrize("path", ["rooms/open.toml", "rooms/open", "/no/such/folder/open.toml"])
def test_a_missing_file_is_not_replaced_by_the_bundled_world_of_its_name(path, here):
    with pytest.raises(ConfigError, match=rf"there is no world file {path}"):
        load_world(path)


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("kitchen", "kitchen.toml"),
        ("kitchn.toml", "kitchen.toml"),
        ("rooms/attic", "rooms/attic.toml"),
        ("figur5", "figure5"),
        ("figur5.toml", "figure5"),
    ],
)
def test_the_world_that_was_meant_is_suggested(name, meant, here):
    Path("rooms").mkdir()
    for file in ("kitchen.toml", "rooms/attic.toml"):
        Path(file).touch()
    with pytest.raises(ConfigError) as refused:
        load_world(name)
    assert refused.value.remedy == f"Did you mean {meant!r}?"


def test_the_ending_alone_makes_no_world_similar(here):
    Path("rc.toml").touch()
    with pytest.raises(ConfigError) as refused:
        load_world("nowhere.toml")
    assert refused.value.remedy.startswith("Give a path, or one of: arena, ")


@pytest.mark.parametrize(
    ("key", "low", "high"), [("wheel_diameter_mm", 10, 300), ("track_mm", 30, 600), ("radius_mm", 50, 500)]
)
def test_the_robot_has_the_sizes_that_a_mission_allows(key, low, high):
    model = Robot.model_fields[key].metadata
    limits = RobotTable.model_fields[{"track_mm": "axle_track_mm"}.get(key, key)].metadata
    assert model == limits
    [mistake] = mistakes_in(GOOD + f"{key} = {low / 2}")
    assert mistake == f"robot.{key}: must be {low} or more, not {low / 2}"
    [mistake, *_] = mistakes_in(GOOD + f"{key} = {2 * high}")
    assert mistake == f"robot.{key}: must be {high} or less, not {2 * high}"


@pytest.mark.parametrize(
    ("event", "sentence"),
    [
        ("when = {}\npicture = 'lena'", "has no condition"),
        ("when = { at_s = 1 }", "exactly one of person, picture, box"),
        ("when = { at_s = 1 }\nperson = 'anna'", "exactly one of to_mm, blocks and leaves"),
        ("when = { at_s = 1 }\npicture = 'lena'\nstays_s = 3", "not for pictures and boxes"),
        ("when = { at_s = 1 }\npicture = 'lena'\nblocks = 'lena'", "for persons and boxes"),
        ("when = { at_s = 1 }\nbox = 'b'\nblocks = 'lena'\nto_mm = [1, 1]", "exclude each other"),
        ("when = { at_s = 1, robot_within_mm = 3 }\npicture = 'lena'", "the distance from what?"),
    ],
)
def test_an_event_that_makes_no_sense_is_refused(event, sentence):
    [mistake] = mistakes_in(GOOD + "[[events]]\nname = 'x'\n" + event)
    assert sentence in mistake


@pytest.mark.parametrize("duration", ["'long'", "-1", "[3, 2]", "[1]"])
def test_a_duration_is_seconds_or_a_range(duration):
    [mistake] = mistakes_in(GOOD + f"[[events]]\nname = 'x'\nbox = 'b'\nwhen = {{ at_s = 1, delay_s = {duration} }}")
    assert mistake.startswith("events[0].when.delay_s: must be seconds, or [shortest, longest]")


def test_a_picture_that_is_not_shipped_needs_a_file():
    [mistake] = mistakes_in(GOOD + "[[pictures]]\nname = 'mona'\nat_mm = [900, 900]\nfacing_deg = 0")
    assert mistake.startswith("pictures[0].name: no picture 'mona' here")


@pytest.mark.parametrize(
    "table",
    [
        *(Floor, Robot, Slip, Camera, Ultrasonic, Light, Wall, Box, Picture, Person, When, Event, WorldFile),
        *(Patch, Surroundings, Sound, Magnet, TouchMount, LightMount, ColorMount, SoundMount, UltrasonicMount),
        *(TemperatureMount, CompassMount, I2CMount),
    ],
)
def test_every_key_is_described(table):
    described = Path(__file__).parents[2].joinpath("docs", "worlds.md").read_text(encoding="utf-8")
    missing = [key for key in table.model_fields if not re.search(rf"[`\[]{key}[`\] ]|^{key} =", described, re.M)]
    assert missing == []


@pytest.mark.parametrize(
    ("sensors", "mistakes"),
    [
        ("kind = 'light'\nport = 1", ["sensors[0].port: robot.touch_port has port 1 already"]),
        (
            "kind = 'light'\nport = 2\n[[sensors]]\nkind = 'color'\nport = 2",
            ["sensors[1].port: sensors[0].port has port"],
        ),
        ("kind = 'light'\nport = 5", ["sensors[0].port: must be 4 or less"]),
        ("kind = 'lihgt'\nport = 2", ["sensors[0].kind: there is no 'lihgt'; did you mean 'light'?"]),
        ("port = 2", ["sensors[0].kind: is missing"]),
        ("kind = 'light'\nport = 2\nlook = 'up'", ["sensors[0].look: there is no such key; did you mean 'looks'?"]),
        ("kind = 'light'\nport = 2\nlooks = 'up'", ["sensors[0].looks: must be 'down' or 'ahead'"]),
        ("kind = 'compass'", ["sensors[0].port: is missing"]),
        ("kind = 'i2c'\nport = 2\naddress = 3", ["sensors[0].address: must be a multiple of 2"]),
        ("kind = 'i2c'\nport = 2\nregisters = { x = [1] }", ["sensors[0].registers: 'x' is not a register"]),
        (
            "kind = 'i2c'\nport = 2\nregisters = { 255 = 'ab' }",
            ["sensors[0].registers: the values at 255 go beyond"],
        ),
    ],
)
def test_mistakes_in_sensors_are_reported_with_their_path(sensors, mistakes):
    found = mistakes_in(GOOD + "[[sensors]]\n" + sensors)
    assert [line[: len(start)] for line, start in zip(found, mistakes, strict=True)] == mistakes


def test_an_object_without_a_name_is_not_suggested():
    nameless = "[[people]]\nenters_from_mm = [100, 100]\n"
    visit = "[[events]]\nname = 'visit'\nwhen = { at_s = 1 }\nperson = 'tom'\nto_mm = [500, 500]"
    no_tom = "events[0].person: there is no 'tom'; describe it in a table [[people]]"
    assert mistakes_in(GOOD + nameless + visit) == ["people[0].name: is missing", no_tom]


def test_a_taken_port_comes_with_a_way_out():
    [mistake] = mistakes_in(GOOD + "[[sensors]]\nkind = 'light'\nport = 4")
    assert mistake.endswith("take another one (free: 2, 3) or set robot.ultrasonic_port to 0")


@pytest.mark.parametrize(
    ("patch", "sentence"),
    [
        ("color = 'pink'\nat_mm = [1, 1]\nsize_mm = [9, 9]", "patches[0].color: must be one of black"),
        ("color = 'red'", "patches[0]: needs exactly one of at_mm (a rectangle) and along_mm (tape)"),
        ("color = 'red'\nat_mm = [1, 1]", "patches[0]: at_mm and size_mm belong together"),
        ("color = 'red'\nalong_mm = [[1, 1]]", "patches[0]: along_mm needs two points"),
        ("color = [10, 20, 300]\nalong_mm = [[1, 1], [2, 2]]", "patches[0].color[2]: must be 100 or less"),
    ],
)
def test_a_patch_that_makes_no_sense_is_refused(patch, sentence):
    [mistake] = mistakes_in(GOOD + "[[patches]]\n" + patch)
    assert mistake.startswith(sentence)


def test_a_missing_file_names_the_worlds_there_are(tmp_path):
    with pytest.raises(ConfigError, match=r"nowhere\.toml.*arena"):
        load_world(tmp_path / "nowhere.toml")


def test_broken_toml_is_reported_with_its_line(tmp_path):
    (tmp_path / "broken.toml").write_text("[floor\n")
    with pytest.raises(ConfigError, match=r"not TOML.*line 1"):
        load_world(tmp_path / "broken.toml")


@pytest.mark.parametrize(("written", "lies"), [("cat.png", "cat.png"), ("~/cat.png", "home/cat.png")])
def test_picture_files_are_beside_the_world_file_or_in_the_users_folder(tmp_path, monkeypatch, written, lies):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("USERPROFILE", str(tmp_path / "home"))
    (tmp_path / "home").mkdir()
    (tmp_path / lies).touch()
    (tmp_path / "cats.toml").write_text(
        GOOD + f"[[pictures]]\nname = 'cat'\nfile = '{written}'\nat_mm = [900, 900]\nfacing_deg = 0"
    )
    assert load_world(tmp_path / "cats.toml").pictures[0].file == tmp_path / lies


ROOM = """
[floor]
size_mm = [3000, 2000]
[robot]
start_mm = [400, 1000]
[[walls]]
from_mm = [1500, 0]
to_mm = [1500, 1000]
thickness_mm = 40
[[boxes]]
name = "desk"
at_mm = [2500, 500]
size_mm = [800, 400]
height_mm = 700
"""


@pytest.mark.parametrize(
    ("start_mm", "expected"),
    [
        ("[2500, 500]", "robot.start_mm: the robot stands in the box 'desk'"),
        ("[2500, 780]", "robot.start_mm: the robot stands in the box 'desk'"),
        ("[1500, 500]", "robot.start_mm: the robot stands in walls[0]"),
        ("[1420, 500]", "robot.start_mm: the robot stands in walls[0]"),
        ("[60, 1000]", "robot.start_mm: the robot stands in the wall of the room"),
        ("[3100, 1000]", "robot.start_mm: (3100, 1000) is outside the floor of 3000 x 2000 mm"),
    ],
)
def test_a_robot_that_cannot_stand_where_it_starts_is_refused(start_mm, expected):
    [mistake] = mistakes_in(ROOM.replace("[400, 1000]", start_mm))
    assert mistake.startswith(expected)
    assert "115 mm" in mistake or "outside" in mistake


@pytest.mark.parametrize("start_mm", ["[116, 1000]", "[1360, 500]", "[2500, 820]"])
def test_a_robot_may_stand_close_to_things(start_mm):
    parse_world(tomllib.loads(ROOM.replace("[400, 1000]", start_mm)), Path("test.toml"))


@pytest.mark.parametrize(
    ("picture", "expected"),
    [
        ("at_mm = [1500, 500]\nfacing_deg = 180", "'lena' is inside walls[0]"),
        ("at_mm = [1515, 950]\nfacing_deg = 180", "'lena' is inside walls[0]"),
        ("at_mm = [2500, 500]\nfacing_deg = 90", "'lena' is inside the box 'desk'"),
        ("at_mm = [1000, 2]\nfacing_deg = 180", "'lena' sticks out of the room"),
        ("at_mm = [420, 1000]\nfacing_deg = 180", "'lena' stands where the robot starts"),
    ],
)
def test_a_picture_that_nobody_could_see_is_refused(picture, expected):
    [mistake] = mistakes_in(ROOM + f"[[pictures]]\nname = 'lena'\n{picture}\n")
    assert mistake.startswith("pictures[0].at_mm: ")
    assert expected in mistake


@pytest.mark.parametrize(
    "picture",
    [
        "at_mm = [1475, 500]\nfacing_deg = 180",
        "at_mm = [2500, 710]\nfacing_deg = 90",
        "at_mm = [2500, 500]\nfacing_deg = 180\ncentre_height_mm = 900",
        "at_mm = [2500, 500]\nfacing_deg = 180\npresent = false",
        "at_mm = [1000, 6]\nfacing_deg = 90",
    ],
    ids=["on a wall", "before the desk", "on the desk", "absent", "on the wall of the room"],
)
def test_a_picture_may_hang_on_a_wall_or_stand_on_a_desk(picture):
    parse_world(tomllib.loads(ROOM + f"[[pictures]]\nname = 'lena'\n{picture}\n"), Path("test.toml"))


def test_a_wall_that_ends_outside_the_room_is_refused():
    text = ROOM.replace("[1500, 1000]", "[1500, -200]")
    assert [line.split(":")[0] for line in mistakes_in(text)] == ["walls[0].to_mm"]


def test_a_box_may_stand_partly_in_the_wall_of_the_room():
    parse_world(tomllib.loads(ROOM.replace("at_mm = [2500, 500]", "at_mm = [2700, 500]")), Path("test.toml"))


def test_mistakes_of_every_kind_are_reported_in_one_pass():
    mistakes = mistakes_in(
        """
        [floor]
        size_mm = [3000, 2000]
        colour = "grey"
        [robot]
        start_mm = [60, 1000]
        headng_deg = 90
        slip = { veer_deg_m = 2 }
        [[people]]
        name = "lena"
        enters_from_mm = [0, 0]
        [[pictures]]
        name = "fox"
        at_mm = "left"
        [[pictures]]
        name = "lena"
        at_mm = [3100, 1000]
        facing_deg = 180
        file = "nowhere.png"
        [[events]]
        name = "gone"
        when = { sees = "lenna" }
        picture = "lenna"
        present = false
        [[events]]
        name = "gone"
        when = { after = "begone" }
        person = "anna"
        leaves = true
        """
    )
    assert [line.split(":")[0] for line in mistakes] == [
        "floor.colour",
        "robot.slip.veer_deg_m",
        "robot.headng_deg",
        "pictures[0].at_mm",
        "pictures[0].facing_deg",
        "pictures[1].name",
        "events[1].name",
        "events[0].picture",
        "events[0].when.sees",
        "events[1].person",
        "events[1].when.after",
        "pictures[1].at_mm",
        "robot.start_mm",
        "pictures[1].file",
    ]
    assert mistakes[1].endswith("did you mean 'veer_deg_per_m'?")
    assert mistakes[5].endswith("'lena' is taken already")


def test_a_room_without_size_or_robot_still_has_its_other_mistakes_reported():
    mistakes = mistakes_in("[[pictures]]\nname = 'leena'\nat_mm = [900, 900]\nfacing_deg = 0")
    assert [line.split(":")[0] for line in mistakes] == ["floor", "robot", "pictures[0].name"]


def test_a_texture_can_be_an_image_beside_the_world(tmp_path, monkeypatch):
    (tmp_path / "room").mkdir()
    Image.new("RGB", (8, 8), "red").save(tmp_path / "room" / "bricks.png")
    world = tmp_path / "room" / "room.toml"
    world.write_text(ROOM.replace("[floor]", "[floor]\nwall_texture = 'bricks.png'") + "texture = 'bricks.png'")
    monkeypatch.chdir(tmp_path)
    loaded = load_world(world)
    assert loaded.floor.wall_texture == loaded.boxes[0].texture == str(tmp_path / "room" / "bricks.png")
    monkeypatch.chdir(tmp_path / "room")
    assert load_world(world) == loaded


def test_the_names_of_the_textures_are_those_that_can_be_drawn():
    assert set(TEXTURES) == set(SURFACES)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            ROOM.replace("[[boxes]]", "[boxes]"),
            "boxes: write each entry as a table of its own, with two brackets: [[boxes]]",
        ),
        (ROOM.replace("[400, 1000]", "400"), "robot.start_mm: must be a list in brackets, as in [1200, 800], not 400"),
        (ROOM.replace("[400, 1000]", "[4, 5, 6]"), "robot.start_mm: must have at most 2 entries, not [4, 5, 6]"),
        (ROOM.replace("[400, 1000]", "[400]"), "robot.start_mm[1]: is missing"),
        (
            "[robot]\nstart_mm = [200, 200]\n",
            "floor: is missing; `nxtdrive world new FILE` writes a world with all it needs",
        ),
        (ROOM.replace("700", "-7"), "boxes[0].height_mm: must be 0.001 or more, not -7"),
        (ROOM.replace("700", "'high'"), "boxes[0].height_mm: must be a number, not 'high'"),
        (ROOM.replace("'desk'", "7").replace('"desk"', "7"), "boxes[0].name: must be text in quotes, not 7"),
        (ROOM + "present = 'maybe'", "boxes[0].present: must be true or false, not 'maybe'"),
        (ROOM.replace("[robot]", "[robot]\nleft_port = 'D'"), "robot.left_port: must be 'A', 'B' or 'C', not 'D'"),
        (ROOM.replace("[robot]", "[robot]\nbattery_mv = 9"), "robot.battery_mv: must be 5000 or more, not 9"),
        ("light = 3\n" + ROOM, "light: must be a table, not 3"),
        (ROOM + "texture = 'wod'", "boxes[0].texture: there is no texture 'wod'; did you mean 'wood'?"),
        (
            GOOD.replace("[3000, 2000]", "[3.6, 2.8]"),
            "floor.size_mm: no robot fits in; if that is in metres, write [3600, 2800]",
        ),
        (GOOD + "headng_deg = 90", "robot.headng_deg: there is no such key; did you mean 'heading_deg'?"),
        (GOOD + "heading_deg = 361", "robot.heading_deg: must be 360 or less, not 361"),
        (GOOD + "heading_deg = -1e300", "robot.heading_deg: must be -360 or more, not -1e+300"),
        (GOOD + "left_port = 'C'", "robot: left_port and right_port are both C; give each motor its own port"),
        (GOOD + "[camera]\nforward_mm = 1e300", "camera.forward_mm: must be 500 or less, not 1e+300"),
        (GOOD + "[camera]\nfps = 10.0\n", "camera.fps: must be a whole number, not 10.0"),
        (GOOD + "[ultrasonic]\nnoise_mm = 1001", "ultrasonic.noise_mm: must be 1000 or less, not 1001"),
        (
            GOOD + "[[sensors]]\nkind = 'light'\nport = 2\nat_mm = [0, 501]",
            "sensors[0].at_mm[1]: must be 500 or less, not 501",
        ),
    ],
)
def test_a_mistake_is_reported_in_plain_words(text, expected):
    assert mistakes_in(text) == [expected]


def test_a_picture_that_is_missing_says_where_it_belongs(tmp_path):
    (tmp_path / "dog.jpg").touch()
    (tmp_path / "room.toml").write_text(
        ROOM + "[[pictures]]\nname = 'dog'\nfile = 'dog.jpeg'\nat_mm = [400, 400]\nfacing_deg = 0\n", encoding="utf-8"
    )
    with pytest.raises(ConfigError) as refused:
        load_world(tmp_path / "room.toml")
    expected = f"there is no file 'dog.jpeg'; did you mean 'dog.jpg'? Else put it beside the world file ({tmp_path})"
    assert f"pictures[0].file: {expected}" in str(refused.value)


EVENT = '[[events]]\nname = "a"\npicture = "lena"\npresent = false\n'
PICTURE = '[[pictures]]\nname = "lena"\nat_mm = [2500, 1000]\nfacing_deg = 180\n'


@pytest.mark.parametrize(
    ("table", "where"),
    [
        (f"{PICTURE}{EVENT}when = {{ at_s = 1e308 }}", "events[0].when.at_s: must be 1000000 or less"),
        (f"{PICTURE}{EVENT}when = {{ at_s = 1, delay_s = 1e307 }}", "events[0].when.delay_s: must be seconds, or"),
        (f"{PICTURE}{EVENT}when = {{ at_s = 1, for_s = [1, 2e6] }}", "events[0].when.for_s: must be seconds, or"),
        ("[robot.slip]\nveer_deg_per_m = 1e308", "robot.slip.veer_deg_per_m: must be 3600 or less"),
        ("[[boxes]]\nname = 'a'\nat_mm = [2000, 900]\nsize_mm = [1e-308, 9]\nheight_mm = 9", "boxes[0].size_mm"),
        (
            "[[boxes]]\nname = 'a'\nat_mm = [2000, 900]\nsize_mm = [9, 9]\nheight_mm = 9\nmass_kg = 1e-300",
            "boxes[0].mas",
        ),
    ],
)
def test_numbers_with_which_a_simulation_cannot_compute_are_mistakes(table, where):
    (mistake,) = mistakes_in(f"{GOOD}{table}")
    assert mistake.startswith(where)


def unlimited(schema: Any, path: str = "") -> Iterator[str]:
    """Yield the paths of numbers in a JSON schema that lack a lower or an upper limit."""
    if isinstance(schema, dict) and schema.get("type") in ("number", "integer"):
        low, high = ({f"{end}imum", f"exclusive{end.capitalize()}imum"} for end in ("min", "max"))
        if not (low & schema.keys() and high & schema.keys()):
            yield path
    elif isinstance(schema, dict | list):
        for key, inner in schema.items() if isinstance(schema, dict) else enumerate(schema):
            yield from unlimited(inner, f"{path}.{key}")


def test_every_number_has_a_lower_and_an_upper_limit():
    assert list(unlimited(WorldFile.model_json_schema())) == []


@pytest.mark.parametrize("value", ["true", "false"])
def test_a_truth_value_is_not_a_number(value):
    found = mistakes_in(GOOD + f"backlash_deg = {value}\n[camera]\nfps = {value}\n[light]\nexposure = {value}\n")
    assert found == [
        f"robot.backlash_deg: must be a number, not {value}",
        f"light.exposure: must be a number, not {value}",
        f"camera.fps: must be a whole number, not {value}",
    ]
    assert mistakes_in(GOOD + f'[[sensors]]\nkind = "compass"\nport = 2\nnoise_deg = {value}\n') == [
        f"sensors[0].noise_deg: must be a number, not {value}"
    ]


def test_a_number_in_quotation_marks_is_a_mistake():
    found = mistakes_in(GOOD + "backlash_deg = '5'\n[camera]\nfps = '5'\n[[shades]]\nat_mm = [900, '5']\n")
    assert found[:3] == [
        "robot.backlash_deg: must be a number without quotation marks, not '5'",
        "shades[0].at_mm[1]: must be a number without quotation marks, not '5'",
        "shades[0].radius_mm: is missing",
    ]
    assert "camera.fps: must be a whole number without quotation marks, not '5'" in found
