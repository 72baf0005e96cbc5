"""Guards against firmware traps that no other test module covers; docs/traps.md lists all of them."""

import json
import re
from pathlib import Path

import pytest

from firmware_protocol.catalog import ALL_COMMANDS
from firmware_protocol.direct import SetOutputState, StartProgram
from firmware_protocol.enums import RegulationMode
from firmware_protocol.iomap import OUTPUT
from firmware_protocol.system import IOMapWrite, SetBrickName
from firmware_protocol.telegram import NO_REPLY, Kind

ROOT = Path(__file__).parents[2]
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in (ROOT / "docs" / "traps.md").read_text(encoding="utf-8").splitlines()
    if re.match(r"\| \d+ \|", line)
]
RECORDED = {
    json.loads(line)["scenario"]
    for line in (ROOT / "tests" / "golden" / "firmware.jsonl").read_text(encoding="utf-8").splitlines()
}
UNROUTED = (0x8A, 0xA3)
"""Source: docs/firmware.md section 5."""


def test_every_trap_is_listed_once():
    facts = (ROOT / "docs" / "firmware.md").read_text(encoding="utf-8").split("\n## 1. ")[1].split("\n## ")[0]
    numbers = re.findall(r"^(\d+)\. ", facts, re.MULTILINE)
    assert [row[0] for row in ROWS] == numbers


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_every_trap_has_a_test_and_shows_in_the_recordings_it_names(row):
    assert re.fullmatch(r"`tests/\S+::test_\w+`", row[3]), "tests/architecture/test_documents.py looks for that test"
    assert set(re.findall(r"`(\w+)`", row[4])) <= RECORDED


def test_no_telegram_is_shorter_than_declared():
    assert len(StartProgram("a").encode()) == 2 + 20
    assert len(SetBrickName("a").encode()) == 2 + 16


def test_opcodes_that_legos_firmware_does_not_route_are_declared_for_the_one_that_does():
    declared = {command.opcode: command.since for command in ALL_COMMANDS if command.kind is Kind.SYSTEM}
    assert {declared[opcode] for opcode in UNROUTED if opcode in declared} == {"1.32"}


def _regulation(telegram):
    """Which regulation a telegram turns on; None if it concerns no motor."""
    kind = (telegram[0] & ~NO_REPLY, telegram[1])
    if kind == (SetOutputState.kind, SetOutputState.opcode):
        return SetOutputState.decode(telegram).regulation
    if kind == (IOMapWrite.kind, IOMapWrite.opcode):
        write = IOMapWrite.decode(telegram)
        if write.module_id == OUTPUT.module_id:
            index = (OUTPUT.field("RegMode").offset - write.offset) % 32
            return RegulationMode(write.data[index]) if index < len(write.data) else None
    return None


def test_the_rover_never_uses_the_sync_mode(lab):
    room = lab()
    sent, deliver = [], room.simulation.deliver

    def listen(telegram):
        sent.append(bytes(telegram))
        return deliver(telegram)

    room.simulation.deliver = listen
    rover = room.brick.rover()
    rover.straight(200)
    rover.turn(90)
    rover.drive(100, 30)
    room.brick.sleep(0.5)
    rover.stop()
    modes = {mode for mode in map(_regulation, sent) if mode is not None}
    assert RegulationMode.SPEED in modes
    assert RegulationMode.SYNC not in modes
