"""Move, calculate and compare values of any type; arrays and clusters element by element.

Source: LEGO's executable file specification; docs/firmware.md section 8.2.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from sim_backend.firmware.vm import bulk
from sim_backend.firmware.vm.data import AGGREGATES, ERR_ARG, Data, Place, ProgramError
from sim_backend.firmware.vm.numbers import SIGNED, Number
from sim_backend.firmware.vm.rxe import SIZES, Type

Binary = Callable[[int, Number, int, Number, int], Number]
"""An operation of two numbers: type of the target, then each number with its type."""
Unary = Callable[[int, Number, int], Number]
"""An operation of one number: type of the target, then the number with its type."""

Plain = Callable[[Any, Any], int]
"""An operation of two integers, whatever their types."""

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
"""The comparison of each number in an instruction's flags; the last two never hold."""
HOLD_FOR_EQUALS = (2, 3, 4)
"""The comparisons that hold for equal values."""


def move(data: Data, target: Place, source: Place) -> None:
    """Copy a value.

    Raises:
        ProgramError: A cluster is copied to an array.
    """
    calculate_each(data, _same, target, source, copies_arrays=same_scalars)


def _same(_: int, value: Number, __: int) -> Number:
    return value


def same_scalars(data: Data, left: int, right: int) -> bool:
    """Whether the elements of two arrays have the same scalar type."""
    kind = data.kind(left)
    return kind == data.kind(right) and kind in SIZES and kind != Type.ARRAY


def same_integers(data: Data, left: int, right: int) -> bool:
    """Whether the elements of two arrays have the same integer type."""
    return same_scalars(data, left, right) and data.kind(left) != Type.FLOAT


def never(_: Data, __: int, ___: int) -> bool:
    """No arrays."""
    return False


def calculate(
    data: Data, operation: Binary, target: Place, left: Place, right: Place, plain: Plain | None = None
) -> None:
    """Store the result of an operation; a number is combined with each part of an array or cluster.

    `plain` is the operation of integers, if their types do not matter.

    Nothing happens if the target is a number and a source is not, or the other way round.

    Raises:
        ProgramError: The target is an array and no source is one.
    """
    data.memory.spend(1)
    kinds = [data.kind(place.entry) for place in (target, left, right)]
    if not any(kind in AGGREGATES for kind in kinds):
        a, b = data.get(left.entry, left.offset), data.get(right.entry, right.offset)
        data.put(target.entry, operation(kinds[0], a, kinds[1], b, kinds[2]), target.offset)
        return
    if kinds[0] not in AGGREGATES or not any(kind in AGGREGATES for kind in kinds[1:]):
        return
    wanted = (Type.ARRAY,) if kinds[0] == Type.ARRAY else AGGREGATES
    counts = [data.count(place) for place, kind in zip((left, right), kinds[1:], strict=True) if kind in wanted]
    if not counts:
        raise ProgramError(ERR_ARG, "an operation of clusters whose result is an array")
    if kinds[0] == Type.ARRAY:
        data.resize(target, min(counts))
    else:
        counts.append(data.count(target))
    if kinds[0] == Type.ARRAY and _calculate_rows(data, operation, plain, target, (left, right)):
        return
    for i in range(min(counts)):
        parts = [_part(data, place, i, kinds[0]) for place in (target, left, right)]
        calculate(data, operation, parts[0], parts[1], parts[2], plain)


