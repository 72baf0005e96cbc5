"""Move, calculate and compare values of any type; arrays and clusters element by element.

Source: LEGO's executable file specification; docs/firmware.md section 8.2.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import count, islice, repeat
from typing import Any

import numpy as np

from sim_backend.firmware.cint import s32
from sim_backend.firmware.vm import bulk
from sim_backend.firmware.vm.bulk import Again
from sim_backend.firmware.vm.data import AGGREGATES, ERR_ARG, Data, Place, ProgramError
from sim_backend.firmware.vm.numbers import SIGNED, Number
from sim_backend.firmware.vm.rxe import SIZES, Type

Binary = Callable[[int, Number, int, Number, int], Number]
"""An operation of two numbers: type of the target, then each number with its type."""
Unary = Callable[[int, Number, int], Number]
"""An operation of one number: type of the target, then the number with its type."""

Copies = Callable[[Data, int, int], bool]

_U32 = 0xFFFF_FFFF

COMPARISONS: tuple[Callable[[Any, Any], bool], ...] = (
    operator.lt,
    operator.gt,
    operator.le,
    operator.ge,
    operator.eq,
    operator.ne,
    lambda _, __: False,
    lambda _, __: False,
)
"""The comparison of each number in an instruction's flags; the last two are never true."""
HOLD_FOR_EQUALS = (2, 3, 4)
"""The comparisons that hold for equal values."""


def move(data: Data, target: Place, source: Place) -> Again | None:
    """Copy a value; return how to do so again, see `calculate`.

    Raises:
        ProgramError: A cluster is copied to an array.
    """
    return calculate_each(data, _same, target, source, copies_arrays=same_scalars, whole=np.positive)


def _same(target: int, value: Number, kind: int) -> Number:
    return 0.0 if kind == Type.VOID and target == Type.FLOAT else value


def same_scalars(data: Data, left: int, right: int) -> bool:
    """Return whether the elements of two arrays have the same scalar type."""
    kind = data.kind(left)
    return kind == data.kind(right) and kind in SIZES and kind != Type.ARRAY


def same_integers(data: Data, left: int, right: int) -> bool:
    """Return whether the elements of two arrays have the same integer type."""
    return same_scalars(data, left, right) and data.kind(left) != Type.FLOAT


def never(_: Data, __: int, ___: int) -> bool:
    """No arrays."""
    return False


def calculate(
    data: Data, operation: Binary, target: Place, left: Place, right: Place, whole: np.ufunc | None = None
) -> Again | None:
    """Store the result of an operation; a number is combined with each part of an array or cluster.

    Nothing happens if the target is a number and a source is not, or the other way round.

    `whole` is the same operation of arrays of numbers, if it is one whose low bits do not depend on the signs.

    Returns:
        How to do it again, if that is fast.

    Raises:
        ProgramError: The target is an array and no source is one.
    """
    data.memory.spend(1)
    kinds = [data.kind(place.entry) for place in (target, left, right)]
    if not any(kind in AGGREGATES for kind in kinds):
        a, b = data.get(left.entry, left.offset), data.get(right.entry, right.offset)
        data.put(target.entry, operation(kinds[0], a, kinds[1], b, kinds[2]), target.offset)
        return None
    if kinds[0] not in AGGREGATES or not any(kind in AGGREGATES for kind in kinds[1:]):
        return None
    wanted = (Type.ARRAY,) if kinds[0] == Type.ARRAY else AGGREGATES
    counts = [data.count(place) for place, kind in zip((left, right), kinds[1:], strict=True) if kind in wanted]
    if not counts:
        raise ProgramError(ERR_ARG, "an operation of clusters whose result is an array")
    if kinds[0] != Type.ARRAY:
        counts.append(data.count(target))
    else:
        data.resize(target, min(counts))
        if again := _calculate_rows(data, operation, target, (left, right), whole):
            return again
    parts = [_parts(data, place, kinds[0]) for place in (target, left, right)]
    for to, one, other in islice(zip(*parts, strict=False), min(counts)):
        calculate(data, operation, to, one, other, whole)
    return None


