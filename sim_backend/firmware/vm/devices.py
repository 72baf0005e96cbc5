"""The brick as a program sees it: fields of ports, and the modules for system calls.

Source: LEGO's executable file specification (numbers of the fields); docs/firmware.md section 8.4.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from random import Random

from firmware_protocol.iomap import OutputFlag
from firmware_protocol.status import Status
from sim_backend.firmware.button import ButtonModule
from sim_backend.firmware.cint import s16
from sim_backend.firmware.display import DisplayModule
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.high_speed import HighSpeed
from sim_backend.firmware.live_map import LiveMap
from sim_backend.firmware.mailboxes import Mailboxes
from sim_backend.firmware.module_search import ModuleSearch
from sim_backend.firmware.motors.output import OutputModule
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.sensors.input import InputModule
from sim_backend.firmware.sensors.low_speed import LowSpeedModule
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui.ui_module import UiModule
from sim_backend.firmware.vm.calibrations import Calibrations
from sim_backend.firmware.vm.rxe import Type

_OUTPUTS, _FIELD = 0x200, 0x3FFF
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

_ENHANCED_OUTPUT_FIELDS = (*OUTPUT_FIELDS, "options", "max_speed", "max_acceleration")
"""Those of firmware 1.32."""

_INPUT_TYPES = (Type.UBYTE, Type.UBYTE, Type.UWORD, Type.UWORD, Type.SWORD, Type.UBYTE)
_OUTPUT_TYPES = (
    *(Type.UBYTE, Type.UBYTE, Type.SBYTE, Type.SBYTE, Type.SLONG, Type.ULONG, Type.UBYTE, Type.SBYTE),
    *(Type.UBYTE, Type.UBYTE, Type.UBYTE, Type.UBYTE, Type.UBYTE, Type.SLONG, Type.SLONG),
    *(Type.UBYTE, Type.SBYTE, Type.SBYTE),
)
_NARROW: Mapping[Type, Callable[[int], int]] = {
    Type.UBYTE: lambda value: value & 0xFF,
    Type.UWORD: lambda value: value & 0xFFFF,
    Type.SWORD: s16,
}
_COUNTERS = ("count", "block", "rotation")
_SIGNS: Mapping[str, int] = {
    **dict.fromkeys(("power", "turn", "actual_speed", "max_speed", "max_acceleration"), 0x80),
    **dict.fromkeys(_COUNTERS, 0x8000_0000),
}
_BITS: Mapping[str, int] = {
    "flags": int(~OutputFlag(0)),
    **dict.fromkeys(("tacho_limit", *_COUNTERS), 0xFFFF_FFFF),
}
"""Of fields of an output port: the sign bit, if it is signed, and the bits that are stored, if not the lowest eight."""
ACTING = ("flags", "run_state", "actual_speed", "overloaded", *_COUNTERS)
"""Fields of an output that the next pass applies, or reports anew; the others wait for a flag."""


@dataclass(frozen=True)
class Devices:
    """The modules of the brick, and the running program's mailboxes and calibrations."""

    output: OutputModule
    input: InputModule
    low_speed: LowSpeedModule
    high_speed: HighSpeed
    radio: Radio
    sound: SoundModule
    ui: UiModule
    button: ButtonModule
    display: DisplayModule
    loader: Loader
    maps: Sequence[LiveMap]
    module_search: ModuleSearch
    random: Random
    mailboxes: Mailboxes
    started_ms: int
    calibrations: Calibrations
    log_times: Callable[[], tuple[int, int]]

    def module(self, pattern: bytes) -> LiveMap | Status:
        """Return the IO map of the first module whose name matches, or why there is none."""
        return self.module_search.only(pattern.decode("latin-1"))

    def module_of(self, number: int) -> LiveMap | Status:
        """Return the IO map of a module by its number."""
        return next((live for live in self.maps if live.layout.module_id == number), Status.MODULE_NOT_FOUND)

    @cached_property
    def output_fields(self) -> Sequence[str]:
        """Names of the fields of an output port."""
        return _ENHANCED_OUTPUT_FIELDS if self.output.regulates_position else OUTPUT_FIELDS

    def _split(self, argument: int) -> tuple[bool, int, int]:
        """Return whether an input field is meant, the port, and the field."""
        index = argument & _FIELD
        if index < _OUTPUTS:
            return True, *divmod(index, len(INPUT_FIELDS))
        return False, *divmod(index - _OUTPUTS, len(self.output_fields))

    def field_type(self, argument: int) -> Type:
        """Return the type of the field an argument names; a byte if there is none."""
        inputs, port, field = self._split(argument)
        fields = INPUT_FIELDS if inputs else self.output_fields
        if not _exists(inputs, port, field, fields):
            return Type.UBYTE
        return (_INPUT_TYPES if inputs else _OUTPUT_TYPES)[field % len(fields)]

    def get_field(self, argument: int) -> int:
        """Return the field an argument names."""
        inputs, port, field = self._split(argument)
        return (self.input_reader if inputs else self.output_reader)(field)(port)

    def put_field(self, argument: int, value: int) -> None:
        """Set the field an argument names."""
        inputs, port, field = self._split(argument)
        (self.put_input if inputs else self.put_output)(port, field, value)

    def input_reader(self, field: int) -> Callable[[int], int]:
        """Return a function for a field of an input port, 0..3, or of the ports after it; 0 if there is none."""
        return _reader(self.input.ports, INPUT_FIELDS, field)

    def output_reader(self, field: int) -> Callable[[int], int]:
        """Return the same for an output port, 0..2."""
        return _reader(self.output.outputs, self.output_fields, field)

    def put_input(self, port: int, field: int, value: int) -> None:
        """Set a field of an input port; types, modes and validity take effect in the next pass."""
        if not _exists(True, port, field, INPUT_FIELDS):
            return
        port, field = _normal(port, field, INPUT_FIELDS)
        narrow = _NARROW[_INPUT_TYPES[field]]
        self.input.store(port, **{INPUT_FIELDS[field]: narrow(value)})

    def put_output(self, port: int, field: int, value: int) -> None:
        """Set a field of an output port; flags replace pending ones."""
        if not _exists(False, port, field, self.output_fields):
            return
        port, field = _normal(port, field, self.output_fields)
        output, name = self.output.outputs[port], self.output_fields[field]
        sign, bits = _SIGNS.get(name, 0), _BITS.get(name, 0xFF)
        setattr(output, name, (value + sign & bits) - sign)
        if name in ACTING:
            self.output.wake()


