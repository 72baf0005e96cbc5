"""Compare recorded conversations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher

from firmware_protocol.explain import explain
from nxtdrive.transports.replay import in_words
from nxtdrive.transports.trace_file import Exchange


def differences(ours: Sequence[Exchange], theirs: Sequence[Exchange]) -> Iterator[str]:
    """Describe requests that only one of two conversations has, and replies that differ; times do not count.

    Args:
        ours: Its lines are marked "-".
        theirs: Its lines are marked "+".
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
    form, other_form = ((each.title, each.status, len(each.fields), each.leftover) for each in (first, second))
    if form != other_form:
        yield f"      - {in_words(mine)}"
        yield f"      + {in_words(other)}"
        return
    for field, again in zip(first.fields, second.fields, strict=True):
        if field.raw != again.raw:
            yield f"      {field.name}: {field.text}, then {again.text}"


def _outcomes(exchange: Exchange) -> list[str]:
    return [entry.error or in_words(entry.telegram) or entry.kind for entry in exchange.outcome]
