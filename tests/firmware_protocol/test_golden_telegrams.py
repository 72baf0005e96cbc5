"""The declarations against replies of the real firmware: tests/golden/firmware.jsonl, docs/firmware.md section 0."""

import json
from pathlib import Path
from typing import NamedTuple

import pytest

from firmware_protocol.catalog import AnyCommand, command_of
from firmware_protocol.errors import LocalProtocolError
from firmware_protocol.telegram import NO_REPLY, Kind

GOLDEN = Path(__file__).parents[1] / "golden" / "firmware.jsonl"

TOO_LONG = {
    ("i2c_sizes", "LSWrite"),
    ("message_noprogram", "MessageWrite"),
    ("message_program", "MessageWrite"),
    ("usb_long_packet", "MessageWrite"),
    ("program_lifecycle", "StartProgram"),
    ("file_names", "OpenWrite"),
    ("file_names", "OpenRead"),
    ("file_names", "FindFirst"),
    ("file_names", "Delete"),
    ("brick_name", "SetBrickName"),
}
"""Where the recording tries what no client should send: names and data longer than the firmware takes."""


class Exchange(NamedTuple):
    scenario: str
    command: AnyCommand
    request: bytes
    reply: bytes


@pytest.fixture(scope="module")
def exchanges():
    """Each recorded request of full length whose opcode is declared, with its reply."""
    found = []
    for record in map(json.loads, GOLDEN.read_text().splitlines()):
        request = bytes.fromhex(record.get("request", ""))
        if len(request) < 2 or request[0] & ~NO_REPLY not in (Kind.DIRECT, Kind.SYSTEM):
            continue
        command = command_of(Kind(request[0] & ~NO_REPLY), request[1])
        if command is not None and len(request) >= 2 + command.layout.size:
            found.append(Exchange(record["scenario"], command, request, bytes.fromhex(record["reply"])))
    assert len(found) > 1900
    return found


def test_every_full_request_is_encoded_as_it_was_recorded(exchanges):
    refused = set()
    for scenario, command, request, _ in exchanges:
        whole = request if command.layout.tail else request[: 2 + command.layout.size]
        try:
            assert command.decode(request).encode(want_reply=not request[0] & NO_REPLY) == whole
        except LocalProtocolError:
            refused.add((scenario, command.__name__))
    assert refused == TOO_LONG


def test_every_good_reply_is_read_and_written_as_it_was_recorded(exchanges):
    good = [each for each in exchanges if len(each.reply) > 2 and each.reply[2] in each.command.success]
    for scenario, command, request, reply in good:
        assert command.decode_reply(reply).pack() == reply[3:]
        head = command.reply_head(request)
        assert reply[3:].startswith(head[3:]), (
            f"{scenario}: {command.__name__} does not repeat what its request predicts"
        )
    assert len(good) > 1800
