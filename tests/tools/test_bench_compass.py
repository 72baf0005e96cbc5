"""The claims of docs/motion.md about the compass, in one room."""

import statistics

import pytest

from nxtdrive.tools.dev import bench_compass
from nxtdrive.tools.dev.bench_compass import turned_error_deg, walked_errors

SLIPPERY = 100
"""Seed of a room in which the wheels lose a fifth of each turn."""


@pytest.mark.slow
def test_ten_turns_near_iron():
    assert turned_error_deg(compass=True, iron=True) < 4


@pytest.mark.nightly
def test_a_walk(monkeypatch):
    monkeypatch.setattr(bench_compass, "ROOMS", (SLIPPERY,))
    monkeypatch.setattr(bench_compass, "LEGS", 8)
    wheels, compass = (statistics.median(walked_errors(compass=use, iron=False)[0]) for use in (False, True))
    assert compass < 4 < 10 < wheels
