"""Operations on whole arrays of numbers, which are faster than one by one and have the same result.

They are not used where the result would differ: in damaged programs, whose arrays overlap each other or have gaps.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np

from sim_backend.firmware.vm.data import Data, Place
from sim_backend.firmware.vm.numbers import SCALARS, Number
from sim_backend.firmware.vm.rxe import Type

OFFSETS = 0x10000
"""Number of offsets in the pool; from the last one on they begin again."""

_NUMBERS_PER_PART = 8
"""Numbers that count as much work as one that is handled alone."""

_DTYPES: Mapping[int, np.dtype[Any]] = {kind: np.dtype(layout.format) for kind, layout in SCALARS.items()}
_UNSIGNED = {size: np.dtype(f"<u{size}") for size in (1, 2, 4)}
_WHOLE = slice(None)

EXACT = (Type.FLOAT, Type.UBYTE, Type.SBYTE, Type.UWORD, Type.SWORD)
"""Types whose values are numbers of single precision."""

Again = Callable[[], object]
"""Repeats an instruction while its arrays are at the same places and have the same lengths.

It returns False, without effect, if it cannot."""


class Row(NamedTuple):
    """Adjacent numbers in the pool.

    Attributes:
        at: Place in the pool.
        length: Their number.
        kind: Their type.
        single: Whether it is a variable, which is combined with each number of an array.
    """

    at: int
    length: int
    kind: int
    single: bool = False

    @property
    def shape(self) -> tuple[int, ...]:
        """Their type in numpy."""
        return () if self.single else (self.length,)

    @property
    def size(self) -> int:
        """Bytes of all numbers."""
        return SCALARS[self.kind].size * self.length

    def overlaps(self, at: int, size: int) -> bool:
        """Return whether it shares bytes with others."""
        return at < self.at + self.size and self.at < at + size


def row(data: Data, place: Place) -> Row | None:
    """Return the numbers of a value; None if it is not an array of adjacent numbers, apart from the descriptors."""
    if data.kind(place.entry) != Type.ARRAY:
        return None
    kind, _, offset = data.entry(place.entry + 1)
    if kind not in SCALARS or kind == Type.VOID or offset:
        return None
    array = data.array(place)
    found = Row(data.memory.base + array.offset, array.length, kind)
    if array.element != SCALARS[kind].size or array.offset + found.size > OFFSETS:
        return None
    if found.overlaps(*data.memory.table):
        return None
    data.memory.spend(array.length // _NUMBERS_PER_PART)
    return found


def source(data: Data, place: Place, target: Row) -> Row | None:
    """Return the numbers that are combined with those of a target: those of an array, or a variable.

    None if the target's numbers change them meanwhile, or they are not adjacent.
    """
    if data.is_aggregate(place.entry):
        numbers = row(data, place)
        if numbers is None or numbers.length < target.length:
            return None
        same = (numbers.at, numbers.kind) == (target.at, target.kind)
        return (
            None if not same and target.overlaps(numbers.at, numbers.size) else numbers._replace(length=target.length)
        )
    kind = data.kind(place.entry)
    if kind not in SCALARS or place.entry >= data.first_field:
        return None
    number = Row(data.memory.base + data.address(place), 1, kind, single=True)
    return None if target.overlaps(number.at, number.size) else number


def _view(data: Data, numbers: Row, width: int) -> np.ndarray[Any, Any]:
    """Return the numbers themselves; only their low bytes, without a sign, if they are at least as wide as wanted."""
    dtype = _DTYPES[numbers.kind]
    wanted: np.dtype[Any] = _UNSIGNED[width] if dtype.itemsize >= width and numbers.kind != Type.FLOAT else dtype
    return np.ndarray(
        numbers.shape, wanted, data.memory.pool, numbers.at, strides=(dtype.itemsize,) * len(numbers.shape)
    )


def calculation(data: Data, operation: np.ufunc, target: Row, sources: Sequence[Row]) -> Again | None:
    """Return an operation of numbers whose low bits do not depend on the signs, or of floats; None for other types.

    Args:
        data: The variables.
        operation: The operation; of floats only a sum, a difference or a product.
        target: Where the results are stored.
        sources: The values that it is calculated from.
    """
    kinds = [target.kind, *(numbers.kind for numbers in sources)]
    width = SCALARS[target.kind].size
    results, *numbers = (_view(data, each, width) for each in (target, *sources))
    if Type.FLOAT not in kinds:
        if all(each.dtype == results.dtype for each in numbers):
            return partial(operation, *numbers, results)
        return partial(operation, *numbers, results, dtype=results.dtype, casting="unsafe")
    if target.kind != Type.FLOAT or not all(kind in EXACT for kind in kinds) or operation not in _OF_FLOATS:
        return None
    floats = partial(operation, *numbers, results, dtype=results.dtype, casting="unsafe")

    def calculate() -> None:
        with np.errstate(all="ignore"):
            floats()

    return calculate


_OF_FLOATS = (np.add, np.subtract, np.multiply)


def values(data: Data, numbers: Row) -> Iterable[Number]:
    """Return the numbers as Python's; that of a variable again and again."""
    layout, pool = SCALARS[numbers.kind], data.memory.pool
    if numbers.single:
        return repeat(layout.unpack_from(pool, numbers.at)[0])
    return struct.unpack_from(f"<{numbers.length}{layout.format[-1]}", pool, numbers.at)


