"""Recorded conversations: where two differ, and having one again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher
from typing import TYPE_CHECKING

from firmware_protocol.direct import SetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.explain import explain
from firmware_protocol.iomap import OUTPUT
from firmware_protocol.system import IOMapWrite
from firmware_protocol.telegram import NO_REPLY
from nxtdrive.transports.replay import in_words
from nxtdrive.transports.trace_file import Entry, Exchange, Kind

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

PATIENCE_S = 1.0
"""How long a repeated request may take for an answer where the recorded one was answered."""


def differences(ours: Sequence[Exchange], theirs: Sequence[Exchange]) -> Iterator[str]:
    """What was asked in only one of two conversations, and what was answered differently, in words; times do not count.

    Args:
        ours: The one that is spoken of as "-".
        theirs: The other, "+".
    """
    matcher = SequenceMatcher(None, [e.request for e in ours], [e.request for e in theirs], autojunk=False)
    for tag, start, end, other_start, other_end in matcher.get_opcodes():
        if tag == "equal":
            for number in range(end - start):
                yield from _answered_differently(ours[start + number], theirs[other_start + number], start + number)
            continue
        yield from (f"- {start + i + 1}: {in_words(each.request)}" for i, each in enumerate(ours[start:end]))
        yield from (
            f"+ {other_start + i + 1}: {in_words(each.request)}" for i, each in enumerate(theirs[other_start:other_end])
        )


def _answered_differently(ours: Exchange, theirs: Exchange, index: int) -> Iterator[str]:
    mine, other = _outcomes(ours), _outcomes(theirs)
    if mine == other:
        return
    yield f"  {index + 1}: {in_words(ours.request)}"
    if len(ours.replies) == len(theirs.replies) == 1 and len(mine) == len(other) == 1:
        yield from _by_field(ours.replies[0], theirs.replies[0])
    else:
        yield f"      - {'; '.join(mine) or 'no answer'}"
        yield f"      + {'; '.join(other) or 'no answer'}"


def _by_field(mine: bytes, other: bytes) -> Iterator[str]:
    first, second = explain(mine), explain(other)
    if first.status != second.status or not first.fields or len(first.fields) != len(second.fields):
        yield f"      - {in_words(mine)}"
        yield f"      + {in_words(other)}"
        return
    for field, again in zip(first.fields, second.fields, strict=True):
        if field.raw != again.raw:
            yield f"      {field.name}: {field.text}, then {again.text}"


def _outcomes(exchange: Exchange) -> list[str]:
    return [entry.error or in_words(entry.telegram) or entry.kind for entry in exchange.outcome]


def repeat(exchanges: Sequence[Exchange], brick: Brick) -> list[Exchange]:
    """Send the same requests to a brick, at the same intervals; motors that are driven are stopped when it is closed.

    Raises:
        LinkError: The link is lost.
    """
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
            telegram = transport.receive(PATIENCE_S)
            if telegram is None:
                break
            outcome.append(Entry(brick.now() - started_s, Kind.FROM_BRICK, telegram))
        repeated.append(Exchange(sent_s, exchange.request, tuple(outcome)))
    return repeated


def _driven(request: bytes) -> list[OutputPort]:
    """The motors that a request may set in motion."""
    ports = [OutputPort.A, OutputPort.B, OutputPort.C]
    kind, opcode = request[0] & ~NO_REPLY, request[1] if len(request) > 1 else -1
    if (kind, opcode) == (SetOutputState.kind, SetOutputState.opcode):
        return [port for port in ports if request[2:3] in (bytes((port,)), bytes((OutputPort.ALL,)))]
    if (kind, opcode) == (IOMapWrite.kind, IOMapWrite.opcode):
        return ports if request[2:6] == OUTPUT.module_id.to_bytes(4, "little") else []
    return []
