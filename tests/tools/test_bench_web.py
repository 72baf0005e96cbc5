"""The benchmark of the page's server measures what it names."""

from __future__ import annotations

import pytest

from nxtdrive.tools.dev.bench_web import installed_mb, measure_web


@pytest.mark.nightly
def test_every_figure_is_measured():
    figures = {figure.name: figure.value for figure in measure_web(seconds=1.0, drives=3)}
    assert figures["modules of the extra web that `import nxtdrive` loads"] == 0
    assert 0 < figures["page, delay of a picture p50, clients: 1"] < 1000
    assert figures["page, pictures a second, clients: 1"] > 5
    assert figures["joystick message to telegram p50, above the link's latency"] > -5


def test_the_size_of_an_extra_is_that_of_its_packages():
    assert 1 < installed_mb("web") < 50