def calculate_each(
    data: Data,
    operation: Unary,
    target: Place,
    source: Place,
    *,
    copies_arrays: Copies,
    whole: np.ufunc | None = None,
) -> Again | None:
    """Store the result of an operation of one value; nothing if just one of both is an array or cluster.

    Args:
        data: The variables.
        operation: What to store.
        target: Where to store it; a cluster takes as many parts as it has members.
        source: The value.
        copies_arrays: Returns, for the types of two arrays, whether one is copied to the other unchanged.
        whole: See `calculate`.

    Returns:
        See `calculate`.

    Raises:
        ProgramError: The target is an array and the source a cluster.
    """
    data.memory.spend(1)
    to, of = data.kind(target.entry), data.kind(source.entry)
    if to not in AGGREGATES and of not in AGGREGATES:
        data.put(target.entry, operation(to, data.get(source.entry, source.offset), of), target.offset)
        return None
    if to not in AGGREGATES or of not in AGGREGATES:
        return None
    if to == Type.ARRAY:
        if of == Type.CLUSTER:
            raise ProgramError(ERR_ARG, "a cluster is copied to an array")
        length = data.array(source).length
        data.resize(target, length)
        if copies_arrays(data, target.entry + 1, source.entry + 1):
            content = data.numbers_of(source)
            data.memory.write(data.array(target).offset, content)
            return bulk.bytes_copy(data, data.span(target.entry)[0], data.span(source.entry)[0], len(content))
        if again := _calculate_rows(data, operation, target, (source,), whole):
            return again
    else:
        length = data.count(target)
    for to_part, part in islice(zip(_parts(data, target), _parts(data, source), strict=False), length):
        calculate_each(data, operation, to_part, part, copies_arrays=copies_arrays, whole=whole)
    return None


def _calculate_rows(
    data: Data, operation: Callable[..., Number], target: Place, sources: Sequence[Place], whole: np.ufunc | None
) -> Again | None:
    """Calculate the numbers of an array as a whole, if that gives the same; return how to do it again."""
    to = bulk.row(data, target)
    if to is None:
        return None
    rows = [bulk.source(data, place, to) for place in sources]
    found = [numbers for numbers in rows if numbers]
    if len(found) < len(rows):
        return None
    again = bulk.calculation(data, whole, to, found) if whole else None
    again = again or partial(bulk.calculate_each, data, operation, to, found)
    again()
    return again


def _parts(data: Data, place: Place, into: int = Type.CLUSTER) -> Iterator[Place]:
    """Return the elements or members of an aggregate without an end, or a number itself again and again.

    In arrays, a cluster's first member counts.
    """
    kind = data.kind(place.entry)
    if kind == Type.ARRAY:
        return data.elements(place)
    if kind == Type.CLUSTER and into != Type.ARRAY:
        return (Place(data.member(place.entry, number), place.offset) for number in count())
    return repeat(Place(place.entry + 1, place.offset) if kind == Type.CLUSTER else place)


def compare(data: Data, relation: int, left: Place, right: Place) -> bool:
    """Return the result of a comparison; arrays are compared in lexical order.

    Raises:
        ProgramError: The types do not fit each other.
    """
    decided = _compare(data, relation, left, right)
    return relation in HOLD_FOR_EQUALS if decided is None else decided


def _compare(data: Data, relation: int, left: Place, right: Place) -> bool | None:
    """Return the result, or None if both are equal so far."""
    data.memory.spend(1)
    kinds = data.kind(left.entry), data.kind(right.entry)
    if kinds[0] not in AGGREGATES:  # of an array or cluster on the right, 0 counts
        a, b = comparable(*_whole(data, left), *_whole(data, right))
        return None if a == b else COMPARISONS[relation](a, b)
    if kinds[0] != kinds[1]:
        raise ProgramError(ERR_ARG, "an array is compared with something else")
    one_row, other_row = (bulk.row(data, place) for place in (left, right))
    comparable_rows = one_row and other_row and one_row.kind == other_row.kind != Type.FLOAT
    if one_row and other_row and comparable_rows and bulk.same(data, one_row, other_row):
        same = one_row.length == other_row.length
        return None if same else COMPARISONS[relation](one_row.length, other_row.length)
    first, second = data.parts(left), data.parts(right)
    for one, other in zip(first, second, strict=False):
        decided = _compare(data, relation, one, other)
        if decided is not None:
            return decided
    if len(first) == len(second):
        return None
    return COMPARISONS[relation](len(first), len(second))


def _whole(data: Data, place: Place) -> tuple[int, int]:
    """Return a scalar and its type as a comparison as a whole uses them: a float as an integer with a sign."""
    kind, value = data.kind(place.entry), data.integer(place.entry, place.offset)
    return (s32(value), Type.SLONG) if kind == Type.FLOAT else (value, kind)


def comparable(left: Number, left_kind: int, right: Number, right_kind: int) -> tuple[Number, Number]:
    """Return two numbers as they are compared and divided: unsigned, unless both have a sign or one is a float."""
    if Type.FLOAT in (left_kind, right_kind):
        return 0 if left_kind == Type.VOID else left, 0 if right_kind == Type.VOID else right
    if left_kind in SIGNED and right_kind in SIGNED:
        return left, right
    return int(left) & _U32, int(right) & _U32
