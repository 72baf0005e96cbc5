"""The bench of the simulated firmware measures programs that run; its figures depend on the machine."""

import pytest

from firmware_protocol.iomap import ProgramStatus
from nxtdrive.tools.dev import bench_firmware


def test_every_program_of_the_bench_runs_on():
    for name, content in bench_firmware.programs().items():
        brick = bench_firmware.brick_with(content)
        brick.tick(50)
        assert brick.command.status == ProgramStatus.RUNNING, name


@pytest.mark.slow
def test_every_figure_is_there_and_has_its_goal(monkeypatch):
    monkeypatch.setattr(bench_firmware, "REPEATS", 1)
    for name in ("TELEGRAMS", "PASSES", "PROGRAM_MS"):
        monkeypatch.setattr(bench_firmware, name, 50)
    figures = list(bench_firmware.measure_firmware())
    assert all(figure.value > 0 for figure in figures)
    assert [figure.goal for figure in figures if figure.goal] == [">= 150000", ">= 50", "<= 6", ">= 200", ">= 200"]
