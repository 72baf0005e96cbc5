"""The benchmark of a classroom measures what it names."""

from __future__ import annotations

import pytest

from nxtdrive.tools.dev.bench_classroom import measure_classroom


@pytest.mark.nightly
def test_every_figure_is_measured():
    figures = {figure.name: figure.value for figure in measure_classroom(robots=2, seconds=0.5, settle_s=0.0)}
    cpu = [value for name, value in figures.items() if name.endswith("CPU of robots and server")]
    simulated = [value for name, value in figures.items() if name.endswith("slowest robot's simulated time")]
    assert (len(cpu), len(simulated)) == (4, 4)
    assert all(value > 0 for value in cpu)
    assert any(value > 0 for value in simulated)  # on a busy computer half a second may show no step of a robot
