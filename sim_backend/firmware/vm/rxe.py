"""The executable file: header, variable table, initial values, clumps and code.

Source: LEGO's published executable file specification (MINDSTORMS NXT software developer kit). All numbers except the
version are little-endian; offsets count bytes, offsets of code count words of two bytes.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

_HEADER = struct.Struct("<14sBB HHH HHH HHH HH")
_FORMAT = b"MindstormsNXT\0"
OLDEST_VERSION = (0, 4)
"""Oldest accepted format. Source: docs/firmware.md section 8."""

_VARIABLE = struct.Struct("<BBH")
_CLUMP = struct.Struct("<BBH")
_WORD = 2
_ZERO_FIRST = 1
"""Flag of a variable whose initial value is zero and not in the file."""


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


SIZES = {
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
"""Size of a variable in bytes; an array is the number of its descriptor, a cluster has no bytes of its own."""


class BadProgram(Exception):
    """The file is not a program that this firmware can run."""


class Variable(NamedTuple):
    """An entry of the table of variables.

    Attributes:
        type: See `Type`.
        first_zero: Whether the initial value is zero.
        data: Offset of the value; for a cluster, its number of members.
    """

    type: Type
    first_zero: bool
    data: int


class Clump(NamedTuple):
    """A unit of code that is scheduled on its own.

    Attributes:
        fire_count: Number of clumps that must end before it starts; 0 starts at once.
        dependents: Numbers of the clumps it may fire.
        start: Index of its first word of code.
    """

    fire_count: int
    dependents: tuple[int, ...]
    start: int


@dataclass(frozen=True)
class Program:
    """Content of an executable file.

    Attributes:
        variables: The variable table.
        memory: Initial variables, descriptors and arrays.
        static_size: Number of bytes of scalar variables; the memory after them can move.
        descriptors: Offset of the array descriptors in `memory`.
        clumps: All clumps.
        code: Words of code.
    """

    variables: tuple[Variable, ...]
    memory: bytes
    static_size: int
    descriptors: int
    clumps: tuple[Clump, ...]
    code: tuple[int, ...]


class _Header(NamedTuple):
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


def parse(content: bytes) -> Program:
    """Parse an executable file.

    Raises:
        BadProgram: The file is not a program, too old, or truncated.
    """
    try:
        return _parse(content)
    except (struct.error, ValueError, IndexError, RecursionError) as error:
        raise BadProgram(f"damaged program: {error}") from error


def _parse(content: bytes) -> Program:
    header = _Header(*_HEADER.unpack_from(content))
    if header.format != _FORMAT:
        raise BadProgram("not a program")
    if (header.major, header.minor) < OLDEST_VERSION:
        raise BadProgram(f"format {header.major}.{header.minor} is too old")
    at = _HEADER.size
    variables = tuple(
        Variable(Type(kind), bool(flags & _ZERO_FIRST), data)
        for kind, flags, data in (
            _VARIABLE.unpack_from(content, at + i * _VARIABLE.size) for i in range(header.variables)
        )
    )
    at += header.variables * _VARIABLE.size
    memory = _first_values(header, variables, content[at : at + header.defaults_size])
    at = _even(at + header.defaults_size)
    clumps, at = _clumps(content, at, header.clumps)
    code = struct.unpack_from(f"<{header.words}H", content, at)
    if any(clump.start >= header.words for clump in clumps):
        raise BadProgram("a clump without code")
    return Program(variables, memory, header.static_size, header.descriptors, clumps, code)


def _first_values(header: _Header, variables: tuple[Variable, ...], defaults: bytes) -> bytes:
    """Initial memory: scalar values in the order of the table, then descriptors and arrays."""
    memory = bytearray(header.initial_size)
    at = index = 0
    while index < len(variables):
        variable = variables[index]
        size = SIZES.get(variable.type, 0)
        if size and not variable.first_zero:
            memory[variable.data : variable.data + size] = defaults[at : at + size]
            at += size
        index = following(variables, index) if variable.type == Type.ARRAY else index + 1
    dynamic = defaults[header.dynamic_offset : header.dynamic_offset + header.dynamic_size]
    memory[header.static_size : header.static_size + len(dynamic)] = dynamic
    if len(memory) != header.initial_size:
        raise BadProgram("first values outside of memory")
    return bytes(memory)


def following(variables: tuple[Variable, ...], index: int) -> int:
    """Index of the entry after the variable `index` and its elements or members."""
    while variables[index].type == Type.ARRAY:
        index += 1
    members = variables[index].data if variables[index].type == Type.CLUSTER else 0
    index += 1
    for _ in range(members):
        index = following(variables, index)
    return index


def _clumps(content: bytes, at: int, count: int) -> tuple[tuple[Clump, ...], int]:
    """All clumps, and the even offset of the code after the lists of dependents."""
    lists = at + count * _CLUMP.size
    clumps = []
    for i in range(count):
        fire_count, dependents, start = _CLUMP.unpack_from(content, at + i * _CLUMP.size)
        clumps.append(Clump(fire_count, tuple(content[lists : lists + dependents]), start))
        lists += dependents
    return tuple(clumps), _even(lists)


def _even(offset: int) -> int:
    return offset + offset % _WORD