def calculate_each(data: Data, operation: Unary, target: Place, source: Place, *, copies_arrays: Copies) -> None:
    """Store the result of an operation of one value; nothing if just one of both is an array or cluster.

    Args:
        data: The variables.
        operation: What to store.
        target: Where to store it; a cluster takes as many parts as it has members.
        source: The value.
        copies_arrays: Tells of the types of two arrays whether one is copied to the other as it is.

    Raises:
        ProgramError: The target is an array and the source a cluster.
    """
    data.memory.spend(1)
    to, of = data.kind(target.entry), data.kind(source.entry)
    if to not in AGGREGATES and of not in AGGREGATES:
        data.put(target.entry, operation(to, data.get(source.entry, source.offset), of), target.offset)
        return
    if to not in AGGREGATES or of not in AGGREGATES:
        return
    if to == Type.ARRAY:
        if of == Type.CLUSTER:
            raise ProgramError(ERR_ARG, "a cluster is copied to an array")
        count = data.array(source).length
        data.resize(target, count)
        if copies_arrays(data, target.entry + 1, source.entry + 1):
            data.memory.write(data.array(target).offset, data.numbers_of(source))
            return
        if _calculate_row(data, operation, target, source):
            return
    else:
        count = data.count(target)
    for i in range(count):
        calculate_each(data, operation, _part(data, target, i), _part(data, source, i), copies_arrays=copies_arrays)


def _calculate_rows(
    data: Data, operation: Binary, plain: Plain | None, target: Place, sources: tuple[Place, Place]
) -> bool:
    """Calculate the numbers of an array as a whole, if that gives the same."""
    to = bulk.row(data, target)
    if to is None:
        return False
    left, right = (bulk.source(data, place, to) for place in sources)
    if left is None or right is None:
        return False
    kinds = [data.kind(place.entry + data.is_aggregate(place.entry)) for place in sources]
    if plain and Type.FLOAT not in (to.kind, *kinds):
        bulk.write_integers(data, to, map(plain, left, right))
    else:
        bulk.write(data, to, [operation(to.kind, a, kinds[0], b, kinds[1]) for a, b in zip(left, right, strict=False)])
    return True


def _calculate_row(data: Data, operation: Unary, target: Place, source: Place) -> bool:
    """The same for an operation of one value."""
    to = bulk.row(data, target)
    values = None if to is None else bulk.source(data, source, to)
    if to is None or values is None:
        return False
    kind = data.kind(source.entry + 1)
    bulk.write(data, to, [operation(to.kind, value, kind) for value in values])
    return True


def _part(data: Data, place: Place, number: int, into: int = Type.CLUSTER) -> Place:
    """Element or member of an aggregate; a number itself. The firmware takes a cluster's first member for arrays."""
    kind = data.kind(place.entry)
    if kind == Type.ARRAY:
        array = data.array(place)
        return Place(place.entry + 1, array.offset + number * array.element)
    if kind == Type.CLUSTER:
        return Place(data.member(place.entry, 0 if into == Type.ARRAY else number), place.offset)
    return place


def compare(data: Data, relation: int, left: Place, right: Place) -> bool:
    """Result of a comparison; arrays are compared in lexical order.

    Raises:
        ProgramError: The types do not fit each other.
    """
    decided = _compare(data, relation, left, right)
    return relation in HOLD_FOR_EQUALS if decided is None else decided


def _compare(data: Data, relation: int, left: Place, right: Place) -> bool | None:
    """The result, or None if both are equal so far."""
    data.memory.spend(1)
    kinds = data.kind(left.entry), data.kind(right.entry)
    if kinds[0] not in AGGREGATES:  # of an array or cluster on the right, 0 counts
        a, b = data.get(left.entry, left.offset), data.get(right.entry, right.offset)
        a, b = comparable(a, kinds[0], b, kinds[1])
        return None if a == b else COMPARISONS[relation](a, b)
    if kinds[0] != kinds[1]:
        raise ProgramError(ERR_ARG, "an array is compared with something else")
    one_row, other_row = (bulk.row(data, place) for place in (left, right))
    if one_row and other_row and one_row.kind == other_row.kind != Type.FLOAT:
        count = min(one_row.length, other_row.length)
        if bulk.read(data, one_row, count) == bulk.read(data, other_row, count):
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


def comparable(left: Number, left_kind: int, right: Number, right_kind: int) -> tuple[Number, Number]:
    """Two numbers as they are compared and divided: as unsigned ones unless both have a sign, or one is a float."""
    if (left_kind in SIGNED and right_kind in SIGNED) or Type.FLOAT in (left_kind, right_kind):
        return left, right
    return int(left) & _U32, int(right) & _U32
