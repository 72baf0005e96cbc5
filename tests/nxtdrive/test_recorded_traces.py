"""Every recording in ``tests/traces``: a user's bug report becomes a test by adding its file there.

A recording of a command of ours that needs nothing but the brick is run again; the brick is the recording.
"""

from pathlib import Path

import pytest

from firmware_protocol.catalog import command_of
from firmware_protocol.dialogue import Dialogue
from firmware_protocol.errors import BrickError
from firmware_protocol.telegram import NO_REPLY, Kind
from nxtdrive.cli.main import DONE, NOT_ACHIEVED, REFUSED, main
from nxtdrive.transports.trace_file import read_trace

TRACES = sorted((Path(__file__).parents[1] / "traces").glob("*.nxttrace"))
REPEATABLE = {"info", "send", "files", "program", "screenshot"}


def _name(path):
    return path.stem


@pytest.mark.parametrize("path", TRACES, ids=_name)
def test_every_reply_is_understood_as_the_answer_to_its_request(path):
    for exchange in read_trace(path).exchanges():
        kind = Kind(exchange.request[0] & ~NO_REPLY)
        command = command_of(kind, exchange.request[1])
        assert command is not None, f"unknown request {exchange.request.hex()} at {exchange.time_s} s"
        if exchange.request[0] & NO_REPLY or not exchange.replies:
            continue
        dialogue = Dialogue()
        dialogue.open(command.decode(exchange.request), now=0, timeout_s=1)
        try:
            answers = [dialogue.feed(reply) for reply in exchange.replies]
        except BrickError:
            continue  # a refusal is an answer
        assert answers[-1] is not None, f"at {exchange.time_s} s"


@pytest.mark.parametrize("path", [path for path in TRACES if set(read_trace(path).command[:1]) & REPEATABLE], ids=_name)
def test_the_recorded_command_asks_the_same_and_ends_well(path, here, capsys):
    code = main([*read_trace(path).command, "--nxt", f"replay://{path}"])
    assert code in (DONE, NOT_ACHIEVED, REFUSED), capsys.readouterr().err


def test_there_are_recordings():
    assert len(TRACES) >= 3
