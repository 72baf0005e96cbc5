"""The memory pool of a running program: variables, arrays and free space.

Each array has a descriptor, see `array_descriptor`; the descriptors form an array themselves, number 0. The firmware
fills the pool with a pattern before it loads a program, so memory that a program never wrote is known, too.

Source: docs/firmware.md section 8.1.
"""

from __future__ import annotations

from collections.abc import Iterator

from sim_backend.firmware.vm.array_descriptor import (
    DESCRIPTOR,
    DESCRIPTOR_SIZE,
    INDEX,
    LENGTH_AT,
    NO_ARRAY,
    NOT_AN_OFFSET,
    OFFSET_MASK,
    Array,
)
from sim_backend.firmware.vm.numbers import SCALARS, SIGNED, Number, single
from sim_backend.firmware.vm.pool_layout import POOL_SIZE, Layout, fresh_pool
from sim_backend.firmware.vm.rxe import BadProgram, Fault, Program, Type

_ERASED = 0xFF
_WORK, _MOST_WORK, BYTES_PER_ACCESS = 10_000, 300_000, 64
"""Parts of arrays and clusters for which a pass has time, far more than a brick's processor has; parts after which an
instruction of a damaged program, whose arrays contain themselves, is aborted; copied bytes that count as one."""
_ALIGNMENT = 4
_MOST_ADDED = 200
"""Most free descriptors that the start of a program adds."""
_OFFSETS = 0x1_0000
"""Number of offsets."""


class OutOfMemory(Exception):
    """The pool is full, or a program has corrupted its array descriptors."""


class PoolFull(OutOfMemory):
    """The pool has no room for an array."""