def stored_output(name: str, value: str) -> str:
    """Return the expression of the value that a field of an output port stores."""
    sign, bits = _SIGNS.get(name), _BITS.get(name, 0xFF)
    return f"({value} + {sign} & {bits}) - {sign}" if sign else f"({value}) & {bits}"


def _reader(ports: Sequence[object], fields: Sequence[str], field: int) -> Callable[[int], int]:
    """Return a function for a field of ports; a field beyond the last is one of the ports after it.

    Args:
        ports: The objects that have the fields.
        fields: Names of the fields.
        field: Number of the field.
    """
    skipped, number = divmod(field, len(fields))
    sources, value = ports[skipped:], attrgetter(fields[number])
    return lambda port: int(value(sources[port])) if 0 <= port < len(sources) else 0


def _exists(inputs: bool, port: int, field: int, fields: Sequence[str]) -> bool:
    """Return whether port and field exist; the firmware counts fields on into the ports after it."""
    ports = 4 if inputs else 3
    return 0 <= port < ports and 0 <= port * len(fields) + field < ports * len(fields)


def _normal(port: int, field: int, fields: Sequence[str]) -> tuple[int, int]:
    """Return the port and field that are meant by a field that may be one of the ports after it."""
    return (port, field) if field < len(fields) else divmod(port * len(fields) + field, len(fields))
