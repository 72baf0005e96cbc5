"""Operations of numbers that only firmware 1.32 has. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from sim_backend.firmware.cint import s32
from sim_backend.firmware.vm.aggregates import Binary, Unary
from sim_backend.firmware.vm.data import rounded
from sim_backend.firmware.vm.numbers import SIGNED, Number, single
from sim_backend.firmware.vm.rxe import Type, size_of

_BITS = 32
_END_S64 = 1 << 63
_U32 = (1 << _BITS) - 1
_SIGNED_RANGE, _UNSIGNED_RANGE = (-(1 << _BITS - 1), (1 << _BITS - 1) - 1), (0, _U32)
_GREATEST = float.fromhex("0x1.fffffep127")
_RANGES: Mapping[int, tuple[Number, Number]] = {
    **dict.fromkeys(SIGNED, _SIGNED_RANGE),
    Type.FLOAT: (-_GREATEST, _GREATEST),
}
"""Least and greatest number in calculations, by type."""
_DEGREES, _RADIANS = single(57.29578), single(0.017453)
"""The firmware's factors from radians to degrees and back."""


def _shift_left(value: int, count: int, _: int) -> int:
    return value << count % _BITS


def _logical_right(value: int, count: int, _: int) -> int:
    return (value & _U32) >> count % _BITS


def _arithmetic_right(value: int, count: int, kind: int) -> int:
    """Divide by a power of two, towards zero; the power of 31 is negative if the number has a sign."""
    quotient = abs(value) >> count % _BITS
    return quotient if (value < 0) == (kind in SIGNED and count % _BITS == _BITS - 1) else -quotient


def _rotate_left(value: int, count: int, kind: int) -> int:
    """Rotate the bits of a number of its type; a wider target also gets the bits that leave it."""
    width = 8 * size_of(kind)
    bits = value & (1 << width) - 1
    return bits << count % _BITS | bits >> (width - count) % _BITS


def _rotate_right(value: int, count: int, kind: int) -> int:
    width = 8 * size_of(kind)
    bits = value & (1 << width) - 1
    return bits >> count % _BITS | bits << (width - count) % _BITS


_SHIFTS: Mapping[int, Callable[[int, int, int], int]] = {
    0x0B: _shift_left,
    0x0C: _logical_right,
    0x0D: _shift_left,
    0x0E: _arithmetic_right,
    0x0F: _rotate_left,
    0x10: _rotate_right,
}


def _shift(opcode: int) -> Binary:
    shift = _SHIFTS[opcode]

    def run(target: int, value: Number, kind: int, count: Number, count_kind: int) -> Number:
        if Type.FLOAT in (target, kind, count_kind):
            return 0
        places = s32(int(count))
        return shift(int(value), places, kind) if places > 0 else int(value)

    return run


def _power(base: float, exponent: float) -> float:
    """Return a power; 0 where it is not defined."""
    if base < 0 and (math.isnan(exponent) or (math.isfinite(exponent) and exponent % 1)):
        return 0.0
    try:
        return math.pow(base, exponent)
    except OverflowError:
        return math.inf
    except ValueError:
        return 0.0 if base else math.inf


def _logarithm(function: Callable[[float], float]) -> Callable[[float], float]:
    return lambda value: function(value) if value else -math.inf


def _radians(degrees: float) -> float:
    return single(degrees * _RADIANS)


_OF_TWO: Mapping[int, Callable[[float, float], float]] = {
    0x7C: math.atan2,
    0x7D: _power,
    0x88: lambda y, x: single(math.atan2(y, x)) * _DEGREES,
}

_SIGNED_INFINITY = (0x6F, 0x71, 0x79, 0x7A, 0x87)
"""Functions that are infinite with the sign of their argument."""

_POSITIVE_NAN = (0x6C, 0x7F)
"""Functions whose result has no sign where they are not defined; on the bench, that of others is negative."""

_OF_ONE: Mapping[int, Callable[[float], float]] = {
    0x6C: math.acos,
    0x6D: math.asin,
    0x6E: math.atan,
    0x6F: lambda value: math.copysign(math.ceil(value), value),
    0x70: math.exp,
    0x71: lambda value: float(math.floor(value)),
    0x72: math.tan,
    0x73: math.tanh,
    0x74: math.cos,
    0x75: math.cosh,
    0x76: _logarithm(math.log),
    0x77: _logarithm(math.log10),
    0x78: math.sin,
    0x79: math.sinh,
    0x7A: lambda value: math.copysign(math.trunc(value), value),
    0x7B: lambda value: math.modf(value)[0],
    0x7F: lambda value: single(math.acos(value)) * _DEGREES,
    0x80: lambda value: single(math.asin(value)) * _DEGREES,
    0x81: lambda value: single(math.atan(value)) * _DEGREES,
    0x82: lambda value: math.tan(_radians(value)),
    0x83: lambda value: math.tanh(_radians(value)),
    0x84: lambda value: math.cos(_radians(value)),
    0x85: lambda value: math.cosh(_radians(value)),
    0x86: lambda value: math.sin(_radians(value)),
    0x87: lambda value: math.sinh(_radians(value)),
}


