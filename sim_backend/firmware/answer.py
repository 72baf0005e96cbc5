"""What the handlers of commands answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from firmware_protocol.status import Status
from firmware_protocol.telegram import Command, Reply


class Answer(NamedTuple):
    """What a handler answers.

    Attributes:
        status: Third byte of the reply.
        payload: What follows it.
    """

    status: int = Status.OK
    payload: bytes = b""


DONE = Answer()
"""OK without payload."""

OUT_OF_RANGE = Answer(Status.OUT_OF_RANGE)
"""No such port, or a field out of its range; without payload."""

Handler = Callable[[Any], Answer]
Handlers = Mapping[type[Command[Any]], Handler]


def answer(reply: Reply, status: int = Status.OK) -> Answer:
    """An answer with a declared payload."""
    return Answer(status, reply.pack())


def refuse_with_zeros(command: type[Command[Any]], status: int) -> Answer:
    """A refusal that still carries the whole payload, all zeros."""
    return Answer(status, bytes(command.reply_type.layout.size))
