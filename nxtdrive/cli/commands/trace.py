"""``nxtdrive trace``: recorded conversations with a brick."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.direct import SetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.iomap import OUTPUT
from firmware_protocol.printable import printable
from firmware_protocol.system import IOMapWrite
from firmware_protocol.telegram import NO_REPLY
from nxtdrive.cli.main import DONE, NOT_ACHIEVED
from nxtdrive.cli.options import add_action, add_brick_arguments, add_json_argument
from nxtdrive.cli.output import write_json, write_line, write_text

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.transports.trace_file import Entry, Exchange

REPLY_TIMEOUT_S = 1.0
"""Timeout of a repeated request whose recorded counterpart was answered."""

DESCRIPTION = """\
Look at the recorded traffic between a program and a brick. Every command that
opens a brick records it with --trace FILE.nxttrace; your program does so by
opening record://FILE.nxttrace?nxt=ADDRESS. --nxt replay://FILE.nxttrace then takes
the place of the brick: the same program and the same traffic without a brick.
Replaying to a brick moves its motors if the recorded program did."""
EXAMPLES = """\
  nxtdrive trace show talk.nxttrace
  nxtdrive trace show talk.nxttrace --full
  nxtdrive trace diff talk.nxttrace other.nxttrace
  nxtdrive trace replay talk.nxttrace --nxt usb://"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions and their arguments."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    show = add_action(actions, "show", "print a recording in words", _show)
    _add_file(show, "file")
    show.add_argument("--full", action="store_true", help="field by field")
    add_json_argument(show)
    diff = add_action(actions, "diff", "print where two recordings differ", _diff)
    _add_file(diff, "file")
    _add_file(diff, "other")
    replay = add_action(actions, "replay", "send the same requests to a brick and compare its replies", _replay)
    _add_file(replay, "file")
    add_brick_arguments(replay)


def _add_file(parser: argparse.ArgumentParser, name: str) -> None:
    parser.add_argument(name, metavar="FILE", type=Path, help="a recording, FILE.nxttrace")


def _show(args: argparse.Namespace) -> int:
    from nxtdrive.transports.trace_file import read_trace

    trace = read_trace(args.file)
    if not args.json:
        said = f", nxtdrive {' '.join(trace.command)}" if trace.command else ""
        write_line(f"{trace.address}{said}")
    for entry in trace.entries:
        if args.json:
            write_json(_as_json(entry))
        else:
            write_text(_in_words(entry, full=args.full))
    return DONE


def _in_words(entry: Entry, *, full: bool) -> str:
    from firmware_protocol.explain import explain
    from nxtdrive.transports.replay import in_words
    from nxtdrive.transports.trace_file import EntryKind

    arrow = {EntryKind.TO_BRICK: "->", EntryKind.FROM_BRICK: "<-"}.get(entry.kind, "!!")
    said = in_words(entry.telegram)
    if full and entry.telegram:
        said = str(explain(entry.telegram)).replace("\n", "\n" + " " * 14)
    failure = printable(f"{entry.error}: {entry.text}") if entry.error else ""
    reopened = "the link was opened again" if entry.kind is EntryKind.REOPENED else ""
    return f"{entry.time_s:9.3f} {arrow} " + ", ".join(filter(None, (said, failure, reopened)))


def _as_json(entry: Entry) -> dict[str, object]:
    from firmware_protocol.explain import explain
    from nxtdrive.cli.views.telegram import as_json

    value = json.loads(entry.to_json())
    return {**value, "explained": as_json(explain(entry.telegram))} if entry.telegram else value


def _diff(args: argparse.Namespace) -> int:
    from nxtdrive.transports.trace_diff import differences
    from nxtdrive.transports.trace_file import read_trace

    lines = differences(read_trace(args.file).exchanges(), read_trace(args.other).exchanges())
    return _report(lines, "the traffic is the same")


def _replay(args: argparse.Namespace) -> int:
    from nxtdrive.brick import Brick
    from nxtdrive.transports import open_transport
    from nxtdrive.transports.trace_diff import differences
    from nxtdrive.transports.trace_file import read_trace

    recorded = read_trace(args.file).exchanges()
    with Brick(open_transport(args.nxt)) as brick:  # not open_brick(), which sends a telegram of its own
        repeated = _repeat(recorded, brick)
    return _report(differences(recorded, repeated), f"all {len(recorded)} requests were answered as recorded")


def _repeat(exchanges: Sequence[Exchange], brick: Brick) -> list[Exchange]:
    """Send the same requests to a brick, at the same intervals; closing the brick stops the motors they start.

    Raises:
        LinkError: The link is lost.
    """
    from nxtdrive.transports.trace_file import Entry, EntryKind, Exchange

    transport, started_s = brick.link.transport, brick.now()
    repeated = []
    for exchange in exchanges:
        transport.sleep(started_s + exchange.time_s - brick.now())
        for port in _driven(exchange.request):
            brick.link.mark_driven(port)
        sent_s = brick.now() - started_s
        transport.send(exchange.request)
        outcome = []
        for _ in range(max(len(exchange.replies), not exchange.request[0] & NO_REPLY)):
            telegram = transport.receive(REPLY_TIMEOUT_S)
            if telegram is None:
                break
            outcome.append(Entry(brick.now() - started_s, EntryKind.FROM_BRICK, telegram))
        repeated.append(Exchange(sent_s, exchange.request, tuple(outcome)))
    return repeated


def _driven(request: bytes) -> list[OutputPort]:
    """List the motors that a request may set in motion."""
    ports = [OutputPort.A, OutputPort.B, OutputPort.C]
    kind, opcode = request[0] & ~NO_REPLY, request[1] if len(request) > 1 else -1
    if (kind, opcode) == (SetOutputState.kind, SetOutputState.opcode):
        return [port for port in ports if request[2:3] in (bytes((port,)), bytes((OutputPort.ALL,)))]
    if (kind, opcode) == (IOMapWrite.kind, IOMapWrite.opcode):
        return ports if request[2:6] == OUTPUT.module_id.to_bytes(4, "little") else []
    return []


def _report(lines: Iterator[str], otherwise: str) -> int:
    different = False
    for line in lines:
        different = True
        write_line(line)
    if not different:
        write_line(otherwise)
    return NOT_ACHIEVED if different else DONE
