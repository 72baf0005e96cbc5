"""The comparison on a slow link runs both programs; its figures depend on the machine."""

import importlib.util

import pytest

from nxtdrive.tools.dev import bench_sensors


@pytest.mark.nightly
@pytest.mark.skipif(importlib.util.find_spec("pty") is None, reason="needs pseudo-terminals")
def test_both_programs_read_distances_on_the_same_link(monkeypatch):
    monkeypatch.setattr(bench_sensors, "READINGS", 4)
    figures = list(bench_sensors.measure_sensors())
    assert [figure.unit for figure in figures][:2] == ["1/s", "ms"]
    assert all(figure.value > 0 for figure in figures if figure.unit)
    if importlib.util.find_spec("nxt"):
        assert figures[0].peer > 0
        assert figures[-1].met is not None
