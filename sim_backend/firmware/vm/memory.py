"""The memory pool of a running program: its variables, its arrays, and the room left for both.

Every array has a descriptor of ten bytes: where it is, the size of an element, how many there are, and two links. The
descriptors are an array themselves, number 0, which grows by several entries at once. What moves is packed together
when the end of the pool is reached.

Source: LEGO's executable file specification; the size of the pool is in docs/firmware.md section 5.2 (Command map). How
much a program itself takes out of the pool, and by how many descriptors their array grows, were chosen so that the
recorded conversation message_memory is met in both firmwares.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from sim_backend.firmware.vm.rxe import SIZES, BadProgram, Program, Type, following

POOL_SIZE = 32_768
NOT_AN_OFFSET = 0xFFFF
_ALIGNMENT = 4
_DESCRIPTOR = struct.Struct("<HHHHH")
_INDEX = struct.Struct("<H")
_SCALARS = {
    Type.UBYTE: struct.Struct("<B"),
    Type.SBYTE: struct.Struct("<b"),
    Type.UWORD: struct.Struct("<H"),
    Type.SWORD: struct.Struct("<h"),
    Type.ULONG: struct.Struct("<I"),
    Type.SLONG: struct.Struct("<i"),
    Type.FLOAT: struct.Struct("<f"),
    Type.MUTEX: struct.Struct("<I"),
}

Value = int | float | list["Value"]
"""A number, or the elements of an array, or the members of a cluster."""


class OutOfMemory(Exception):
    """The pool is full, or a program has written nonsense over its array descriptors."""


class Layout(NamedTuple):
    """What differs between firmwares.

    Attributes:
        clump: Bytes of the pool each clump takes.
        growth: Descriptors that are added at once.
    """

    clump: int
    growth: int


class _Array(NamedTuple):
    offset: int
    element: int
    length: int


class Memory:
    """The pool with one program in it.

    Attributes:
        pool: All of it.
        base: Where the program's variables begin.
        descriptors: Where the descriptors are, from `base`.
    """

    def __init__(self, program: Program, layout: Layout) -> None:
        """Put the program's first values into an empty pool.

        Raises:
            BadProgram: It does not fit, or its descriptors are nonsense.
            OutOfMemory: Its descriptors are longer than the pool.
        """
        self.pool = bytearray(POOL_SIZE)
        self.base = _aligned(len(program.clumps) * layout.clump)
        self.descriptors = program.descriptors
        self._variables, self._growth = program.variables, layout.growth
        self._movable = program.static_size
        self._end = len(program.memory)
        if self.base + self._end > POOL_SIZE:
            raise BadProgram("larger than the memory pool")
        self.pool[self.base : self.base + self._end] = program.memory
        if program.descriptors + _DESCRIPTOR.size > self._end:
            raise BadProgram("no array descriptors")
        own = self._array(0)
        if own.offset != self.descriptors or own.element != _DESCRIPTOR.size or not own.length:
            raise BadProgram("array descriptors that do not describe themselves")
        self._count = own.length
        self._free: list[int] = []

    def address(self, variable: int) -> int:
        """Where a single variable is, from `base`."""
        return self._variables[variable].data

    def kind(self, variable: int) -> Type:
        """Type of a variable."""
        return self._variables[variable].type

    def members(self, cluster: int) -> list[int]:
        """Numbers of the members of a cluster."""
        found, index = [], cluster + 1
        for _ in range(self._variables[cluster].data):
            found.append(index)
            index = following(self._variables, index)
        return found

    def get(self, variable: int) -> Value:
        """The value of a variable."""
        return self._read(variable, 0)

    def put(self, variable: int, value: Value) -> None:
        """Change a variable; numbers are fitted into its type, arrays get the length of `value`.

        Raises:
            OutOfMemory: A longer array does not fit.
        """
        self._write(variable, 0, value)

    def count(self, array: int) -> int:
        """Elements of an array variable."""
        return self._array(self._index(self._variables[array].data)).length

    def new_array(self, element_size: int) -> int:
        """Number of a new, empty array's descriptor.

        Raises:
            OutOfMemory: There is no room for more descriptors.
        """
        if not self._free:
            first = self._count
            self.resize(0, first + self._growth)
            self._count = first + self._growth
            self._free = list(range(self._count - 1, first - 1, -1))
        index = self._free.pop()
        self._describe(index, _Array(NOT_AN_OFFSET, element_size, 0))
        return index

    def free_array(self, index: int) -> None:
        """Give an array and its descriptor back."""
        self._describe(index, _Array(NOT_AN_OFFSET, 0, 0))
        self._free.append(index)

    def resize(self, index: int, count: int) -> None:
        """Give an array `count` elements; those it has stay, new ones are zero.

        Raises:
            OutOfMemory: There is no room.
        """
        array = self._array(index)
        old, new = array.element * array.length, array.element * count
        offset = array.offset
        if new > old:
            kept = self.bytes_of(index)
            offset = self._allocate(new)
            start = self.base + offset
            self.pool[start : start + new] = kept.ljust(new, b"\0")
        if index == 0:
            self.descriptors = offset
        self._describe(index, _Array(offset if new else NOT_AN_OFFSET, array.element, count))

    def bytes_of(self, index: int) -> bytes:
        """An array as it is stored."""
        array = self._array(index)
        start = self.base + array.offset
        return bytes(self.pool[start : start + array.element * array.length])

    def set_bytes(self, index: int, data: bytes) -> None:
        """Store an array; its length becomes that of `data`.

        Raises:
            OutOfMemory: There is no room.
        """
        element = self._array(index).element or 1
        self.resize(index, len(data) // element)
        start = self.base + self._array(index).offset
        self.pool[start : start + len(data)] = data

    def _allocate(self, size: int) -> int:
        end = _aligned(self._end)
        if self.base + end + size > POOL_SIZE:
            self._compact()
            end = _aligned(self._end)
        if self.base + end + size > POOL_SIZE:
            raise OutOfMemory
        self._end = end + size
        return end

    def _compact(self) -> None:
        """Move all arrays together, in their order."""
        end = self._movable
        arrays = [(self._array(index), index) for index in range(self._count)]
        for array, index in sorted((array, index) for array, index in arrays if array.length and array.element):
            offset, size = _aligned(end), array.element * array.length
            if offset < array.offset:
                source, target = self.base + array.offset, self.base + offset
                self.pool[target : target + size] = self.pool[source : source + size]
                if index == 0:
                    self.descriptors = offset
                self._describe(index, array._replace(offset=offset))
                end = offset + size
            else:
                end = array.offset + size
        self._end = end

    def _array(self, index: int) -> _Array:
        array = _Array(*_DESCRIPTOR.unpack_from(self.pool, self._descriptor(index))[:3])
        if array.length and self.base + array.offset + array.element * array.length > POOL_SIZE:
            raise OutOfMemory(f"array {index} is outside of the pool")
        return array

    def _describe(self, index: int, array: _Array) -> None:
        _DESCRIPTOR.pack_into(self.pool, self._descriptor(index), *array, NOT_AN_OFFSET, NOT_AN_OFFSET)

    def _descriptor(self, index: int) -> int:
        at = self.base + self.descriptors + _DESCRIPTOR.size * index
        if at + _DESCRIPTOR.size > POOL_SIZE:
            raise OutOfMemory(f"there is no array {index}")
        return at

    def _index(self, at: int) -> int:
        return int(_INDEX.unpack_from(self.pool, self.base + at)[0])

    def _read(self, variable: int, at: int) -> Value:
        kind, _, data = self._variables[variable]
        if kind == Type.ARRAY:
            array = self._array(self._index(at + data))
            return [self._read(variable + 1, array.offset + i * array.element) for i in range(array.length)]
        if kind == Type.CLUSTER:
            return [self._read(member, at) for member in self.members(variable)]
        value: int | float = _SCALARS[kind].unpack_from(self.pool, self.base + at + data)[0]
        return value

    def _write(self, variable: int, at: int, value: Value) -> None:
        kind, _, data = self._variables[variable]
        if kind == Type.ARRAY:
            self._write_array(variable, at + data, _parts(value))
        elif kind == Type.CLUSTER:
            for member, part in zip(self.members(variable), _parts(value), strict=False):
                self._write(member, at, part)
        elif not isinstance(value, list):
            _SCALARS[kind].pack_into(self.pool, self.base + at + data, _fitting(kind, value))

    def _write_array(self, variable: int, at: int, values: list[Value]) -> None:
        index, nested = self._index(at), self._variables[variable + 1].type == Type.ARRAY
        array = self._array(index)
        if nested:
            for i in range(len(values), array.length):
                self.free_array(self._index(array.offset + i * array.element))
        self.resize(index, len(values))
        for i, value in enumerate(values):
            place = self._array(index)
            if nested and i >= array.length:
                sub = self.new_array(self._element_size(variable + 2))
                place = self._array(index)  # descriptors and elements may have moved
                _INDEX.pack_into(self.pool, self.base + place.offset + i * place.element, sub)
            self._write(variable + 1, place.offset + i * place.element, value)

    def _element_size(self, variable: int) -> int:
        """Bytes of an element of the type at `variable`."""
        kind, _, data = self._variables[variable]
        if kind != Type.CLUSTER:
            return SIZES.get(kind, 0)
        members = self.members(variable)
        return max((self._extent(member) for member in members), default=0) if data else 0

    def _extent(self, variable: int) -> int:
        if self._variables[variable].type == Type.CLUSTER:
            return self._element_size(variable)
        return self._variables[variable].data + SIZES.get(self._variables[variable].type, 0)


def _parts(value: Value) -> list[Value]:
    return value if isinstance(value, list) else [value]


def _fitting(kind: Type, value: float) -> int | float:
    """The low bits of `value`, as many as the type has."""
    if kind == Type.FLOAT:
        return value
    bits = 8 * SIZES[kind]
    value = round(value) & (1 << bits) - 1
    signed = kind in (Type.SBYTE, Type.SWORD, Type.SLONG)
    return value - (1 << bits) if signed and value >> (bits - 1) else value


def _aligned(size: int) -> int:
    return -(-size // _ALIGNMENT) * _ALIGNMENT
