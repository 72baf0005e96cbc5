"""Wire types: how one field of a telegram lies in the bytes.

A field is declared as ``port: U8``; to a type checker that is an ``int``, and the annotation carries how it is packed.
All integers are little-endian (docs/firmware.md section 3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from firmware_protocol.enums import (
    InputPort,
    OpenEnum,
    OutputMode,
    OutputPort,
    Property,
    RegulationMode,
    RunState,
    SensorMode,
    SensorType,
)


@dataclass(frozen=True, slots=True)
class Scalar:
    """An integer of fixed size.

    Attributes:
        code: Its `struct` format character.
        minimum: Smallest value that fits.
        maximum: Largest value that fits.
    """

    code: str
    minimum: int
    maximum: int


@dataclass(frozen=True, slots=True)
class Text:
    """Latin-1 text in a fixed field, zero-padded.

    Attributes:
        size: Bytes on the wire, the closing zero included.
        closed: Whether the last byte is always zero on the way out; else the text may fill the field.
    """

    size: int
    closed: bool = True

    @property
    def limit(self) -> int:
        """Most characters."""
        return self.size - self.closed

    @property
    def code(self) -> str:
        """Its `struct` format."""
        return f"{self.size}s"


@dataclass(frozen=True, slots=True)
class Block:
    """Raw bytes of fixed size; shorter values are zero-padded.

    Attributes:
        size: Bytes on the wire.
    """

    size: int

    @property
    def code(self) -> str:
        """Its `struct` format."""
        return f"{self.size}s"


@dataclass(frozen=True, slots=True)
class Tail:
    """The rest of the telegram; only allowed as the last field.

    Attributes:
        limit: Most bytes a telegram may carry here.
    """

    limit: int


@dataclass(frozen=True, slots=True)
class Number:
    """A scalar whose values have names.

    Attributes:
        scalar: How it is packed.
        convert: Turns the integer into the named (possibly unknown) member.
    """

    scalar: Scalar
    convert: Callable[[int], Any]

    @property
    def code(self) -> str:
        """Its `struct` format."""
        return self.scalar.code


class _Members(dict[int, Any]):
    """Number -> member, filled on first sight; a dict hit costs a tenth of an enum call."""

    def __init__(self, enum: Callable[[int], Any]) -> None:
        super().__init__()
        self._enum = enum

    def __missing__(self, value: int) -> Any:  # noqa: ANN401 - the member type depends on the enum
        member = self[value] = self._enum(value)
        return member


_U8 = Scalar("B", 0, 0xFF)


def _named(enum: Callable[[int], Any]) -> Number:
    return Number(_U8, _Members(enum).__getitem__)


def _truth(value: int) -> int:
    return bool(value) if value in (0, 1) else value


WireType = Scalar | Text | Block | Tail | Number

U8 = Annotated[int, _U8]
S8 = Annotated[int, Scalar("b", -0x80, 0x7F)]
U16 = Annotated[int, Scalar("H", 0, 0xFFFF)]
S16 = Annotated[int, Scalar("h", -0x8000, 0x7FFF)]
U32 = Annotated[int, Scalar("I", 0, 0xFFFF_FFFF)]
S32 = Annotated[int, Scalar("i", -0x8000_0000, 0x7FFF_FFFF)]
FileName = Annotated[str, Text(20)]
BrickName = Annotated[str, Text(16)]
"""SetBrickName's field; DeviceInfo answers with 15 bytes (`ReportedName`)."""
ReportedName = Annotated[str, Text(15, closed=False)]
Bool = Annotated[bool, _named(_truth)]
"""One byte; anything but zero is true, and a number above 1 is kept so that it can be shown."""

InputPortField = Annotated[InputPort, _named(InputPort)]
OutputPortField = Annotated[OutputPort, _named(OutputPort)]
OutputModeField = Annotated[OutputMode, _named(OutputMode)]
RegulationModeField = Annotated[RegulationMode, _named(RegulationMode)]
RunStateField = Annotated[RunState, _named(RunState)]
SensorTypeField = Annotated[SensorType, _named(SensorType)]
SensorModeField = Annotated[SensorMode, _named(SensorMode)]
PropertyField = Annotated[Property, _named(Property)]
