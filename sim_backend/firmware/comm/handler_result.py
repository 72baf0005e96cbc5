"""Declare the handlers of commands, and their results.

A method decorated with `handles` executes a command; `handlers_of` collects the bound methods of several objects in
the table that the comm module dispatches by.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple, TypeVar

from firmware_protocol.errors import LocalProtocolError
from firmware_protocol.status import Status
from firmware_protocol.telegram import Command, Reply
from firmware_protocol.wire import Number, Scalar, Text
from sim_backend.firmware.cint import fit


class HandlerResult(NamedTuple):
    """Result of a handler.

    Attributes:
        status: Third byte of the reply.
        payload: Bytes after the status.
        stale: Number of bytes after the payload that the handler leaves as earlier replies wrote them.
        sent: Bytes that the handler itself has sent in place of a reply, even if none was wanted; None if it sent none.
    """

    status: int = Status.OK
    payload: bytes = b""
    stale: int = 0
    sent: bytes | None = None


DONE = HandlerResult()
"""OK without payload."""

OUT_OF_RANGE = HandlerResult(Status.OUT_OF_RANGE)
"""No such port, or a field out of its range; without payload."""

Handlers = Mapping[type[Command[Any]], Callable[[Any], HandlerResult]]

_Command = TypeVar("_Command", bound=Command[Any])
_Method = Callable[[Any, _Command], HandlerResult]
_COMMANDS = "handled_commands"


def reply_with(reply: Reply, status: int = Status.OK) -> HandlerResult:
    """Return a result with a declared payload; as in the firmware, numbers keep the bits that fit and texts are cut."""
    try:
        payload = reply.pack()
    except LocalProtocolError:
        payload = type(reply)(*_fitting(reply)).pack()
    return HandlerResult(status, payload)


def _fitting(reply: Reply) -> Iterator[Any]:
    for value, wire in zip(reply.fields().values(), reply.layout.wires.values(), strict=True):
        if isinstance(wire, Scalar | Number):
            yield fit(wire.code, value)
        else:
            yield value[: wire.size - wire.closed] if isinstance(wire, Text) else value


def refuse_with_zeros(command: type[Command[Any]], status: int) -> HandlerResult:
    """Return a refusal that still carries the whole payload, all zeros."""
    return HandlerResult(status, bytes(command.reply_type.layout.size))


def handles(*commands: type[_Command]) -> Callable[[_Method[_Command]], _Method[_Command]]:
    """Register a method as the handler of commands."""

    def register(method: _Method[_Command]) -> _Method[_Command]:
        vars(method)[_COMMANDS] = commands
        return method

    return register


def handlers_of(*owners: object) -> Handlers:
    """Return all handlers of `owners` by command.

    Raises:
        TypeError: Two handlers are registered for one command.
    """
    handlers: dict[type[Command[Any]], Callable[[Any], HandlerResult]] = {}
    for owner in owners:
        for name, method in vars(type(owner)).items():
            for command in getattr(method, _COMMANDS, ()):
                if command in handlers:
                    raise TypeError(f"{command.__name__} has two handlers")
                handlers[command] = getattr(owner, name)
    return handlers
