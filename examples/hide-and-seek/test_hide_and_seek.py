"""The game in the simulated garden; docs/testing-your-robot.md explains the fixtures."""

import random
from pathlib import Path

import pytest
from hide_and_seek import MISSION, count_to_ten, score

from behaviors.executive import Ending, Report
from behaviors.target_queue import TargetOutcome, TargetProgress

GARDEN = Path(__file__).with_name("garden.toml")
SPOTS_MM = [(2400, 300), (3700, 1200), (2200, 2700), (1200, 300), (1300, 2700), (3600, 400)]


@pytest.mark.parametrize("seed", range(1))
@pytest.mark.sim_world(GARDEN)
def test_everyone_is_found_wherever_they_hide(seed, sim_world, sim_brick):
    hiders = ("lena", "fox", "rilakkuma")
    for name, (x_mm, y_mm) in zip(hiders, random.Random(seed).sample(SPOTS_MM, len(hiders)), strict=True):
        sim_world.put(name, x_mm=x_mm, y_mm=y_mm)
    report = sim_world.run_mission(sim_brick, MISSION)
    assert score(report)[-1] == "The robot wins."
    assert sim_world.truth.contacts <= 2  # it may brush a hedge beside its beam, and backs off


def test_who_was_not_found_wins():
    found = TargetProgress("lena", TargetOutcome.REACHED, 12.4)
    missed = TargetProgress("fox", TargetOutcome.GIVEN_UP, 80.0)
    lines = score(Report(Ending.GIVEN_UP, [found, missed], [], 80.0))
    assert lines == ["lena: found after 12 s", "fox: not found", "The hiders win."]


def test_it_counts_to_ten_before_it_looks(sim_world):
    count_to_ten(sim_world.address)
    assert 10 <= sim_world.time_s < 11
