"""The benchmark of a class measures what it names."""

from __future__ import annotations

import pytest

from nxtdrive.tools.dev.bench_classroom import measure_classroom


@pytest.mark.slow
def test_every_figure_is_measured():
    figures = {figure.name: figure.value for figure in measure_classroom(robots=2, seconds=0.5, settle_s=0.0)}
    assert len(figures) == 8
    assert all(value > 0 for value in figures.values())
