"""The simulated brick against recorded programs: instructions of all kinds, clumps, and programs compiled from NXC."""

from pathlib import Path

import pytest

from nxtdrive.tools.conformance.recording import load
from nxtdrive.tools.conformance.replay import replay

RECORDING = Path(__file__).parents[2] / "golden" / "programs.jsonl"

RECORDED = ("1.05", "1.29")
SCENARIOS = {firmware: load(RECORDING, firmware) for firmware in RECORDED}
CASES = [(firmware, name) for firmware in RECORDED for name in SCENARIOS[firmware]]


@pytest.mark.slow
@pytest.mark.parametrize(("firmware", "name"), CASES)
def test_programs_do_what_they_did_on_the_firmware(firmware, name):
    assert replay(name, SCENARIOS[firmware][name].steps, firmware).differences == []
