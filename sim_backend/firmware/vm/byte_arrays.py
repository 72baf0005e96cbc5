"""Fast functions for array variables of bytes, such as texts: their place, their length, their content.

Each looks up the descriptor in the pool again, since programs can write anywhere. Source: docs/firmware.md section 8.1.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import NamedTuple

from sim_backend.firmware.vm.memory import (
    DESCRIPTOR,
    DESCRIPTOR_SIZE,
    INDEX,
    LENGTH_AT,
    NO_ARRAY,
    NOT_AN_OFFSET,
    Memory,
    OutOfMemory,
)

_WORD = INDEX.size
_WORDS, _LENGTH = DESCRIPTOR_SIZE // _WORD, LENGTH_AT // _WORD
"""Words of a descriptor, and index of the length among them."""

Finder = Callable[[], tuple[int, int]]
"""Returns the place in the pool of the first element of an array, and its length."""


class ByteArray(NamedTuple):
    """A variable that is taken for an array of bytes.

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
        at = base + (array.address & 0xFFFF)
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


def resizer(array: ByteArray) -> Callable[[int], int]:
    """Return a function that sets the length of an array, and returns its place in the pool."""
    memory, pool, base, find = array.memory, array.memory.pool, array.memory.base, finder(array)
    index, descriptor, set_word = INDEX.unpack_from, DESCRIPTOR.unpack_from, INDEX.pack_into
    variable = base + array.address

    def resize_anywhere(count: int) -> int:
        at, length = find()
        if length == count:
            return at
        memory.resize(array.number(), count)
        return find()[0]

    if not array.is_array:
        return resize_anywhere

    def resize(count: int) -> int:
        table = base + memory.descriptors
        own = table + DESCRIPTOR_SIZE * index(pool, variable)[0]
        offset, element, length, _, link = descriptor(pool, own)
        if count != length:
            work = 1
            if count > length:
                following = table + DESCRIPTOR_SIZE * link
                if offset == NOT_AN_OFFSET or (link != NO_ARRAY and following + DESCRIPTOR_SIZE > len(pool)):
                    return resize_anywhere(count)
                end, work = (memory.end, 1) if link == NO_ARRAY else (index(pool, following)[0], 2)
                if element * count & 0xFFFF > end - offset:
                    return resize_anywhere(count)
            memory.work_left -= work
            set_word(pool, own + LENGTH_AT, count & 0xFFFF)
        at: int = base + offset
        return at

    return resize


def writer(array: ByteArray) -> Callable[[bytes | bytearray], None]:
    """Return a function that sets length and bytes of an array, and raises OutOfMemory outside of the pool."""
    resize, pool = resizer(array), array.memory.pool

    def put(content: bytes | bytearray) -> None:
        count = len(content)
        at = resize(count)
        if at + count > len(pool):
            raise OutOfMemory("outside of the memory")
        pool[at : at + count] = content

    return put
