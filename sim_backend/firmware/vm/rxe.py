"""The executable file: header, variable table, initial values, clumps and code.

Source: LEGO's published executable file specification (MINDSTORMS NXT software developer kit). All numbers except the
version are little-endian; offsets count bytes, offsets of code count words of two bytes. The firmware's checks are in
docs/firmware.md section 8.1.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple

from sim_backend.firmware.vm.clump_queue import NO_CLUMP

_HEADER = struct.Struct("<14sBB 11H")
_FORMAT = b"MindstormsNXT\0"
OLDEST_MINOR, NEWEST_MAJOR = 4, 1
"""The accepted formats: the firmware compares minor and major version on their own."""

_VARIABLE = struct.Struct("<BBH")
_CLUMP = struct.Struct("<BBH")
_WORD = 2
_FLASH_END = 0x14_0000
"""End of the flash memory in the processor's memory."""
_ZERO_FIRST = 1
"""Flag of a variable whose initial value is zero and not in the file."""
_ERASED = 0xFF
"""Byte of flash memory after the file."""
_OFFSETS = 0xFFFF
"""Offsets have 16 bits."""


class Type(IntEnum):
    """Types of variables."""

    VOID = 0
    UBYTE = 1
    SBYTE = 2
    UWORD = 3
    SWORD = 4
    ULONG = 5
    SLONG = 6
    ARRAY = 7
    CLUSTER = 8
    MUTEX = 9
    FLOAT = 10
    NOTHING = 11
    """Unknown types in firmware 1.05: they have no size, read as 0 and take no value."""
    UNKNOWN = 12
    """Unknown types in other firmwares: they refuse the program."""


SIZES: Mapping[int, int] = {
    Type.UBYTE: 1,
    Type.SBYTE: 1,
    Type.UWORD: 2,
    Type.SWORD: 2,
    Type.ULONG: 4,
    Type.SLONG: 4,
    Type.ARRAY: 2,
    Type.MUTEX: 4,
    Type.FLOAT: 4,
}
"""Size of a variable in bytes; an array is the number of its descriptor, a cluster has no bytes of its own, and neither
has VOID, though it is read and written as a byte."""


def size_of(kind: int) -> int:
    """Return the size of a type in bytes; 0 for clusters and for anything that is not a type."""
    return SIZES.get(kind, 0)


class Fault(IntEnum):
    """Why a program cannot be started: the byte that firmware 1.32 shows as ProgStatus."""

    TYPE = 0xFE
    ARRAY_LIST = 0xFD
    FORMAT = 0xFC
    OUT_OF_MEMORY = 0xFB
    CLUMP_COUNT = 0xF9
    NO_CODE = 0xF8
    SIZES = 0xF7
    POOL_SIZE = 0xF6
    NO_FILE = 0xF5
    NO_MEMORY = 0xF4
    NO_START = 0xF3
    SCALARS_SIZE = 0xF2
    DESCRIPTORS = 0xF1


class BadProgram(Exception):
    """The file is not a program that this firmware can run.

    Attributes:
        fault: See `Fault`.
    """

    def __init__(self, fault: Fault, reason: str) -> None:
        super().__init__(reason)
        self.fault = fault


class Variable(NamedTuple):
    """An entry of the table of variables.

    Attributes:
        type: See `Type`; a damaged file may have others.
        first_zero: Whether the initial value is zero.
        data: Offset of the value; for a cluster, its number of members.
    """

    type: int
    first_zero: bool
    data: int


class Clump(NamedTuple):
    """A unit of code that is scheduled on its own.

    Attributes:
        fire_count: Number of clumps that must end before it starts; 0 starts at once.
        start: Index of its first word of code.
        end: Index of the word after its last one.
        list_at: Where the numbers of the clumps it may fire are in the file.
        dependents: How many these are.
    """

    fire_count: int
    start: int
    end: int
    list_at: int = 0
    dependents: int = 0


class Header(NamedTuple):
    """The beginning of a file.

    Attributes:
        format: The same bytes in all programs.
        major, minor: Version of the format.
        variables: Number of variables in the table.
        initial_size: Bytes of memory that are used at the start.
        static_size: Number of bytes of scalar variables; the memory after them can move.
        defaults_size: Number of bytes of initial values.
        dynamic_offset: Offset in them of the initial descriptors and arrays.
        dynamic_size: Their size.
        memory_head: First array of the list.
        memory_tail: Last array of the list.
        descriptors: Offset of the array descriptors in memory.
        clumps: Number of clumps.
        words: Number of words of code.
    """

    format: bytes
    major: int
    minor: int
    variables: int
    initial_size: int
    static_size: int
    defaults_size: int
    dynamic_offset: int
    dynamic_size: int
    memory_head: int
    memory_tail: int
    descriptors: int
    clumps: int
    words: int


