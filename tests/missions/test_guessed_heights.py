"""Targets without `height_mm`, which a network finds, are reached whatever their true height."""

from __future__ import annotations

from pathlib import Path

import pytest

import nxtdrive
from nxtdrive.tools.dev.onnx_models import red_model

pytestmark = pytest.mark.slow

RED = Path(__file__).parents[1] / "hil" / "red.png"
ARRIVE_MM = 420.0
"""The default."""
MISSION = """\
[mission]
targets = ["red"]
time_limit_s = 30
[target.red]
detector = "onnx"
model = "red.onnx"
label = "{label}"
"""
ROOM = """\
title = "A red thing"
[floor]
size_mm = [{length_mm}, 2400]
[robot]
start_mm = [600, 1200]
heading_deg = 270
"""
BOX = """\
[[boxes]]
name = "red"
at_mm = [{x_mm}, 1200]
size_mm = [{depth_mm}, 200]
height_mm = {height_mm}
texture = "red_box"
"""
PICTURE = """\
[[pictures]]
name = "red"
file = "{file}"
size_mm = [100, 100]
at_mm = [1400, 1200]
centre_height_mm = {centre_mm}
facing_deg = 180
"""


def _arrival(folder: Path, thing: str, seed: int, *, length_mm: float = 2000, label: str = "box") -> dict[str, object]:
    (folder / "red.onnx").write_bytes(red_model({"labels": label}))
    (folder / "m.toml").write_text(MISSION.format(label=label), encoding="utf-8")
    (folder / "w.toml").write_text(ROOM.format(length_mm=length_mm) + thing, encoding="utf-8")
    (arrival,) = nxtdrive.run_mission(folder / "m.toml", nxt=f"sim://{folder / 'w.toml'}?seed={seed}").arrivals
    return arrival


def _is_there(arrival: dict[str, object]) -> bool:
    return bool(arrival["there"]) and 250.0 < float(arrival["true_mm"]) <= 1.1 * ARRIVE_MM


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("height_mm", [60, 100, 200, 350, 550])
def test_a_box_of_any_height_is_reached(tmp_path, height_mm, seed):
    """Its height is taken for 250 mm at first; the lowest gives no echo, and the highest is never seen whole."""
    arrival = _arrival(tmp_path, BOX.format(x_mm=1380, depth_mm=200, height_mm=height_mm), seed)
    assert _is_there(arrival)
    assert arrival["time_s"] < 10.0


@pytest.mark.parametrize("height_mm", [60, 100])
def test_a_low_box_is_reached_from_afar(tmp_path, height_mm):
    """From nearby more of its top is in view, so that it grows by more than it comes nearer."""
    arrival = _arrival(tmp_path, BOX.format(x_mm=3300, depth_mm=200, height_mm=height_mm), 1, length_mm=4000)
    assert _is_there(arrival)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("height_mm", [60, 100])
def test_the_echo_of_a_wall_close_behind_a_low_box_is_not_its_own(tmp_path, height_mm, seed):
    arrival = _arrival(tmp_path, BOX.format(x_mm=1560, depth_mm=60, height_mm=height_mm), seed, length_mm=1650)
    assert _is_there(arrival)


@pytest.mark.parametrize("centre_mm", [150, 200, 350])
def test_what_does_not_stand_on_the_floor_is_reached_as_well(tmp_path, centre_mm):
    arrival = _arrival(tmp_path, PICTURE.format(file=RED.as_posix(), centre_mm=centre_mm), 1)
    assert _is_there(arrival)


@pytest.mark.parametrize("label", ["chair", "cup", "mouse"])
def test_a_guess_that_is_far_too_large_or_too_small_does_not_matter(tmp_path, label):
    for folder, height_mm in ((tmp_path / "low", 60), (tmp_path / "high", 200)):
        folder.mkdir()
        assert _is_there(_arrival(folder, BOX.format(x_mm=1380, depth_mm=200, height_mm=height_mm), 1, label=label))
