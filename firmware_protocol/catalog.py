"""All declared commands: lookup by name or opcode, and descriptions of their fields."""

from __future__ import annotations

from difflib import get_close_matches
from enum import IntFlag
from typing import Any

# Importing these modules declares their commands.
from firmware_protocol import direct, enhanced, system  # noqa: F401
from firmware_protocol.enums import OpenEnum
from firmware_protocol.errors import LocalProtocolError
from firmware_protocol.telegram import COMMANDS, Command, Kind
from firmware_protocol.wire import Block, Number, Scalar, Text, WireType

AnyCommand = type[Command[Any]]

ALL_COMMANDS: tuple[AnyCommand, ...] = tuple(COMMANDS[key] for key in sorted(COMMANDS))
"""Direct commands first, each kind in the order of the opcodes, independent of the order of imports."""

DESTRUCTIVE: frozenset[AnyCommand] = frozenset(
    {
        system.Boot,
        system.BluetoothFactoryReset,
        system.CropDataFile,
        system.Delete,
        system.DeleteUserFlash,
        system.IOMapWrite,
    }
)
"""Commands that erase something, change the firmware's memory or end it: never suggested for a mistyped name."""

_BY_NAME = {command.__name__.lower(): command for command in ALL_COMMANDS}


def command_named(name: str) -> AnyCommand:
    """Return the command of this name, ignoring case.

    Raises:
        LocalProtocolError: There is none; the message names similar ones.
    """
    found = _BY_NAME.get(name.lower())
    if found is None:
        safe = {command.__name__.lower(): command.__name__ for command in ALL_COMMANDS if command not in DESTRUCTIVE}
        close = [safe[key] for key in get_close_matches(name.lower(), safe)]
        hint = f"Did you mean {' or '.join(close)}?" if close else f"There are {', '.join(safe.values())}."
        raise LocalProtocolError(f"there is no command {name!r}.", remedy=hint)
    return found


def command_of(kind: Kind, opcode: int) -> AnyCommand | None:
    """Return the command with this opcode, or that a reply answers; no opcode is both direct and system."""
    kinds = (Kind.DIRECT, Kind.SYSTEM) if kind == Kind.REPLY else (kind,)
    return next((COMMANDS[each, opcode] for each in kinds if (each, opcode) in COMMANDS), None)


def choices(wire: WireType) -> dict[str, int]:
    """Return the named values of a field by name; empty for plain numbers, text and bytes."""
    enum = wire.members.enum if isinstance(wire, Number) else None
    if isinstance(enum, type) and issubclass(enum, OpenEnum | IntFlag):
        return {name: int(member) for name, member in enum.__members__.items()}
    return {"no": 0, "yes": 1} if isinstance(wire, Number) else {}


def describe(wire: WireType, unit: str = "") -> str:
    """Describe a field's type, such as ``u16 ms`` or ``text[20]``."""
    match wire:
        case Text(size=size):
            return f"text[{size}]"
        case Block(size=size):
            return f"bytes[{size}]"
        case Scalar(minimum=minimum, maximum=maximum):
            bits = (maximum - minimum).bit_length()
            return f"{'s' if minimum < 0 else 'u'}{bits} {unit}".rstrip()
        case Number(members=members):
            return members.enum.__name__ if isinstance(members.enum, type) else "yes/no"
        case _:
            return f"up to {wire.limit} bytes"