@dataclass(frozen=True)
class Program:
    """Content of an executable file.

    Attributes:
        header: The beginning of the file.
        variables: The variable table, and the rest of the file, which the firmware also reads as entries.
        values: Initial values, scalars first.
        clumps: All clumps.
        code: Words of code.
        content: The file.
        erased: How the firmware reads erased flash memory after the file.
        address: Where its content begins in the processor's memory.
    """

    header: Header
    variables: tuple[Variable, ...]
    values: bytes
    clumps: tuple[Clump, ...]
    code: tuple[int, ...]
    content: bytes
    erased: Variable
    address: int = _FLASH_END

    @property
    def flash_entries(self) -> int:
        """Number of entries of the table of variables, if it went on to the end of the flash memory."""
        return (_FLASH_END - self.address - _HEADER.size) // _VARIABLE.size

    def with_content(self, content: bytes) -> Program:
        """Return the program with other code, which is at the end of as many bytes as its file has."""
        size = len(self.code)
        code = struct.unpack_from(f"<{size}H", content, len(content) - _WORD * size)
        return replace(self, code=code, content=content)

    def check(self) -> None:
        """Check what the firmware checks after the sizes of the file's parts.

        Raises:
            BadProgram: There are no variables, or no clump that starts.
        """
        if not self.header.initial_size:
            raise BadProgram(Fault.NO_MEMORY, "no memory for variables")
        if all(clump.fire_count for clump in self.clumps):
            raise BadProgram(Fault.NO_START, "no clump that starts the program")

    def initial_values(self) -> Iterator[tuple[int, bytes]]:
        """Return the offset in memory and bytes of each initial value, in the firmware's order.

        Raises:
            BadProgram: A type is not known, or the size of the scalars disagrees with the header.
        """
        at = 0
        for variable in self._entries():
            if variable.type == Type.UNKNOWN:
                raise BadProgram(Fault.TYPE, "variables of an unknown type")
            size = size_of(variable.type)
            if variable.first_zero:
                yield variable.data, bytes(size)
            else:
                yield variable.data, self.values[at : at + size].ljust(size, b"\0")
                at += size
        if at != self.header.dynamic_offset or at + self.header.dynamic_size != len(self.values):
            raise BadProgram(Fault.SCALARS_SIZE, "scalars whose size is not that of the header")
        yield self.header.static_size, self.values[at:]

    def _entries(self) -> Iterator[Variable]:
        """Return the variables that have a place of their own; elements of arrays have none.

        The first entry counts even if the table is empty, the members of a cluster also past the end of the table.
        """
        index, measured, end = 0, 0, max(self.header.variables, 1)
        while index < end:
            variable = self.variables[index] if index < len(self.variables) else self.erased
            yield variable
            try:
                if variable.type == Type.CLUSTER and index >= measured:  # one inside another ends no later
                    measured = following(self.variables, index)
                    end = max(end, measured)
                index = following(self.variables, index) if variable.type == Type.ARRAY else index + 1
            except IndexError as error:
                raise BadProgram(Fault.TYPE, "an array or a cluster whose elements are not in the file") from error


def parse(content: bytes, types: bytes = bytes(range(256)), address: int = _FLASH_END) -> Program:
    """Parse an executable file.

    Args:
        content: The file.
        types: The type as which the firmware reads each number of a type.
        address: Where its content begins in the processor's memory.

    Raises:
        BadProgram: The file is not a program, of another format version, or its parts do not have the announced sizes.
    """
    try:
        return replace(_parse(content, types), address=address)
    except (struct.error, ValueError, IndexError) as error:
        raise BadProgram(Fault.SIZES, f"damaged program: {error}") from error


def _parse(content: bytes, types: bytes) -> Program:
    if not content:
        raise BadProgram(Fault.NO_FILE, "no file, or an empty one")
    header = Header(*_HEADER.unpack_from(content.ljust(_HEADER.size, b"\xff")))
    if header.format != _FORMAT:
        raise BadProgram(Fault.FORMAT, "not a program")
    if header.minor < OLDEST_MINOR or header.major > NEWEST_MAJOR:
        raise BadProgram(Fault.FORMAT, f"format {header.major}.{header.minor} is not supported")
    if not 0 < header.clumps < NO_CLUMP:
        raise BadProgram(Fault.CLUMP_COUNT, "no clumps, or too many")
    if not header.words:
        raise BadProgram(Fault.NO_CODE, "no code")
    at = _HEADER.size
    whole = content[at : at + (len(content) - at) // _VARIABLE.size * _VARIABLE.size]
    variables = tuple(
        Variable(types[kind], bool(flags & _ZERO_FIRST), data) for kind, flags, data in _VARIABLE.iter_unpack(whole)
    )
    at += header.variables * _VARIABLE.size & _OFFSETS
    values = content[at : at + header.defaults_size]
    at = _even(at + header.defaults_size)
    clumps, at = _clumps(content, at, header)
    if at + header.words * _WORD != len(content):
        raise BadProgram(Fault.SIZES, "the file does not have the announced size")
    code = struct.unpack_from(f"<{header.words}H", content, at)
    return Program(header, variables, values, clumps, code, content, Variable(types[_ERASED], True, _OFFSETS))


def following(variables: Sequence[Variable], index: int) -> int:
    """Return the index of the entry after the variable `index` and its elements or members; else raise IndexError."""
    left = 1
    while left:
        variable = variables[index]
        if variable.type == Type.CLUSTER:
            left += variable.data
        left -= variable.type != Type.ARRAY
        index += 1
    return index


def _clumps(content: bytes, at: int, header: Header) -> tuple[tuple[Clump, ...], int]:
    """Return all clumps, and the even offset of the code after the lists of dependents."""
    records = [_CLUMP.unpack_from(content, at + i * _CLUMP.size) for i in range(header.clumps)]
    lists = at + header.clumps * _CLUMP.size
    ends = [start for _, _, start in records[1:]] + [header.words]
    clumps = []
    for (fire_count, dependents, start), end in zip(records, ends, strict=True):
        clumps.append(Clump(fire_count, start, end, lists, dependents))
        lists += dependents
    return tuple(clumps), _even(lists)


def _even(offset: int) -> int:
    return offset + offset % _WORD
