"""The simulated brick against 160 recorded conversations with LEGO's firmware."""

from pathlib import Path

import pytest

from sim_backend.conformance import load, replay
from sim_backend.firmware.brick import FIRMWARES

RECORDING = Path(__file__).parents[1] / "golden" / "firmware.jsonl"

PROGRAMS = {
    "message_memory",
    "message_program",
    "program_double_stop",
    "program_ext",
    "program_file_busy",
    "program_lifecycle",
    "program_nonexec",
    "program_resets_devices",
    "program_start_lost",
    "program_wildcard",
    "sleep_program",
}
STRAY_MEMORY = {"i2c_sizes"}
"""Its last line shows the memory behind a buffer that a write of 0 bytes sends for ever."""

NOT_YET = PROGRAMS | STRAY_MEMORY
OTHER_REQUESTS = {("1.05", "data_files")}
"""The recording took a handle out of this firmware's reply into a request, but keeps the other firmware's requests."""

SCENARIOS = {firmware: load(RECORDING, firmware) for firmware in FIRMWARES}
CASES = [
    (firmware, name)
    for firmware in FIRMWARES
    for name in SCENARIOS[firmware]
    if name not in NOT_YET and (firmware, name) not in OTHER_REQUESTS
]


@pytest.mark.parametrize(("firmware", "name"), CASES)
def test_it_answers_and_moves_as_the_firmware_did(firmware, name):
    assert replay(name, SCENARIOS[firmware][name], firmware).difference == ""


@pytest.mark.parametrize("name", sorted(NOT_YET))
def test_what_is_listed_as_missing_is_missing(name):
    reports = [replay(name, SCENARIOS[firmware][name], firmware) for firmware in FIRMWARES]
    assert any(report.difference for report in reports), "it works now: take it off the list"


def test_all_motor_scenarios_are_held():
    motors = [name for name in SCENARIOS["1.29"] if name.startswith("motor_")]
    assert len(motors) == 79
    assert NOT_YET.isdisjoint(motors)


def test_a_difference_is_named_by_its_field():
    steps = SCENARIOS["1.29"]["identity"]
    assert "firmware_minor" in replay("identity", steps, "1.05").difference
