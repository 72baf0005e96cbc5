"""Arrays of numbers as a whole, which is faster than one by one, with the same result.

It is not done where it would not be the same: in damaged programs, whose arrays overlap each other or have gaps.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from itertools import repeat
from typing import NamedTuple

from sim_backend.firmware.vm.data import Data, Place, whole
from sim_backend.firmware.vm.numbers import SCALARS, Number
from sim_backend.firmware.vm.rxe import Type

_OFFSETS = 0x10000
"""Number of offsets in the pool; from the last one on they begin again."""

_NUMBERS_PER_PART = 8
"""Numbers that count as much work as one that is handled alone."""


class Row(NamedTuple):
    """The numbers of an array, side by side in the pool.

    Attributes:
        at: Place in the pool.
        length: How many.
        kind: Type of each.
    """

    at: int
    length: int
    kind: int

    @property
    def size(self) -> int:
        """Bytes of all numbers."""
        return SCALARS[self.kind].size * self.length

    def overlaps(self, at: int, size: int) -> bool:
        """Whether it shares bytes with others."""
        return at < self.at + self.size and self.at < at + size


def row(data: Data, place: Place) -> Row | None:
    """The numbers of a value; None if it is no array of numbers that lie side by side."""
    if data.kind(place.entry) != Type.ARRAY:
        return None
    kind, _, offset = data.entry(place.entry + 1)
    if kind not in SCALARS or kind == Type.VOID or offset:
        return None
    array = data.array(place)
    found = Row(data.memory.base + array.offset, array.length, kind)
    if array.element != SCALARS[kind].size or array.offset + found.size > _OFFSETS:
        return None
    data.memory.spend(array.length // _NUMBERS_PER_PART)
    return found


def read(data: Data, numbers: Row, length: int) -> Sequence[Number]:
    """The first numbers of a row."""
    return struct.unpack_from(f"<{length}{SCALARS[numbers.kind].format[-1]}", data.memory.pool, numbers.at)


def write(data: Data, numbers: Row, values: Iterable[Number]) -> None:
    """Store as many numbers as a row has, converted to their type."""
    if numbers.kind == Type.FLOAT:
        struct.pack_into(f"<{numbers.length}f", data.memory.pool, numbers.at, *values)
    else:
        write_integers(data, numbers, [whole(value) if isinstance(value, float) else value for value in values])


def write_integers(data: Data, numbers: Row, values: Iterable[int]) -> None:
    """Store as many integers as a row of integers has; they keep the bits that fit."""
    layout = SCALARS[numbers.kind]
    mask, code = (1 << 8 * layout.size) - 1, layout.format[-1].upper()
    pool = data.memory.pool
    struct.pack_into(f"<{numbers.length}{code}", pool, numbers.at, *[value & mask for value in values])


def source(data: Data, place: Place, target: Row) -> Iterable[Number] | None:
    """The numbers that are combined with those of a target: those of an array, or one again and again.

    None if the target's numbers change them meanwhile, or they do not lie side by side.
    """
    if data.is_aggregate(place.entry):
        numbers = row(data, place)
        same = numbers is not None and (numbers.at, numbers.kind) == (target.at, target.kind)
        if numbers is None or (not same and target.overlaps(numbers.at, numbers.size)):
            return None
        return read(data, numbers, min(target.length, numbers.length))
    if data.kind(place.entry) not in SCALARS or place.entry >= data.first_field:
        return None
    size = SCALARS[data.kind(place.entry)].size
    if target.overlaps(data.memory.base + (data.address(place) & 0xFFFF), size):
        return None
    return repeat(data.get(place.entry, place.offset), target.length)


def fill(data: Data, target: Row) -> None:
    """Copy the first number to all others."""
    size = SCALARS[target.kind].size
    pool = data.memory.pool
    pool[target.at : target.at + target.size] = pool[target.at : target.at + size] * target.length


def copy(data: Data, target: Row, numbers: Row, first: int) -> bool:
    """Copy as many numbers of the same type as the target has; False if copying them one by one would differ."""
    size = SCALARS[target.kind].size
    start, end = numbers.at + first * size, numbers.at + first * size + target.size
    if target.kind != numbers.kind or (target.at > start and target.overlaps(start, target.size)):
        return False
    pool = data.memory.pool
    pool[target.at : target.at + target.size] = pool[start:end]
    return True
