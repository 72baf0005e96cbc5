"""Wire types: the encoding of single fields.

A field is declared as ``port: U8``; to a type checker that is an ``int``, and the annotation carries how it is packed
and, if it has one, its unit. All integers are little-endian (docs/firmware.md section 3).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from firmware_protocol.enums import (
    InputPort,
    InterpreterState,
    OutputMode,
    OutputPort,
    Property,
    RegulationMode,
    RunState,
    SensorMode,
    SensorType,
)


class Scalar(NamedTuple):
    """An integer of fixed size.

    Attributes:
        code: Its `struct` format character.
        minimum: Smallest value that fits.
        maximum: Largest value that fits.
    """

    code: str
    minimum: int
    maximum: int

    def to_wire(self, value: int) -> int:
        """Return the value, if it fits.

        Raises:
            ValueError: It does not.
        """
        if not (isinstance(value, int) and self.minimum <= value <= self.maximum):
            raise ValueError(f"must be a whole number from {self.minimum} to {self.maximum}, not {value!r}")
        return value


class Members(dict[int, Any]):
    """Number -> member, filled on first sight; a dict hit costs a tenth of an enum call."""

    def __init__(self, enum: Callable[[int], Any]) -> None:
        super().__init__()
        self.enum = enum

    def __missing__(self, value: int) -> Any:  # noqa: ANN401 - the member type depends on the enum
        member = self[value] = self.enum(value)
        return member


class Number(NamedTuple):
    """A scalar whose values have names.

    Attributes:
        scalar: How it is packed.
        members: From the integer to the named (possibly unknown) member.
    """

    scalar: Scalar
    members: Members

    @property
    def code(self) -> str:
        """Its `struct` format."""
        return self.scalar.code

    def to_wire(self, value: int) -> int:
        """See `Scalar.to_wire`."""
        return self.scalar.to_wire(value)


class Text(NamedTuple):
    """Latin-1 text in a fixed field, zero-padded.

    Attributes:
        size: Bytes on the wire, the closing zero included.
        closed: Whether the last byte is always zero on the way out; else the text may fill the field.
    """

    size: int
    closed: bool = True

    @property
    def code(self) -> str:
        """Its `struct` format."""
        return f"{self.size}s"

    def to_wire(self, value: str) -> bytes:
        """Return the text as bytes, not yet padded.

        Raises:
            ValueError: It is too long, contains a zero, or has characters beyond Latin-1.
        """
        limit = self.size - self.closed
        if not isinstance(value, str) or len(value) > limit or "\0" in value:
            raise ValueError(f"must be text of at most {limit} characters, not {value!r}")
        try:
            return value.encode("latin-1")
        except UnicodeEncodeError:
            raise ValueError(f"must be text in Latin-1 characters, not {value!r}") from None

    def from_wire(self, raw: bytes) -> str:
        """Return the text up to its first zero."""
        return raw.split(b"\0", 1)[0].decode("latin-1")


class Block:
    """Raw bytes of fixed size; shorter values are zero-padded.

    No tuple, unlike the others: `typing` keeps annotations in a cache by equality, and ``(4,)`` is also a `Tail`.

    Attributes:
        size: Bytes on the wire.
    """

    __slots__ = ("size",)

    def __init__(self, size: int) -> None:
        self.size = size

    @property
    def code(self) -> str:
        """Its `struct` format."""
        return f"{self.size}s"

    def to_wire(self, value: bytes) -> bytes:
        """Return the bytes, not yet padded.

        Raises:
            ValueError: There are too many.
        """
        return _at_most(self.size, value)

    def from_wire(self, raw: bytes) -> bytes:
        """Return the bytes, padding included."""
        return raw


class Tail:
    """The rest of the telegram; only allowed as the last field.

    Attributes:
        limit: Most bytes a telegram may carry here.
    """

    __slots__ = ("limit",)

    def __init__(self, limit: int) -> None:
        self.limit = limit

    def to_wire(self, value: bytes) -> bytes:
        """Return the bytes.

        Raises:
            ValueError: There are too many.
        """
        return _at_most(self.limit, value)


def _at_most(limit: int, value: bytes) -> bytes:
    data = bytes(value) if isinstance(value, bytes | bytearray | memoryview) else None
    if data is None or len(data) > limit:
        raise ValueError(f"must be at most {limit} bytes, not {repr(value) if data is None else len(data)}")
    return data


WireType = Scalar | Number | Text | Block | Tail


def _named(enum: Callable[[int], Any]) -> Number:
    return Number(_U8, Members(enum))


def _truth(value: int) -> int:
    return bool(value) if value in (0, 1) else value


_U8 = Scalar("B", 0, 0xFF)

U8 = Annotated[int, _U8]
S8 = Annotated[int, Scalar("b", -0x80, 0x7F)]
U16 = Annotated[int, Scalar("H", 0, 0xFFFF)]
S16 = Annotated[int, Scalar("h", -0x8000, 0x7FFF)]
U32 = Annotated[int, Scalar("I", 0, 0xFFFF_FFFF)]
S32 = Annotated[int, Scalar("i", -0x8000_0000, 0x7FFF_FFFF)]
Bool = Annotated[bool, _named(_truth)]
"""One byte; anything but zero is true, and a number above 1 is kept so that it can be shown."""

Percent = Annotated[S8, "%"]
Degrees = Annotated[S32, "deg"]
DegreesLimit = Annotated[U32, "deg"]
Milliseconds16 = Annotated[U16, "ms"]
Milliseconds32 = Annotated[U32, "ms"]
Millivolts = Annotated[U16, "mV"]
Hertz = Annotated[U16, "Hz"]
ByteCount = Annotated[U32, "bytes"]

FileName = Annotated[str, Text(20)]
BrickName = Annotated[str, Text(16)]
"""SetBrickName's field; DeviceInfo answers with 15 bytes (`ReportedName`)."""
ReportedName = Annotated[str, Text(15, closed=False)]

InputPortField = Annotated[InputPort, _named(InputPort)]
OutputPortField = Annotated[OutputPort, _named(OutputPort)]
OutputModeField = Annotated[OutputMode, _named(OutputMode)]
RegulationModeField = Annotated[RegulationMode, _named(RegulationMode)]
RunStateField = Annotated[RunState, _named(RunState)]
SensorTypeField = Annotated[SensorType, _named(SensorType)]
SensorModeField = Annotated[SensorMode, _named(SensorMode)]
InterpreterStateField = Annotated[InterpreterState, _named(InterpreterState)]
PropertyField = Annotated[Property, _named(Property)]