def _of_two(opcode: int) -> Binary:
    function = _OF_TWO[opcode]

    def run(target: int, left: Number, left_kind: int, right: Number, right_kind: int) -> Number:
        if Type.FLOAT not in (target, left_kind, right_kind):
            return 0
        result = single(function(single(left), single(right)))
        return (left if math.isnan(left) else right) if math.isnan(result) else result

    return run


def _of_one(opcode: int) -> Unary:
    function = _OF_ONE[opcode]

    def run(target: int, value: Number, kind: int) -> Number:
        if Type.FLOAT not in (target, kind):
            return 0
        number = single(value)
        try:
            result = single(function(number))
        except OverflowError:
            return math.copysign(math.inf, number) if opcode in _SIGNED_INFINITY else math.inf
        except ValueError:
            result = -math.nan
        return math.nan if math.isnan(result) and opcode in _POSITIVE_NAN else result

    return run


def _sign(_: int, value: Number, kind: int) -> Number:
    if kind == Type.ULONG:
        value = (int(value) ^ 1 << _BITS - 1) - (1 << _BITS - 1)
    return -1 if value < 0 else int(value != 0)


def _complement(target: int, value: Number, kind: int) -> Number:
    return 0 if Type.FLOAT in (target, kind) else ~int(value)


BINARY: Mapping[int, Binary] = {
    **{opcode: _shift(opcode) for opcode in _SHIFTS},
    **{opcode: _of_two(opcode) for opcode in _OF_TWO},
}
"""Operations of two numbers, by opcode."""

UNARY: Mapping[int, Unary] = {
    **{opcode: _of_one(opcode) for opcode in _OF_ONE},
    0x0A: _complement,
    0x66: _sign,
}
"""Operations of one number, by opcode."""


def multiply_divide(factor: int, other: int, divisor: int) -> int:
    """Return the product of two unsigned numbers, as 64 bits with a sign, divided towards 0 by a third, or 0 by 0."""
    product, divisor = (factor & _U32) * (other & _U32), divisor & _U32
    if not divisor:
        return 0
    return product // divisor if product < _END_S64 else -((2 * _END_S64 - product) // divisor)


def summary(operation: int, values: Sequence[Number], kind: int) -> Number:
    """Return the sum, mean, sum of squares, standard deviation, least or greatest of an array's elements.

    They are calculated in single precision for a float, else with 32 bits that have a sign if the type `kind` of the
    result has one.
    """
    exact = _exact(kind)
    numbers = [exact(value) for value in values]
    match operation:
        case 0:
            return _sum(numbers, exact)
        case 1:
            return _mean(numbers, exact) if numbers or kind not in SIGNED else 0
        case 2:
            return _sum([exact(value * value) for value in numbers], exact)
        case 3:
            return _deviation(numbers, _mean(numbers, exact))
        case 4:
            return min(numbers, default=_RANGES.get(kind, _UNSIGNED_RANGE)[1])
        case _:
            return max(numbers, default=_RANGES.get(kind, _UNSIGNED_RANGE)[0])


def _exact(kind: int) -> Callable[[Number], Number]:
    """Return a function that converts a number for calculations whose result has a type."""
    if kind == Type.FLOAT:
        return single
    mask = s32 if kind in SIGNED else _U32.__and__
    return lambda value: mask(rounded(value) if isinstance(value, float) else value)


def _sum(numbers: Sequence[Number], exact: Callable[[Number], Number]) -> Number:
    total: Number = 0
    for number in numbers:
        total = exact(total + number)
    return total


def _mean(numbers: Sequence[Number], exact: Callable[[Number], Number]) -> float:
    return single(single(_sum(numbers, exact)) / len(numbers)) if numbers else -math.nan


def _deviation(numbers: Sequence[Number], mean: float) -> float:
    if len(numbers) <= 1:
        return -math.nan if numbers else -0.0
    total = 0.0
    for number in numbers:
        difference = single(single(number) - mean)
        total = single(total + single(difference * difference))
    return single(math.sqrt(single(total / (len(numbers) - 1))))
