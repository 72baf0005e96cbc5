"""The page on testing robot programs matches the code."""

import re
from pathlib import Path

import pytest

from nxtdrive.testing import SimWorld
from sim_backend import devices
from sim_backend.bundled import PICTURES

PAGE = (Path(__file__).parents[2] / "docs" / "testing-your-robot.md").read_text(encoding="utf-8")


def test_the_worlds_examples_run(sim_world, here):
    [block] = [
        text for text in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if text.startswith("sim_world.put(")
    ]
    (here / "cat.jpg").write_bytes((PICTURES / "fox.png").read_bytes())
    exec(block, {"sim_world": sim_world})
    sim_world.advance(11)
    assert sim_world.truth.boxes["crate"].x_mm == 2500
    assert sim_world.truth.pose == pytest.approx((600, 600, 90))
    assert set(sim_world.truth.pictures) == {"cat"}
    sim_world.advance(2)
    assert set(sim_world.truth.pictures) == {"cat", "lena"}


def test_the_example_with_a_button_presses_it_once(sim_world):
    [block] = [text for text in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "def press_enter(" in text]
    names = {}
    exec(block, names)
    sim_world.advance(5)
    names["press_enter"](sim_world)
    assert [button.short_releases for button in sim_world.simulation.brick.button.buttons] == [0, 0, 0, 1]


def test_every_device_to_plug_in_is_explained():
    assert set(devices.__all__) - {"NO_ECHO"} == {
        name for name in devices.__all__ if f"| `{name}`" in PAGE or f", `{name}` |" in PAGE
    }


def test_everything_of_the_truth_is_explained(sim_world):
    public = {name for name in dir(sim_world.truth) if not name.startswith("_")}
    assert public == {word for word in public if re.search(rf"`{word}[`(]", PAGE)}


def test_everything_of_the_world_is_explained():
    rest = {"address", "left_open", "overrun", "open_transport", "time_s"}
    methods = {name for name in dir(SimWorld) if not name.startswith("_")} - rest
    assert methods == {name for name in methods if f"sim_world.{name}(" in PAGE}
