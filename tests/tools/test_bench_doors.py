"""Every door is measured with both programs; the figures depend on the machine."""

import importlib.util
import sys

import pytest

from nxtdrive.tools.dev.bench_doors import measure_doors


@pytest.mark.nightly
def test_every_door_the_passes_and_the_memory_are_measured():
    figures = {figure.name: figure for figure in measure_doors(round_trips=3, repeats=1, passes=50)}
    memory = ["memory"] if sys.platform.startswith("linux") else []
    for words in ["in process", "serial", "tcp", "nxt-server", "pyusb", "requests over USB", "passes", *memory]:
        (found,) = (name for name in figures if words in name)
        assert figures[found].value > 0
    if importlib.util.find_spec("nxt"):
        for door in ("serial", "nxt-server", "USB (sim exec)"):
            assert figures[f"requests over {door}"].peer > 0
