"""How an IO map is declared and accessed; the maps themselves are in `iomap`."""

from __future__ import annotations

import struct
from typing import Any, NamedTuple, get_args

from firmware_protocol.errors import LocalProtocolError, RemoteProtocolError
from firmware_protocol.system import IOMapRead, IOMapWrite
from firmware_protocol.wire import Block, Number, Scalar, Text


class Array(NamedTuple):
    """Several integers in a row.

    Attributes:
        scalar: One of them.
        length: How many.
    """

    scalar: Scalar
    length: int

    @property
    def code(self) -> str:
        """Its `struct` format."""
        return f"{self.length}{self.scalar.code}"


Wire = Scalar | Number | Text | Block | Array


class Field(NamedTuple):
    """A variable in an IO map.

    Attributes:
        offset: First byte, of the first one where there are several.
        wire: How one of them lies in the bytes.
        copies: How many there are.
        stride: From the first byte of one to the first byte of the next.
    """

    offset: int
    wire: Wire
    copies: int = 1
    stride: int = 0

    @property
    def size(self) -> int:
        """Bytes of one of them."""
        return struct.calcsize("<" + self.wire.code)

    @property
    def end(self) -> int:
        """The byte after the last byte of the last one."""
        return self.offset + (self.copies - 1) * self.stride + self.size


class IOMapVariable(NamedTuple):
    """One variable of one map, and the requests that access it.

    Attributes:
        module_id: Whose map.
        offset: First byte in the map.
        size: Bytes.
        wire: How it lies in them.
    """

    module_id: int
    offset: int
    size: int
    wire: Wire

    def read(self) -> IOMapRead:
        """Return the request that reads the variable."""
        return IOMapRead(self.module_id, self.offset, self.size)

    def write(self, value: Any) -> IOMapWrite:  # noqa: ANN401 - the value's type is the field's
        """Return the request that writes the variable; see `encode`."""
        return IOMapWrite.put(self.module_id, self.offset, self.encode(value))

    def encode(self, value: Any) -> bytes:  # noqa: ANN401 - see write
        """Return a value as bytes; for an `Array` the value is a sequence of numbers.

        Raises:
            LocalProtocolError: It does not fit.
        """
        code = "<" + self.wire.code
        try:
            if isinstance(self.wire, Array):
                return struct.pack(code, *map(self.wire.scalar.to_wire, value))
            return struct.pack(code, self.wire.to_wire(value))
        except (ValueError, TypeError, struct.error) as reason:
            raise LocalProtocolError(f"offset {self.offset} of module 0x{self.module_id:08X}: {reason}.") from None

    def decode(self, data: bytes) -> Any:  # noqa: ANN401 - see write
        """Return the value from the bytes that `read` yields.

        Raises:
            RemoteProtocolError: Not as many bytes as the field has.
        """
        if len(data) != self.size:
            raise RemoteProtocolError(f"an IO map field of {self.size} bytes was asked for", bytes(data))
        values = struct.unpack("<" + self.wire.code, data)
        match self.wire:
            case Array():
                return list(values)
            case Scalar():
                return values[0]
            case Number(members=members):
                return members[values[0]]
            case wire:
                return wire.from_wire(values[0])


class IOMap:
    """The layout of one module's IO map.

    Attributes:
        name: The module's, as `FindFirstModule` reports it.
        module_id: Identifies the module in IOMapRead and IOMapWrite.
        size: Bytes, in firmware 1.29.
        size_1_05: Bytes in firmware 1.05.
        fields: Variables by the firmware's name.
    """

    def __init__(
        self, name: str, module_id: int, size: int, fields: dict[str, Field], *, size_1_05: int | None = None
    ) -> None:
        self.name = name
        self.module_id = module_id
        self.size = size
        self.size_1_05 = size if size_1_05 is None else size_1_05
        self.fields = fields

    def field(self, name: str, index: int = 0) -> IOMapVariable:
        """Return the location of a variable.

        Raises:
            LocalProtocolError: There is no field of this name or index; the message lists the names.
        """
        found = self.fields.get(name)
        if found is None:
            raise LocalProtocolError(f"{self.name} has no field {name!r}; it has {', '.join(self.fields)}.")
        if not 0 <= index < found.copies:
            raise LocalProtocolError(f"{self.name} has {found.copies} of {name}, there is no number {index}.")
        return IOMapVariable(self.module_id, found.offset + index * found.stride, found.size, found.wire)

    def between(self, first: str, last: str, index: int = 0) -> IOMapVariable:
        """Return the range from one field to another, inclusive, as raw bytes for a single access.

        Raises:
            LocalProtocolError: There is no such field, or `last` comes before `first`.
        """
        start, end = self.field(first, index), self.field(last, index)
        if end.offset < start.offset:
            raise LocalProtocolError(f"{last} comes before {first} in {self.name}.")
        size = end.offset + end.size - start.offset
        return IOMapVariable(self.module_id, start.offset, size, Block(size))

    def decode(self, data: bytes) -> dict[str, Any]:
        """Decode all variables within `data`, which starts at the map's first byte; repeated ones become lists."""
        values: dict[str, Any] = {}
        for name, field in self.fields.items():
            if field.end <= len(data):
                variables = [self.field(name, index) for index in range(field.copies)]
                decoded = [each.decode(data[each.offset : each.offset + each.size]) for each in variables]
                values[name] = decoded if field.copies > 1 else decoded[0]
        return values


def single(**members: tuple[int, object]) -> dict[str, Field]:
    """Declare fields as (offset, type), the type as in a telegram's declaration."""
    return repeated(1, 0, 0, **members)


def repeated(copies: int, stride: int, base: int, /, **members: tuple[int, object]) -> dict[str, Field]:
    """Declare fields of a group that is repeated `copies` times from byte `base`; offsets are within the group."""
    return {name: Field(base + offset, get_args(hint)[1], copies, stride) for name, (offset, hint) in members.items()}
