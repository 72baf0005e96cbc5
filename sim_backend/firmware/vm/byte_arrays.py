"""Fast functions for array variables of bytes, such as texts: their place, their length, their content.

Each looks up the descriptor in the pool again, since programs can write anywhere. Source: docs/firmware.md section 8.1.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import NamedTuple

from sim_backend.firmware.vm.array_descriptor import (
    DESCRIPTOR,
    DESCRIPTOR_SIZE,
    INDEX,
    LENGTH_AT,
    NO_ARRAY,
    NOT_AN_OFFSET,
)
from sim_backend.firmware.vm.memory import Memory, OutOfMemory

_WORD = INDEX.size
_WORDS, _LENGTH, _LINK = DESCRIPTOR_SIZE // _WORD, LENGTH_AT // _WORD, DESCRIPTOR_SIZE // _WORD - 1
"""Words of a descriptor, and the indices of the length and of the link among them."""

Finder = Callable[[], tuple[int, int]]
"""Returns the place in the pool of the first element of an array, and its length."""


class ByteArray(NamedTuple):
    """A variable that is used as an array of bytes.

    Attributes:
        memory: The pool.
        address: Offset of the number of its descriptor.
        is_array: Whether it is an array; else its elements are in its own place.
        number: Returns the number of its descriptor.
    """

    memory: Memory
    address: int
    is_array: bool
    number: Callable[[], int]


def finder(array: ByteArray) -> Finder:
    """Return a function for the place of an array."""
    memory, pool, base = array.memory, array.memory.pool, array.memory.base
    if not array.is_array:
        at = base + array.address
        return lambda: (at, memory.array(array.number()).length)
    variable, index, descriptor = base + array.address, INDEX.unpack_from, DESCRIPTOR.unpack_from

    def find() -> tuple[int, int]:
        number = index(pool, variable)[0]
        offset, _, length, _, _ = descriptor(pool, base + memory.descriptors + DESCRIPTOR_SIZE * number)
        return base + offset, length

    if variable % _WORD or sys.byteorder != "little":
        return find
    words, cell = memoryview(pool).cast("H"), variable // _WORD

    def find_by_words() -> tuple[int, int]:
        table = base + memory.descriptors
        if table % _WORD:
            return find()
        own = table // _WORD + _WORDS * words[cell]
        return base + words[own], words[own + _LENGTH]

    return find_by_words


class Resizer:
    """Sets the length of an array, and returns its place in the pool.

    Attributes:
        quick: Does so if no array moves for it, and returns -1 otherwise; then `slow` does it.
    """

    def __init__(self, array: ByteArray) -> None:
        self._array, self._find = array, finder(array)
        self.quick = _quick_resizer(array) if array.is_array else self._keep

    def slow(self, count: int) -> int:
        """Set the length, which may move arrays, and return the place of the first element."""
        self._array.memory.resize(self._array.number(), count)
        return self._find()[0]

    def _keep(self, count: int) -> int:
        at, length = self._find()
        return at if length == count else -1


def _quick_resizer(array: ByteArray) -> Callable[[int], int]:
    memory, pool, base = array.memory, array.memory.pool, array.memory.base
    index, descriptor, set_word = INDEX.unpack_from, DESCRIPTOR.unpack_from, INDEX.pack_into
    variable = base + array.address

    def resize(count: int) -> int:
        table = base + memory.descriptors
        own = table + DESCRIPTOR_SIZE * index(pool, variable)[0]
        offset, element, length, _, link = descriptor(pool, own)
        if count != length:
            work = 1
            if count > length:
                following = table + DESCRIPTOR_SIZE * link
                if offset == NOT_AN_OFFSET or (link != NO_ARRAY and following + DESCRIPTOR_SIZE > len(pool)):
                    return -1
                end, work = (memory.end, 1) if link == NO_ARRAY else (index(pool, following)[0], 2)
                if element * count & 0xFFFF > end - offset & 0xFFFF:
                    return -1
            memory.work_left -= work
            set_word(pool, own + LENGTH_AT, count & 0xFFFF)
        at: int = base + offset
        return at

    if variable % _WORD or sys.byteorder != "little":
        return resize
    words, cell = memoryview(pool).cast("H"), variable // _WORD

    def resize_by_words(count: int) -> int:
        table = base + memory.descriptors
        if table % _WORD:
            return resize(count)
        own = table // _WORD + _WORDS * words[cell]
        offset, length = words[own], words[own + _LENGTH]
        if count > length:
            link = words[own + _LINK]
            following = table // _WORD + _WORDS * link
            if offset == NOT_AN_OFFSET or (link != NO_ARRAY and following + _WORDS > len(words)):
                return -1
            end, work = (memory.end, 1) if link == NO_ARRAY else (words[following], 2)
            if words[own + 1] * count & 0xFFFF > end - offset & 0xFFFF:
                return -1
            memory.work_left -= work
            words[own + _LENGTH] = count & 0xFFFF
        elif count < length:
            memory.work_left -= 1
            words[own + _LENGTH] = count
        return base + offset

    return resize_by_words


def writer(array: ByteArray) -> Callable[[bytes | bytearray], None]:
    """Return a function that sets length and bytes of an array, and raises OutOfMemory outside of the pool."""
    resize, pool = Resizer(array), array.memory.pool
    quick, most = resize.quick, len(pool)

    def put(content: bytes | bytearray) -> None:
        count = len(content)
        at = quick(count)
        if at < 0:
            at = resize.slow(count)
        if at + count > most:
            raise OutOfMemory("outside of the memory")
        pool[at : at + count] = content

    return put
