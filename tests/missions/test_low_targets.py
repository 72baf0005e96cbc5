"""A target lower than the sonar is reached though the sonar measures an object behind it; one of wrong size is not."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from behaviors.events import Reason
from behaviors.journal import RecordKind
from behaviors.mission import Mission
from behaviors.plausibility import passes_over
from behaviors.ports import Sighting
from nxtdrive.vision.detection import Detection
from nxtdrive.vision.geometry import Mounting, Pinhole

RED = Path(__file__).parents[1] / "hil" / "red.png"
LENS_MM, SONAR_MM = 200.0, 90.0
WORLD = """\
title = "A low thing in the middle"
[floor]
size_mm = [3000, 2400]
[robot]
start_mm = [600, {aside_mm}]
[[pictures]]
name = "red"
file = "{file}"
size_mm = [100, {height_mm}]
at_mm = [1400, 1200]
centre_height_mm = {centre_mm}
facing_deg = 180
"""


def _mission(height_mm: float) -> Mission:
    target = {"detector": "color", "color": "red", "height_mm": height_mm}
    return Mission.model_validate(
        {"mission": {"name": "low", "targets": ["red"], "time_limit_s": 15}, "target": {"red": target}}
    )


def _world(folder: Path, height_mm: float, aside_mm: float = 1200.0) -> str:
    path = folder / "low.toml"
    text = WORLD.format(file=RED.as_posix(), height_mm=height_mm, centre_mm=height_mm / 2, aside_mm=aside_mm)
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize(("height_mm", "aside_mm"), [(55.0, 1250.0), (60.0, 1000.0), (60.0, 1200.0), (80.0, 1350.0)])
def test_an_echo_from_behind_a_low_target_contradicts_nothing(perform, tmp_path, height_mm, aside_mm):
    done = perform(_world(tmp_path, height_mm, aside_mm), _mission(height_mm))
    assert done.report.achieved
    assert not done.of(RecordKind.TRANSITION, reason=Reason.RANGE_MISMATCH)
    assert done.of(RecordKind.TRANSITION, to="reached")[0].data["evidence"]["passes_over"]


@pytest.mark.slow
@pytest.mark.parametrize("height_mm", [110.0, 160.0])
def test_one_that_only_looks_low_is_still_contradicted(perform, tmp_path, height_mm):
    done = perform(_world(tmp_path, height_mm), _mission(height_mm / 2.2))
    assert not done.report.achieved


def _seen(true_mm: float, true_height_mm: float, said_mm: float, tilt_deg: float = 0.0) -> Sighting:
    """Return the sighting of something on the floor whose height is said to be another one."""
    pinhole = Pinhole(320, 277.0, Mounting(tilt_deg=tilt_deg))
    tilt = math.radians(tilt_deg)
    rows = []
    for above_mm in (true_height_mm - LENS_MM, -LENS_MM):
        ahead = true_mm * math.cos(tilt) + above_mm * math.sin(tilt)
        rows.append(120.0 - 277.0 * (above_mm * math.cos(tilt) - true_mm * math.sin(tilt)) / ahead)
    top, bottom = rows
    found = Detection((160 - (bottom - top) / 4, top, (bottom - top) / 2, bottom - top), 1.0)
    bearing_deg, distance_mm = pinhole.locate(found, said_mm)
    edges_mm = pinhole.edges_mm(found, said_mm)
    return Sighting("box", bearing_deg, distance_mm, 1.0, 0.0, (0, 0, 9, 9), edges_mm=edges_mm)


@pytest.mark.parametrize("tilt_deg", [-15.0, 0.0, 10.0])
@pytest.mark.parametrize("height_mm", [20.0, 60.0, 85.0, 120.0, 297.0])
@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 0.95, 1.0, 1.05, 1.5])
def test_only_what_is_really_lower_than_the_sonar_lets_the_echo_pass(height_mm, share, tilt_deg):
    seen = _seen(600.0, height_mm, share * height_mm, tilt_deg)
    assert seen.edges_mm == pytest.approx((-share * LENS_MM, share * (height_mm - LENS_MM)), abs=1.0)
    low = height_mm < SONAR_MM and 0.9 < share < 1.1
    assert passes_over(1500.0, seen.distance_mm, seen.edges_mm, LENS_MM, SONAR_MM) is low
    assert not passes_over(
        seen.distance_mm - 50.0, seen.distance_mm, seen.edges_mm, LENS_MM, SONAR_MM
    )  # something stands before it


def test_where_the_edges_are_not_known_the_sonar_decides():
    assert not passes_over(1500.0, 400.0, None, LENS_MM, SONAR_MM)