def write(data: Data, target: Row, results: Iterable[Number]) -> None:
    """Store as many numbers as a row has, converted to their type."""
    layout, pool = SCALARS[target.kind], data.memory.pool
    if target.kind == Type.FLOAT:
        struct.pack_into(f"<{target.length}f", pool, target.at, *results)
        return
    mask, code = (1 << 8 * layout.size) - 1, layout.format[-1].upper()
    bits = [(data.whole(value, target.kind) if isinstance(value, float) else value) & mask for value in results]
    struct.pack_into(f"<{target.length}{code}", pool, target.at, *bits)


def calculate_each(data: Data, operation: Callable[..., Number], target: Row, sources: Sequence[Row]) -> None:
    """Store the results of any operation, which gets the type of the target, then each number and its type."""
    kinds = [repeat(numbers.kind) for numbers in sources]
    numbers = [values(data, each) for each in sources]
    arguments = [part for pair in zip(numbers, kinds, strict=True) for part in pair]
    write(data, target, list(map(operation, repeat(target.kind, target.length), *arguments)))


def same(data: Data, one: Row, other: Row) -> bool:
    """Return whether two rows of integers are the same as far as both go."""
    size, pool = min(one.size, other.size), data.memory.pool
    return pool[one.at : one.at + size] == pool[other.at : other.at + size]


def bytes_copy(data: Data, target: int, source: int, size: int) -> Again:
    """Copies bytes within the pool."""
    pool = memoryview(data.memory.pool)
    return partial(pool[target : target + size].__setitem__, _WHOLE, pool[source : source + size])


def fill(data: Data, target: Row) -> None:
    """Copy the first number to all others."""
    size, pool = SCALARS[target.kind].size, data.memory.pool
    pool[target.at : target.at + target.size] = pool[target.at : target.at + size] * target.length


def copy(data: Data, target: Row, numbers: Row, first: int) -> None:
    """Copy as many numbers as the target has, see `copies`."""
    start, pool = numbers.at + first * SCALARS[target.kind].size, data.memory.pool
    pool[target.at : target.at + target.size] = pool[start : start + target.size]


def copies(target: Row, numbers: Row, first: int) -> bool:
    """Return whether copying numbers as a whole, as many as the target has, is the same as copying them one by one."""
    start = numbers.at + first * SCALARS[target.kind].size
    return target.kind == numbers.kind and not (target.at > start and target.overlaps(start, target.size))