class Memory:
    """The pool with one program in it.

    Attributes:
        pool: The pool, and memory after it.
        base: Offset of the program's variables.
        descriptors: Offset of the descriptors from `base`.
        end: Where the last array ends, from `base`.
        layout: How the firmware lays it out.
        doubly_linked: See `Layout`.
        work_left: Parts of arrays and clusters that may still be used in this pass; negative if an instruction took
            the time of later passes, too.
    """

    def __init__(self, program: Program, layout: Layout, pool: bytearray | None = None) -> None:
        self.pool = fresh_pool() if pool is None else pool
        self.base = aligned(len(program.clumps) * layout.clump)
        self.work_left = _WORK
        self.program, self.layout = program, layout
        self._growth, self.doubly_linked = layout.growth, layout.doubly_linked
        header = program.header
        self.descriptors, self.end = header.descriptors, header.initial_size
        self._head, self._tail, self._free = header.memory_head, header.memory_tail, NO_ARRAY

    def fill(self) -> None:
        """Store the program's initial values; those of a damaged one until the damage is found.

        Raises:
            BadProgram: It does not fit, or its arrays are not in order.
            OutOfMemory: Its descriptors exceed the pool.
        """
        if self.base + self.end > POOL_SIZE:
            raise BadProgram(Fault.POOL_SIZE, "larger than the memory pool")
        self.program.check()
        for offset, data in self.program.initial_values():
            self.write(self.signed(offset), data)
        if self.doubly_linked:
            previous = NO_ARRAY
            for index in self._list():
                self._set_back(index, previous)
                previous = index
        if self.array(0).offset != self.descriptors:
            raise BadProgram(Fault.DESCRIPTORS, "array descriptors that do not describe themselves")
        full = None
        if self.doubly_linked:
            try:
                self._grow_descriptors(min(self.array(0).length // 2, _MOST_ADDED), may_compact=False)
            except OutOfMemory as error:
                full = error
        self._verify()
        if full:
            raise full

    def _list(self) -> Iterator[int]:
        """Return the numbers of the arrays in the order of the list; a damaged list ends after the largest length."""
        index = self._head
        for _ in range(POOL_SIZE // DESCRIPTOR_SIZE):
            if index == NO_ARRAY:
                return
            yield index
            index = self.array(index).link

    def _verify(self) -> None:
        last = count = 0
        tail = NO_ARRAY
        for index in self._list():
            offset, _, _, back, _ = self.array(index)
            if self.doubly_linked and back != tail:
                raise BadProgram(Fault.ARRAY_LIST, "arrays that are not linked backwards")
            if offset != NOT_AN_OFFSET:
                if offset < last:
                    raise BadProgram(Fault.ARRAY_LIST, "arrays that are not in the order of the list")
                last = offset
            tail, count = index, count + 1
        if count == 0 or tail != self._tail or count + self._free_count() != self.array(0).length:
            raise BadProgram(Fault.ARRAY_LIST, "a list that does not contain each array once")

    def _free_count(self) -> int:
        count, index = 0, self._free
        while index != NO_ARRAY and count <= POOL_SIZE:
            count, index = count + 1, self.array(index).link
        return count

    def begin_pass(self) -> None:
        """Allow the work that a pass has time for."""
        self.work_left = _WORK if self.work_left >= 0 else self.work_left + _WORK

    def signed(self, offset: int) -> int:
        """Return the offset of a variable: those from 8000 hex on count from the end, so they lead to the records.

        The memory in front of the pool is not simulated: an offset that leads there stays as it is.
        """
        return offset - _OFFSETS if offset >= _OFFSETS - self.base else offset

    def load(self, kind: int, offset: int) -> Number:
        """Return the scalar at `offset`.

        Raises:
            struct.error: It is outside of the pool.
        """
        value: Number = SCALARS[kind].unpack_from(self.pool, self.base + offset)[0]
        return value

    def store(self, kind: int, offset: int, value: float) -> None:
        """Store a scalar at `offset`; integers keep the bits that fit.

        Raises:
            struct.error: It is outside of the pool.
        """
        if kind == Type.FLOAT:
            value = single(value)
        else:
            bits = 8 * SCALARS[kind].size
            value = int(value) & (1 << bits) - 1
            if kind in SIGNED and value >> (bits - 1):
                value -= 1 << bits
        SCALARS[kind].pack_into(self.pool, self.base + offset, value)

    def read(self, offset: int, size: int) -> bytes:
        """Return the bytes at `offset`.

        Raises:
            OutOfMemory: They are outside of the pool.
        """
        start = self.base + offset
        if size and start + size > len(self.pool):
            raise OutOfMemory("outside of the memory")
        self.spend(size // BYTES_PER_ACCESS)
        return bytes(self.pool[start : start + size])

    def write(self, offset: int, data: bytes) -> None:
        """Write bytes at `offset`.

        Raises:
            OutOfMemory: They are outside of the pool.
        """
        start = self.base + offset
        if data:
            if start + len(data) > len(self.pool):
                raise OutOfMemory("outside of the memory")
            self.pool[start : start + len(data)] = data

    def index(self, offset: int) -> int:
        """Return the number of the descriptor of the array at `offset`."""
        return int(INDEX.unpack_from(self.pool, self.base + offset)[0])

    def array(self, index: int) -> Array:
        """Return the descriptor of an array.

        Raises:
            OutOfMemory: It is outside of the pool.
        """
        self.spend(1)
        return tuple.__new__(Array, DESCRIPTOR.unpack_from(self.pool, self._descriptor(index)))

    @property
    def table(self) -> tuple[int, int]:
        """Where the descriptors are in the pool, and their size in bytes."""
        at = self.base + self.descriptors
        return at, DESCRIPTOR_SIZE * int(INDEX.unpack_from(self.pool, at + LENGTH_AT)[0])

    def spend(self, parts: int) -> None:
        """Count work.

        Raises:
            OutOfMemory: It is more than an instruction may cause.
        """
        self.work_left -= parts
        if self.work_left < -_MOST_WORK:
            raise OutOfMemory("more work than an instruction may cause")

    def describe(self, index: int, array: Array) -> None:
        """Change a descriptor."""
        DESCRIPTOR.pack_into(self.pool, self._descriptor(index), *(value & OFFSET_MASK for value in array))

    def _descriptor(self, index: int) -> int:
        at = self.base + self.descriptors + DESCRIPTOR_SIZE * index
        if at + DESCRIPTOR_SIZE > len(self.pool):
            raise OutOfMemory(f"there is no array {index}")
        return at

    def new_array(self, element_size: int, *, may_compact: bool = True) -> int:
        """Allocate an empty array at the end of the list; returns the number of its descriptor.

        Raises:
            OutOfMemory: There is no room for more descriptors.
        """
        if self._free == NO_ARRAY:
            self._grow_descriptors(self._growth, may_compact=may_compact)
        index = self._free
        self._free = self.array(index).link
        self._set_back(self._free, NO_ARRAY)
        self.describe(index, Array(NOT_AN_OFFSET, element_size, 0, NO_ARRAY, NO_ARRAY))
        self._append(index)
        return index

    def free_array(self, index: int) -> None:
        """Free an array and its descriptor."""
        self._unlink(index)
        self.describe(index, Array(NOT_AN_OFFSET, 0, 0, NO_ARRAY, self._free))
        self._set_back(self._free, index)
        self._free = index

    def resize(self, index: int, count: int, *, may_compact: bool = True) -> None:
        """Set the length of an array; new elements keep what was in memory.

        An array grows where it is if the next one in the list is far enough, or seems so as it has no memory yet;
        else it moves to the end. In a full pool all arrays move together, and that is tried again from the beginning.

        Raises:
            OutOfMemory: There is no room.
        """
        try:
            self._resize(index, count)
        except PoolFull:
            if not may_compact:
                raise
            self.compact()
            self._resize(index, count)

    def _resize(self, index: int, count: int) -> None:
        array = self.array(index)
        if count == array.length:
            return
        size = array.element * count & OFFSET_MASK
        if count > array.length and (array.offset == NOT_AN_OFFSET or size > self._room(array)):
            offset = self._allocate(size, may_compact=False)
            old = self.read(array.offset, array.size)
            self.write(offset, old)
            if not self.doubly_linked:
                self.write(array.offset, bytes([_ERASED] * len(old)))
            if index == 0:
                self.descriptors = offset
            self.describe(index, self.array(index)._replace(offset=offset))
            self._move_to_tail(index)
        INDEX.pack_into(self.pool, self._descriptor(index) + LENGTH_AT, count & OFFSET_MASK)

    def _room(self, array: Array) -> int:
        """Return the bytes from an array to the next one, or to the end of what is used.

        The difference has 16 bits: in a damaged list, an array has room up to one that is in front of it.
        """
        end = self.end if array.link == NO_ARRAY else self.array(array.link).offset
        return end - array.offset & OFFSET_MASK

    def bytes_of(self, index: int) -> bytes:
        """Return the stored bytes of an array."""
        array = self.array(index)
        return self.read(array.offset, array.size)

    def set_bytes(self, index: int, data: bytes | memoryview, *, may_compact: bool = True) -> None:
        """Set the length of an array and store its bytes; those in the pool are read only then.

        Raises:
            OutOfMemory: There is no room.
        """
        element = self.array(index).element or 1
        count = len(data) // element
        self.resize(index, count, may_compact=may_compact)
        self.write(self.array(index).offset, bytes(data[: count * element]))

    def _grow_descriptors(self, more: int, *, may_compact: bool = True) -> None:
        """Append free descriptors; the array of descriptors moves even if `more` is 0."""
        _, element, first, *_ = self.array(0)
        count = first + more & OFFSET_MASK
        offset = self._allocate(element * count & OFFSET_MASK, may_compact=may_compact)
        self.write(offset, self.read(self.descriptors, element * first & OFFSET_MASK))
        self.descriptors = offset
        for index in range(first, count):
            back = index - 1 if index > first and self.doubly_linked else NO_ARRAY
            self.describe(index, Array(NOT_AN_OFFSET, 0, 0, back, index + 1 if index < count - 1 else self._free))
        self._free = first if more else self._free
        self.describe(0, self.array(0)._replace(offset=offset, length=count))
        self._move_to_tail(0)

    def _allocate(self, size: int, *, may_compact: bool = True) -> int:
        end = aligned(self.end)
        if may_compact and self.base + end + size >= POOL_SIZE:
            self.compact()
            end = aligned(self.end)
        if self.base + end + size >= POOL_SIZE:
            raise PoolFull
        self.end = end + size
        return end

    def compact(self) -> None:
        """Move all arrays together, in the order of the list; the memory that they leave is erased."""
        end = self.program.header.static_size
        for index in self._list():
            array = self.array(index)
            size = array.size
            if array.offset != NOT_AN_OFFSET:
                end = aligned(end)
                if end < array.offset:
                    self.write(end, self.read(array.offset, size))
                    left = max(end + size, array.offset)
                    self.write(left, bytes([_ERASED] * (array.offset + size - left)))
                    if index == 0:
                        self.descriptors = end
                    INDEX.pack_into(self.pool, self._descriptor(index), end)
                else:
                    end = array.offset
                end += size
        self.end = end

    def _move_to_tail(self, index: int) -> None:
        if index != self._tail:
            self._unlink(index)
            self._append(index)

    def _append(self, index: int) -> None:
        if self._tail != NO_ARRAY:
            self.describe(self._tail, self.array(self._tail)._replace(link=index))
        self._head = index if self._tail == NO_ARRAY else self._head
        self.describe(index, self.array(index)._replace(link=NO_ARRAY))
        self._set_back(index, self._tail)
        self._tail = index

    def _unlink(self, index: int) -> None:
        array = self.array(index)
        back = array.back
        if not self.doubly_linked:
            back = next((other for other in self._list() if self.array(other).link == index), NO_ARRAY)
        if index == self._head:
            self._head, back = array.link, NO_ARRAY
        elif back != NO_ARRAY:
            self.describe(back, self.array(back)._replace(link=array.link))
        if index == self._tail:
            self._tail = back
        elif array.link != NO_ARRAY:
            self._set_back(array.link, back)

    def _set_back(self, index: int, back: int) -> None:
        if self.doubly_linked and index != NO_ARRAY:
            self.describe(index, self.array(index)._replace(back=back))


def aligned(size: int) -> int:
    """`size` rounded up to whole words of four bytes."""
    return -(-size // _ALIGNMENT) * _ALIGNMENT
