"""The memory pool of a running program: variables, arrays and free space.

Each array has a descriptor of ten bytes: offset, element size, length and two links. The descriptors form an array
themselves, number 0, which grows by several entries at once. Arrays are compacted when the end of the pool is reached.

Source: LEGO's executable file specification; the size of the pool is in docs/firmware.md section 5.2 (Command map). The
pool space of a clump and the growth of the descriptors were fitted to the recorded conversation message_memory of both
firmwares.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from sim_backend.firmware.vm.rxe import SIZES, BadProgram, Program, Type, following

POOL_SIZE = 32_768
_FILLER = bytes.fromhex("efbeadde")
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
"""A number, the elements of an array, or the members of a cluster."""


class OutOfMemory(Exception):
    """The pool is full, or a program has corrupted its array descriptors."""


class Layout(NamedTuple):
    """Differences between firmwares.

    Attributes:
        clump: Pool bytes per clump.
        growth: Number of descriptors added at once.
    """

    clump: int
    growth: int


def fresh_pool() -> bytearray:
    """A pool as the firmware prepares it for each program."""
    return bytearray(_FILLER * (POOL_SIZE // len(_FILLER)))


class _Array(NamedTuple):
    offset: int
    element: int
    length: int


class Memory:
    """The pool with one program in it.

    Attributes:
        pool: The whole pool.
        base: Offset of the program's variables.
        descriptors: Offset of the descriptors from `base`.
    """

    def __init__(self, program: Program, layout: Layout) -> None:
        """Load the program's initial values into an empty pool.

        Raises:
            BadProgram: It does not fit, or its descriptors are invalid.
            OutOfMemory: Its descriptors exceed the pool.
        """
        self.pool = fresh_pool()
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
        self._free: dict[int, None] = {}
        self._left = POOL_SIZE

    def address(self, variable: int) -> int:
        """Offset of a scalar variable from `base`."""
        return self._variables[variable].data

    def kind(self, variable: int) -> Type:
        """The type of a variable."""
        return self._variables[variable].type

    def members(self, cluster: int) -> list[int]:
        """Numbers of the members of a cluster."""
        found, index = [], cluster + 1
        for _ in range(self._variables[cluster].data):
            found.append(index)
            index = following(self._variables, index)
        return found

    def get(self, variable: int) -> Value:
        """The value of a variable.

        Raises:
            OutOfMemory: It has more elements than the pool has bytes: its arrays are damaged.
        """
        self._left = POOL_SIZE
        return self._read(variable, 0)

    def put(self, variable: int, value: Value) -> None:
        """Set a variable; numbers are truncated to its type, arrays take the length of `value`.

        Raises:
            OutOfMemory: A longer array does not fit.
        """
        self._left = POOL_SIZE
        self._write(variable, 0, value)

    def count(self, array: int) -> int:
        """Length of an array variable."""
        return self._array(self._index(self._variables[array].data)).length

    def new_array(self, element_size: int) -> int:
        """Allocate an empty array; returns the number of its descriptor.

        Raises:
            OutOfMemory: There is no room for more descriptors.
        """
        if not self._free:
            first = self._count
            self.resize(0, first + self._growth)
            self._count = first + self._growth
            self._free = dict.fromkeys(range(self._count - 1, first - 1, -1))
        index, _ = self._free.popitem()
        self._describe(index, _Array(NOT_AN_OFFSET, element_size, 0))
        return index

    def free_array(self, index: int) -> None:
        """Free an array and its descriptor."""
        self._describe(index, _Array(NOT_AN_OFFSET, 0, 0))
        self._free[index] = None

    def resize(self, index: int, count: int) -> None:
        """Set the length of an array; new elements are zero.

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
        """The stored bytes of an array."""
        array = self._array(index)
        start = self.base + array.offset
        return bytes(self.pool[start : start + array.element * array.length])

    def set_bytes(self, index: int, data: bytes) -> None:
        """Store the bytes of an array and set its length.

        Raises:
            OutOfMemory: There is no room.
        """
        element = self._array(index).element or 1
        count = len(data) // element
        self.resize(index, count)
        start, size = self.base + self._array(index).offset, count * element
        if size:
            self.pool[start : start + size] = data[:size]

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
        """Compact all arrays in their order."""
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

    def _spend(self, elements: int) -> None:
        """Count elements of the value that is read or written: sound arrays have at most one in each byte."""
        self._left -= elements
        if self._left < 0:
            raise OutOfMemory("more elements than bytes")

    def _read(self, variable: int, at: int) -> Value:
        kind, _, data = self._variables[variable]
        if kind == Type.ARRAY:
            array = self._array(self._index(at + data))
            self._spend(array.length)
            return [self._read(variable + 1, array.offset + i * array.element) for i in range(array.length)]
        if kind == Type.CLUSTER:
            members = self.members(variable)
            self._spend(len(members))
            return [self._read(member, at) for member in members]
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
        self._spend(len(values))
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
                place = self._array(index)  # new_array may have moved descriptors and elements
                _INDEX.pack_into(self.pool, self.base + place.offset + i * place.element, sub)
            self._write(variable + 1, place.offset + i * place.element, value)

    def _element_size(self, variable: int) -> int:
        """Element size in bytes of the type at `variable`."""
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
    """Truncate `value` to the bits of the type."""
    if kind == Type.FLOAT:
        return value
    bits = 8 * SIZES[kind]
    value = round(value) & (1 << bits) - 1
    signed = kind in (Type.SBYTE, Type.SWORD, Type.SLONG)
    return value - (1 << bits) if signed and value >> (bits - 1) else value


def _aligned(size: int) -> int:
    return -(-size // _ALIGNMENT) * _ALIGNMENT
