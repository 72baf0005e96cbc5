"""A picture that hangs high or stands low leaves the frame before the robot has arrived; it is still reached."""

from __future__ import annotations

from pathlib import Path

import pytest

from behaviors.journal import RecordKind
from behaviors.mission import Mission
from sim_backend.bundled import PICTURES

LENA, RED = PICTURES / "lena.png", Path(__file__).parents[1] / "hil" / "red.png"
DETECTORS = {LENA: {"detector": "picture", "pictures": [str(LENA)]}, RED: {"detector": "color", "color": "red"}}
WORLD = """\
title = "A picture at an unusual height"
[floor]
size_mm = [3500, 2600]
[robot]
start_mm = [{start_mm}, 1200]
heading_deg = 90
[camera]
height_mm = {lens_mm}
[[pictures]]
name = "target"
file = "{file}"
at_mm = [2900, 1300]
size_mm = [{height_mm}, {height_mm}]
centre_height_mm = {centre_mm}
facing_deg = 180
"""


def _performed(perform, folder, *, height_mm, centre_mm, lens_mm=160, start_mm=700, picture=LENA):
    path = folder / "high.toml"
    values = {"height_mm": height_mm, "centre_mm": centre_mm, "lens_mm": lens_mm, "start_mm": start_mm}
    path.write_text(WORLD.format(file=picture.as_posix(), **values), encoding="utf-8")
    target = DETECTORS[picture] | {"height_mm": height_mm}
    mission = {"mission": {"name": "high", "targets": ["target"], "time_limit_s": 100}, "target": {"target": target}}
    return perform(str(path), Mission.model_validate(mission), geometric=picture == LENA)


@pytest.mark.parametrize(
    ("height_mm", "centre_mm", "lens_mm"), [(297, 400, 160), (148, 350, 160), (210, 500, 120), (148, 75, 230)]
)
def test_a_picture_at_any_height_is_reached_at_the_first_attempt(perform, tmp_path, height_mm, centre_mm, lens_mm):
    done = _performed(perform, tmp_path, height_mm=height_mm, centre_mm=centre_mm, lens_mm=lens_mm)
    assert done.report.achieved
    assert not done.of(RecordKind.CHOICE)
    x_mm, y_mm, _ = done.track[-1][1]
    assert 300 < ((2900 - x_mm) ** 2 + (1300 - y_mm) ** 2) ** 0.5 < 560  # the lens is 60 mm ahead of the axle


def test_one_that_is_cut_off_from_the_start_is_looked_at_from_farther_away(perform, tmp_path):
    done = _performed(perform, tmp_path, height_mm=297, centre_mm=300, start_mm=2350)
    assert done.report.achieved
    assert not done.of(RecordKind.TRANSITION, event="mistaken")


def test_a_robot_that_starts_too_near_to_see_all_of_it_soon_looks_from_farther_away(perform, tmp_path):
    """Where it stands it cannot learn more, so it does not wait there."""
    done = _performed(perform, tmp_path, height_mm=297, centre_mm=200, lens_mm=200, start_mm=2570)
    assert done.report.achieved
    (failed,) = done.of(RecordKind.TRANSITION, event="arrive_failed")
    assert failed.data["evidence"]["too_near"]
    assert failed.time_s - done.of(RecordKind.TRANSITION, event="doubted")[0].time_s < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("centre_mm", [350, 480])
def test_a_target_that_is_found_even_where_the_frame_cuts_it_off_is_reached_likewise(perform, tmp_path, centre_mm):
    done = _performed(perform, tmp_path, height_mm=210, centre_mm=centre_mm, picture=RED)
    assert done.report.achieved
    assert not done.of(RecordKind.CHOICE)
