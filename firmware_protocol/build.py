"""Build commands from typed words: a name and ``field=value``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from firmware_protocol.catalog import AnyCommand, choices, command_named, describe
from firmware_protocol.errors import LocalProtocolError
from firmware_protocol.telegram import Command
from firmware_protocol.wire import Number, Scalar, Text, WireType
from firmware_protocol.wording import did_you_mean

COUNTING_FIELDS = ("size", "tx_length")
"""Fields that count the bytes of the command's last field; computed if they are left out."""

TEXT_PREFIX = "text:"
"""Prefix of bytes given as text; without it they are hex digits."""


def build(name: str, words: Iterable[str] = ()) -> Command[Any]:
    """Build the command `name` from words such as ``port=A``.

    Numbers are decimal or, with ``0x``, hexadecimal; named values are given by name, several flags joined by ``|``;
    bytes are hex digits, or text after ``text:``. A field that counts the bytes of the last one may be left out.

    Raises:
        LocalProtocolError: There is no such command or field, a field is missing or given twice, or a value does not
            fit; the message lists what is valid.
    """
    command = command_named(name)
    wires = command.layout.wires
    values: dict[str, Any] = {}
    for word in words:
        field, equals, text = word.partition("=")
        if not equals or field not in wires:
            raise LocalProtocolError(_unknown(command, word, field if equals else ""), remedy=usage(command))
        if field in values:
            raise LocalProtocolError(f"{command.__name__}.{field} is given twice.", remedy=usage(command))
        values[field] = _value(command, field, wires[field], text)
    tail = command.layout.tail
    for field in COUNTING_FIELDS:
        if field in wires and tail in values:
            values.setdefault(field, len(values[tail]))
    missing = [field for field in wires if field not in values]
    if missing:
        raise LocalProtocolError(f"{command.__name__} still needs {', '.join(missing)}.", remedy=usage(command))
    made: Command[Any] = command(**values)
    made.encode()
    return made


def usage(command: AnyCommand) -> str:
    """Return how the command is typed, in one sentence."""
    layout = command.layout
    if not layout.wires:
        return f"{command.__name__} takes no fields."
    fields = [
        f"{name}=<{'|'.join(choices(wire)) or describe(wire, layout.units[name])}>"
        for name, wire in layout.wires.items()
    ]
    return f"Usage: {command.__name__} {' '.join(fields)}."


def _unknown(command: AnyCommand, word: str, field: str) -> str:
    if not field:
        return f"{word!r} is not of the form field=value."
    return f"{command.__name__} has no field {field!r}. {did_you_mean(field, command.layout.wires)}".rstrip()


def _value(command: AnyCommand, field: str, wire: WireType, text: str) -> Any:  # noqa: ANN401 - the field's type
    try:
        match wire:
            case Scalar():
                return _number(text)
            case Number():
                return _named(wire, text)
            case Text():
                return text
            case _ if text.startswith(TEXT_PREFIX):
                return text.removeprefix(TEXT_PREFIX).encode("latin-1")
            case _:
                return bytes.fromhex(text)
    except ValueError as reason:
        raise LocalProtocolError(f"{command.__name__}.{field}: {reason}.", remedy=usage(command)) from None


def _number(text: str) -> int:
    try:
        return int(text, 0)
    except ValueError:
        raise ValueError(f"{text!r} is not a whole number") from None


def _named(wire: Number, text: str) -> Any:  # noqa: ANN401 - the enum's member
    known = {name.lower(): value for name, value in choices(wire).items()}
    number = 0
    for part in text.split("|"):
        name = part.strip().lower()
        if name in known:
            number |= known[name]
        else:
            try:
                number |= int(name, 0)
            except ValueError:
                raise ValueError(f"{part!r} is neither a number nor one of {', '.join(choices(wire))}") from None
    return wire.members[wire.to_wire(number)]
