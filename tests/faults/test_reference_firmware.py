"""Damaged programs on the simulated brick and on a reference firmware, here another simulated brick."""

from __future__ import annotations

import sys

import pytest

from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction
from nxtdrive.tools.dev.faults.campaign import Tally
from nxtdrive.tools.dev.faults.reference_firmware import campaign, compare, parse

FIRMWARE = """
import sys
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick

bench = Bench(SimBrick(firmware=sys.argv[1]))
for line in sys.stdin.read().split("\\n")[:-1]:
    print((bench.control(line) if line.startswith("!") else bench.telegram(line)){change})
"""


@pytest.fixture
def tally(tmp_path, monkeypatch):
    """Outcomes of three programs with a reference whose answers are changed."""
    monkeypatch.setattr("nxtdrive.tools.dev.faults.reference_firmware.HANG_S", 100)

    def run(change: str = "") -> Tally:
        script = tmp_path / "reference.py"
        script.write_text(FIRMWARE.replace("{change}", change))
        return campaign(parse([f"1.05={sys.executable} {script} 1.05"], [])).run(1, range(3))

    return run


@pytest.mark.slow
def test_equal_answers_are_the_same_in_all(tally):
    found = tally()
    assert found.violations == []
    assert found.outcomes.total() == 3
    assert all(outcome.startswith("1.05: same in all") for outcome in found.outcomes)
    assert found.longest_s > 0


@pytest.mark.slow
def test_another_status_is_a_violation(tally):
    found = tally("[:-2] + 'aa'")
    assert len(found.violations) == 3
    assert "instead of aa" in found.violations[0].text


@pytest.mark.slow
def test_a_firmware_without_answers_is_not_a_violation(tally):
    assert tally(" and sys.exit(1)").outcomes == {"1.05: LEGO's firmware hangs or crashes": 3}


@pytest.mark.slow
def test_other_random_numbers_are_not_a_difference(tmp_path, monkeypatch):
    monkeypatch.setattr("nxtdrive.tools.dev.faults.reference_firmware.HANG_S", 100)
    script = tmp_path / "reference.py"
    script.write_text(FIRMWARE.replace("{change}", "").replace("sys.argv[1]", "sys.argv[1], seed=7"))
    variables = Variables()
    number, _ = variables.call(0)
    program = assemble(variables, [instruction(0x28, 24, number), instruction(0x25, 0)])
    (reference,) = parse([f"1.29={sys.executable} {script} 1.29"], [])
    assert compare(reference, program)[0] == "random numbers"
