"""The simulated brick against recorded conversations with LEGO's firmware."""

from pathlib import Path

import pytest

from nxtdrive.tools.conformance.recording import load
from nxtdrive.tools.conformance.replay import replay
from sim_backend.firmware.versions import FIRMWARES

GOLDEN = Path(__file__).parents[2] / "golden"
RECORDING, RANDOM = GOLDEN / "firmware.jsonl", GOLDEN / "firmware_files.jsonl"
"""One written by hand, and one of random conversations about files, programs, modules, names and framing."""

SCENARIOS = {firmware: load(RECORDING, firmware) | load(RANDOM, firmware) for firmware in FIRMWARES}
CASES = [(firmware, name) for firmware in FIRMWARES for name in SCENARIOS[firmware]]


@pytest.mark.slow
@pytest.mark.parametrize(("firmware", "name"), CASES)
def test_it_answers_and_moves_as_the_firmware_did(firmware, name):
    assert replay(name, SCENARIOS[firmware][name].steps, firmware).differences == []


def test_no_scenario_is_left_out():
    assert len(CASES) == (160 + 85) * len(FIRMWARES)


def test_a_difference_is_named_by_its_field():
    steps = SCENARIOS["1.29"]["identity"].steps
    assert "firmware_minor" in replay("identity", steps, "1.05").differences[0].text
