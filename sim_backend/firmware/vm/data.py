"""A program's variables by their numbers in the variable table, and the fields of ports, which have numbers too.

An element is found by the number of its entry and its offset in the array, a member of a cluster by its own entry.

Source: LEGO's executable file specification; conversions are in docs/firmware.md section 8.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple, Protocol

from sim_backend.firmware.vm import byte_arrays
from sim_backend.firmware.vm.array_descriptor import NOT_AN_OFFSET, Array
from sim_backend.firmware.vm.byte_arrays import ByteArray, Finder, Resizer
from sim_backend.firmware.vm.memory import BYTES_PER_ACCESS, Memory
from sim_backend.firmware.vm.numbers import SCALARS, Number
from sim_backend.firmware.vm.rxe import Type, Variable, following, size_of

NONE = 0xFFFF
"""An omitted argument."""

FIRST_FIELD, NO_FIELDS = 0x4000, 0x10000
"""First argument that is a field of a port, where there are such arguments, and where there are none."""

_OFFSET = 0xFFFF
"""Bits of an offset in an array."""
_NO_TYPE = 0xFF
_ERASED = Variable(_NO_TYPE, first_zero=False, data=-1)
_ZERO = Variable(Type.VOID, first_zero=False, data=0)
"""The entries that the firmware reads past the end of the table: beyond the file, and beyond the flash memory."""
AGGREGATES = (Type.ARRAY, Type.CLUSTER)

_MIN_S32, _END_S32 = -(1 << 31), 1 << 31


class Place(NamedTuple):
    """A variable or a part of one: entry of the table, and offset to add to that of the entry."""

    entry: int
    offset: int = 0


class Fields(Protocol):
    """The fields of ports."""

    def field_type(self, argument: int) -> Type:
        """Return the type of a field."""

    def get_field(self, argument: int) -> int:
        """Return the value of a field."""

    def put_field(self, argument: int, value: int) -> None:
        """Set a field."""


class ProgramError(Exception):
    """The program cannot continue.

    Attributes:
        code: Error code, a negative number of eight bits.
    """

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


ERR_ARG, ERR_INSTR, ERR_MEM = -1, -2, -5
"""Error codes: an illegal argument, an illegal instruction, no memory."""


class Data:
    """The variables of a running program.

    Attributes:
        memory: The pool that holds them.
        variables: The variable table.
        fields: The fields of ports.
        first_field: First argument that is one of them.
    """

    def __init__(self, memory: Memory, fields: Fields, first_field: int, wide: Sequence[int]) -> None:
        self.memory, self.fields, self.first_field, self._wide = memory, fields, first_field, wide
        self.variables, self._flash_entries = _placed(memory), memory.program.flash_entries
        self._finders: dict[int, Finder] = {}
        self._element_sizes: dict[int, int] = {}
        self._inner: dict[int, list[int]] = {}

    def entry(self, argument: int) -> Variable:
        """Return the entry of the variable table, or the bytes that the firmware reads as one."""
        if argument < len(self.variables):
            return self.variables[argument]
        return _ERASED if argument < min(self._flash_entries, self.first_field) else _ZERO

    def place_of(self, argument: int) -> int:
        """Return the offset that the table has for a variable of any type; a field of a port is none."""
        if argument < len(self.variables):
            return self.variables[argument].data
        return (_ERASED if argument < self._flash_entries else _ZERO).data

    def kind(self, argument: int) -> int:
        """Return the type of a variable or field; not one of `Type` beyond the table."""
        return self.fields.field_type(argument) if argument >= self.first_field else self.entry(argument).type

    def is_aggregate(self, argument: int) -> bool:
        """Return whether a variable is an array or a cluster."""
        return self.kind(argument) in AGGREGATES

    def address(self, place: Place) -> int:
        """Return the offset of a scalar, or of the number of an array's descriptor."""
        return self.entry(place.entry).data + (place.offset & _OFFSET)

    def get(self, argument: int, offset: int = 0) -> Number:
        """Return the value of a scalar: an int, or a float of single precision; 0 for anything else."""
        if argument >= self.first_field:
            return self.fields.get_field(argument)
        kind, _, at = self.entry(argument)
        return self.memory.load(kind, at + (offset & _OFFSET)) if kind in SCALARS else 0

    def put(self, argument: int, value: float, offset: int = 0) -> None:
        """Set a scalar, nothing else; numbers are converted to its type, but a float is not stored in a VOID."""
        kind = self.kind(argument)
        if kind != Type.FLOAT and isinstance(value, float):
            if kind == Type.VOID:
                return
            value = self.whole(value, kind)
        if argument >= self.first_field:
            self.fields.put_field(argument, int(value))
        elif kind in SCALARS:
            self.memory.store(kind, self.entry(argument).data + (offset & _OFFSET), value)

    def whole(self, value: float, kind: int) -> int:
        """Return the bits that a float is stored as in an integer of a type, at least as many as that has."""
        return _unsigned(value) if kind in self._wide else truncated(value)

    def integer(self, argument: int, offset: int = 0) -> int:
        """Return the value of a scalar that must be an integer: a float is rounded."""
        value = self.get(argument, offset)
        return rounded(value) if isinstance(value, float) else value

    def integer_or(self, argument: int, default: int) -> int:
        """Return the same, or `default` if the argument is omitted."""
        return default if argument == NONE else self.integer(argument)

    def index(self, place: Place) -> int:
        """Return the number of the descriptor of an array, or what is stored where that of an array would be."""
        return self.memory.index(self.address(place))

    def index_of(self, argument: int) -> int:
        """Return the number of the descriptor of an array variable."""
        return self.index(Place(argument))

    def array(self, place: Place) -> Array:
        """Return the descriptor of an array."""
        return self.memory.array(self.index(place))

    def parts(self, place: Place) -> list[Place]:
        """Return the elements of an array or members of a cluster."""
        if self.kind(place.entry) == Type.CLUSTER:
            return [Place(member, place.offset) for member in self.members(place.entry)]
        if self.kind(place.entry) != Type.ARRAY:
            return []
        array = self.array(place)
        self.memory.spend(array.length)
        return [Place(place.entry + 1, array.offset + i * array.element) for i in range(array.length)]

    def elements(self, place: Place) -> Iterator[Place]:
        """Return the elements of an array, without an end.

        Each is as far from the last one as the size of an element then says: a damaged program may change that.
        """
        memory, index = self.memory, self.index(place)
        offset = memory.array(index).offset
        while True:
            yield Place(place.entry + 1, offset)
            offset += memory.array(index).element

    def count(self, place: Place) -> int:
        """Return the number of elements of an array or members of a cluster."""
        if self.kind(place.entry) == Type.CLUSTER:
            return self.variables[place.entry].data
        return self.array(place).length

    def member(self, cluster: int, number: int) -> int:
        """Return the entry of a member of a cluster; numbers beyond the last one name what follows in the table."""
        self.memory.spend(number)
        index = cluster + 1
        for _ in range(number):
            index = following(self.variables, index)
        return index

    def members(self, cluster: int) -> list[int]:
        """Return the entries of the members of a cluster."""
        self.memory.spend(self.variables[cluster].data)
        found, index = list[int](), cluster + 1
        for _ in range(self.variables[cluster].data):
            found.append(index)
            index = following(self.variables, index)
        return found

    def arguments(self, cluster: int, count: int) -> list[int]:
        """Return the entries of a system call's arguments: those after the cluster, as far as there is a table."""
        found, index = list[int](), cluster + 1
        while len(found) < count and index < len(self.variables):
            found.append(index)
            try:
                index = following(self.variables, index)
            except IndexError:
                break
        return found

    def element_size(self, entry: int) -> int:
        """Return the size of an element of the type at `entry`."""
        if entry not in self._element_sizes:
            self._element_sizes[entry] = self._measure(entry)
        return self._element_sizes[entry]

    def _measure(self, entry: int) -> int:
        """Return the size of a scalar; of a cluster the end of the last part, padded as the widest part needs."""
        if self.variables[entry].type != Type.CLUSTER:
            return size_of(self.variables[entry].type)
        end, width = self._extent(entry)
        return -(-end // width) * width

    def _extent(self, entry: int) -> tuple[int, int]:
        kind = self.variables[entry].type
        if kind != Type.CLUSTER:
            size = size_of(kind)
            return self.variables[entry].data + size, max(size, 1)
        extents = [self._extent(member) for member in self.members(entry)] or [(0, 1)]
        return max(end for end, _ in extents), max(width for _, width in extents)

    def resize(self, place: Place, count: int) -> None:
        """Set the length of an array variable; arrays inside its elements are freed or allocated.

        Raises:
            OutOfMemory: There is no room.
        """
        index, inner = self.index(place), self._inner_arrays(place.entry + 1)
        array = self.memory.array(index)
        if count == array.length:
            return
        for i in range(count, array.length) if inner else ():
            for entry in inner:
                self._free(Place(entry, array.offset + i * array.element))
        self.memory.resize(index, count)
        for i in range(array.length, count) if inner else ():
            for entry in inner:
                self._allocate(index, i, Place(entry))

    def _inner_arrays(self, element: int) -> list[int]:
        """Return the entries of the arrays that an element of an array contains, as far as the firmware finds them.

        It takes as many entries for the members of a cluster as this has members, though an array has several, and as
        many more for each cluster among them.
        """
        if element not in self._inner:
            found, index, left = list[int](), element, 1
            while left and index < len(self.variables):
                kind, _, count = self.variables[index]
                if kind == Type.ARRAY:
                    found.append(index)
                elif kind == Type.CLUSTER:
                    left += count if index == element else self.variables[element].data
                left, index = left - 1, index + 1
            self._inner[element] = found
        return self._inner[element]

    def _free(self, place: Place) -> None:
        index = self.index(place)
        array = self.memory.array(index)
        inner = self._inner_arrays(place.entry + 1) if array.offset != NOT_AN_OFFSET else []
        for i in range(array.length) if inner else ():
            for entry in inner:
                self._free(Place(entry, array.offset + i * array.element))
        self.memory.free_array(index)

    def _allocate(self, outer: int, i: int, inner: Place) -> None:
        new = self.memory.new_array(self.element_size(inner.entry + 1))
        array = self.memory.array(outer)  # a new descriptor may have moved it
        slot = self.address(inner._replace(offset=array.offset + i * array.element))
        self.memory.store(Type.UWORD, slot, new)
        if not self.memory.doubly_linked:
            self.memory.describe(new, self.memory.array(new)._replace(back=slot))

    def span(self, argument: int) -> tuple[int, int]:
        """Return the place in the pool of the first element of an array, and its length.

        A variable that is used as an array, but is not one, is in its own place.
        """
        return self.finder(argument)()

    def finder(self, argument: int) -> Finder:
        """Return a fast function for the same."""
        if argument not in self._finders:
            self._finders[argument] = byte_arrays.finder(self._bytes(argument))
        return self._finders[argument]

    def resizer(self, argument: int) -> Resizer:
        """Return a function that sets the length of an array variable of bytes and returns its place."""
        return Resizer(self._bytes(argument))

    def writer(self, argument: int) -> Callable[[bytes | bytearray], None]:
        """Return a fast function that sets an array variable of bytes, see `set_bytes`."""
        return byte_arrays.writer(self._bytes(argument))

    def _bytes(self, argument: int) -> ByteArray:
        place, is_array = Place(argument), self.kind(argument) == Type.ARRAY
        return ByteArray(self.memory, self.address(place), is_array, partial(self.index, place))

    def text_at(self, at: int) -> bytes | bytearray:
        """Return the bytes in the pool from a place on to the next zero."""
        pool = self.memory.pool
        end = pool.find(0, at)
        text = pool[at : len(pool) if end < 0 else end]
        self.memory.spend(len(text) // BYTES_PER_ACCESS)
        return text

    def bytes_of(self, argument: int) -> bytes:
        """Return the stored bytes of an array variable of bytes."""
        at, length = self.span(argument)
        self.memory.spend(length // BYTES_PER_ACCESS)
        return bytes(self.memory.pool[at : at + length])

    def numbers_of(self, place: Place) -> bytes:
        """Return the stored bytes of an array of numbers."""
        array = self.array(place)
        return self.memory.read(array.offset, array.length * size_of(self.kind(place.entry + 1)) & _OFFSET)

    def set_bytes(self, argument: int, content: bytes | bytearray) -> None:
        """Set an array variable of bytes.

        Raises:
            OutOfMemory: It is outside of the pool.
        """
        self.writer(argument)(content)

    def text(self, argument: int) -> bytes:
        """Return the bytes of a text before its closing zero."""
        return self.bytes_of(argument).split(b"\0")[0]


def _placed(memory: Memory) -> tuple[Variable, ...]:
    """Return the variable table with offsets as `Memory` takes them; the number of members of a cluster stays."""
    variables = memory.program.variables
    if all(memory.signed(entry.data) == entry.data for entry in variables):
        return variables
    return tuple(
        entry if entry.type == Type.CLUSTER else entry._replace(data=memory.signed(entry.data)) for entry in variables
    )


def truncated(value: float) -> int:
    """Return a float as an integer of 32 bits, towards zero; the smallest one if it does not fit."""
    return int(value) if _MIN_S32 - 1 < value < _END_S32 else _MIN_S32


def _unsigned(value: float) -> int:
    """Return a float as 32 bits: those of an unsigned number from 2^31 on."""
    if value >= _END_S32:
        return int(value) if value < 2 * _END_S32 else 0
    return truncated(value)


def rounded(value: float) -> int:
    """Return the nearest integer of 32 bits; of two, the one farther from zero."""
    return _unsigned(value + math.copysign(0.5, value))
