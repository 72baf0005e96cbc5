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
from nxtdrive.cli.main import DONE, USAGE, main
from sim_backend.bundled import WORLDS
from sim_backend.world.loading import load_world, parse_world

PAGE = (Path(__file__).parents[3] / "docs" / "worlds.md").read_text(encoding="utf-8")
EXAMPLE, *FRAGMENTS = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_a_new_room_is_the_pages_example_and_good(capsys):
    assert main(["world", "new", "room.toml"]) == DONE
    assert Path("room.toml").read_text(encoding="utf-8") == EXAMPLE
    assert main(["world", "check", "room.toml"]) == DONE
    assert "room.toml: good" in capsys.readouterr().out


@pytest.mark.nightly
def test_the_built_in_mission_succeeds_in_the_pages_example():
    Path("room.toml").write_text(EXAMPLE, encoding="utf-8")
    assert nxtdrive.run_mission(nxt="sim://room.toml").achieved


@pytest.mark.parametrize("fragment", FRAGMENTS, ids=lambda text: text.split()[0])
def test_the_pages_fragments_fit_into_its_example(fragment):
    parse_world(tomllib.loads(EXAMPLE + fragment), Path("example.toml"))


def test_a_room_is_overwritten_only_when_told_so(capsys):
    Path("room.toml").write_text("mine", encoding="utf-8")
    assert main(["world", "new", "room.toml"]) == USAGE
    assert "room.toml exists already" in capsys.readouterr().err
    assert main(["world", "new", "room.toml", "--force"]) == DONE
    assert Path("room.toml").read_text(encoding="utf-8") == EXAMPLE


def test_every_bundled_room_is_good(capsys):
    names = sorted(path.stem for path in WORLDS.glob("*.toml"))
    assert main(["world", "check", *names]) == DONE
    assert capsys.readouterr().out.split("\n")[:-1] == [f"{name}: good" for name in names]


def test_mistakes_of_several_files_are_listed_with_the_images_that_cannot_be_read(capsys):
    text = EXAMPLE.replace("start_mm = [500, 1400]", "start_mm = [1700, 500]")
    Path("bad.toml").write_text(text, encoding="utf-8")
    Path("cat.jpg").write_text("no image", encoding="utf-8")
    Path("image.toml").write_text(EXAMPLE.replace('name = "lena"', 'name = "lena"\nfile = "cat.jpg"'), encoding="utf-8")
    assert main(["world", "check", "--json", "bad.toml", "nowhere", "image.toml", "open"]) == USAGE
    bad, nowhere, image, good = [each["mistakes"] for each in json.loads(capsys.readouterr().out)]
    assert bad[0].startswith("robot.start_mm: the robot stands in the box")
    assert nowhere[0].startswith("there is no world file nowhere")
    assert "cat.jpg" in image[0]
    assert good == []
    assert main(["world", "check", "bad.toml"]) == USAGE
    assert capsys.readouterr().err.startswith("bad.toml: 1 mistake\n  robot.start_mm")


@pytest.mark.parametrize("name", sorted(path.stem for path in WORLDS.glob("*.toml")))
def test_a_room_is_drawn_as_text_with_all_names_and_its_size(name, capsys):
    assert main(["world", "show", name]) == DONE
    text, world = capsys.readouterr().out, load_world(name)
    drawing = text[: text.rindex("+")]
    for each in (*world.pictures, *world.boxes):
        assert each.name in text
        assert each.name in drawing or not each.present
    assert f"{world.floor.size_mm[0]:g} x {world.floor.size_mm[1]:g} mm" in text
    assert max(map(len, drawing.splitlines())) <= 80


def test_a_room_is_drawn_as_an_image(capsys):
    assert main(["world", "show", "arena", "--out", "arena.png"]) == DONE
    image = cv2.imread("arena.png")
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 10
    assert main(["world", "show", "arena", "--out", "nowhere/arena.png"]) == USAGE
    assert main(["world", "show", "arena", "--out", "arena.odd"]) == USAGE
    assert capsys.readouterr().err.count("cannot be written") == 2


@pytest.mark.parametrize("command", ["mission", "world"])
def test_check_counts_the_mistakes_that_it_does_not_list(command, capsys):
    text = "".join(f"[[boxes]]\nname = 'b{number}'\nat_mm = [0, 0]\nsize_mm = [1, 0]\n" for number in range(30))
    if command == "mission":
        text = "[mission]\ntargets = ['a']\n[target.a]\ndetector = 'color'\ncolor = 'red'\n[robot]\n"
        text += "".join(f"k{number} = 1\n" for number in range(30))
    else:
        text = f"[floor]\nsize_mm = [1000, 1000]\n[robot]\nstart_mm = [500, 500]\n{text}"
    Path("many.toml").write_text(text, encoding="utf-8")
    assert main([command, "check", "many.toml"]) == USAGE
    heading, *lines = capsys.readouterr().err.splitlines()
    more = int(re.fullmatch(r" *and (\d+) more", lines.pop())[1])
    assert heading == f"many.toml: {len(lines) + more} mistakes"


@pytest.mark.parametrize("size_mm", [(600, 1_000_000), (1_000_000, 600), (600, 600)])
def test_a_drawing_has_a_limited_size_whatever_the_room_and_its_names(size_mm, capsys):
    box = f"[[boxes]]\nname = '{'long' * 50}'\nat_mm = [500, 500]\nsize_mm = [50, 50]\nheight_mm = 90\n"
    text = f"[floor]\nsize_mm = {list(size_mm)}\n[robot]\nstart_mm = [200, 200]\n{box}"
    Path("odd.toml").write_text(text, encoding="utf-8")
    assert main(["world", "show", "odd.toml"]) == DONE
    rows = [line for line in capsys.readouterr().out.splitlines() if line[:1] in ("|", "+")]
    assert len(rows) < 100
    assert len({len(row) for row in rows}) == 1
    assert len(rows[0]) <= 80
    assert main(["world", "show", "odd.toml", "--out", "odd.png"]) == DONE
    assert max(cv2.imread("odd.png").shape) <= 1700
