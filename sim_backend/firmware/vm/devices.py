"""The brick as a program sees it: fields of ports, and the modules for system calls.

Source: LEGO's executable file specification (numbers of the fields).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import TypeVar

from firmware_protocol.iomap import OutputFlag
from sim_backend.firmware.button import ButtonModule
from sim_backend.firmware.cint import s8, s32
from sim_backend.firmware.input import InputModule
from sim_backend.firmware.io_map import LiveMap
from sim_backend.firmware.loader import Loader
from sim_backend.firmware.low_speed import LowSpeedModule
from sim_backend.firmware.mailboxes import Mailboxes
from sim_backend.firmware.output import Output, OutputModule
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import UiModule

FIRST_FIELD = 0xC000
"""First argument that is a field of a port, not a variable."""

_OUTPUTS = 0x200
INPUT_FIELDS = ("type", "mode", "raw", "normalized", "scaled", "invalid")
OUTPUT_FIELDS = (
    "flags",
    "mode",
    "power",
    "actual_speed",
    "count",
    "tacho_limit",
    "run_state",
    "turn",
    "regulation",
    "overloaded",
    "p_gain",
    "i_gain",
    "d_gain",
    "block",
    "rotation",
)
"""Attribute names of the fields of a port, in the order of their numbers."""

_SIGNED_OUTPUT_FIELDS = ("power", "turn")
_LIVE = ("actual_speed", "count", "overloaded", "block", "rotation")
"""Read-only fields of the motor's control."""

_INVALID = 5

T = TypeVar("T")


class NoSuchField(LookupError):
    """A program accessed a port or field that does not exist."""


@dataclass(frozen=True)
class Devices:
    """The modules of the brick, and the running program's mailboxes."""

    output: OutputModule
    input: InputModule
    low_speed: LowSpeedModule
    sound: SoundModule
    ui: UiModule
    button: ButtonModule
    loader: Loader
    maps: Mapping[str, LiveMap]
    random: Random
    mailboxes: Mailboxes
    started_ms: int

    def get_field(self, argument: int) -> int:
        """The field an argument names."""
        inputs, port, field = _split(argument)
        return self.get_input(port, field) if inputs else self.get_output(port, field)

    def put_field(self, argument: int, value: int) -> None:
        """Set the field an argument names."""
        inputs, port, field = _split(argument)
        (self.put_input if inputs else self.put_output)(port, field, value)

    def get_input(self, port: int, field: int) -> int:
        """A field of an input port, 0..3."""
        return int(getattr(_at(self.input.ports, port), _name(INPUT_FIELDS, field)))

    def put_input(self, port: int, field: int, value: int) -> None:
        """Set a field of an input port; types, modes and validity take effect in the next pass."""
        name = _name(INPUT_FIELDS, field)
        setattr(_at(self.input.ports, port), name, bool(value) if field == _INVALID else value & 0xFFFF)
        self.input.wake()

    def get_output(self, port: int, field: int) -> int:
        """A field of an output port, 0..2."""
        output = _at(self.output.outputs, port)
        name = _name(OUTPUT_FIELDS, field)
        return int(getattr(output.control if name in _LIVE else output, name))

    def put_output(self, port: int, field: int, value: int) -> None:
        """Set a field of an output port; flags are added to pending ones."""
        output: Output = _at(self.output.outputs, port)
        name = _name(OUTPUT_FIELDS, field)
        if name == "flags":
            output.flags |= value & int(~OutputFlag(0))
        elif name == "tacho_limit":
            output.tacho_limit = s32(value) & 0xFFFF_FFFF
        elif name not in _LIVE:
            setattr(output, name, s8(value) if name in _SIGNED_OUTPUT_FIELDS else value & 0xFF)
        self.output.wake()


def _split(argument: int) -> tuple[bool, int, int]:
    """Whether an input field is meant, the port, and the field."""
    index = argument - FIRST_FIELD
    if index < _OUTPUTS:
        return True, *divmod(index, len(INPUT_FIELDS))
    return False, *divmod(index - _OUTPUTS, len(OUTPUT_FIELDS))


def _name(fields: tuple[str, ...], field: int) -> str:
    if not 0 <= field < len(fields):
        raise NoSuchField(field)
    return fields[field]


def _at(ports: Sequence[T], port: int) -> T:
    if not 0 <= port < len(ports):
        raise NoSuchField(port)
    return ports[port]
