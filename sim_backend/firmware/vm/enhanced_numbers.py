"""Operations of numbers that only firmware 1.32 has. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from sim_backend.firmware.cint import s32
from sim_backend.firmware.vm.aggregates import Binary, Unary
from sim_backend.firmware.vm.numbers import SIGNED, Number, single
from sim_backend.firmware.vm.rxe import SIZES, Type

_BITS = 32
_U32 = (1 << _BITS) - 1
_DEGREES, _RADIANS = single(57.29578), single(0.017453)
"""The firmware's factors from radians to degrees and back."""


def _left(value: int, count: int, _: int) -> int:
    return value << count % _BITS


def _logical_right(value: int, count: int, _: int) -> int:
    return (value & _U32) >> count % _BITS


def _arithmetic_right(value: int, count: int, kind: int) -> int:
    """Divide by a power of two, towards zero; the power of 31 is negative if the number has a sign."""
    quotient = abs(value) >> count % _BITS
    return quotient if (value < 0) == (kind in SIGNED and count % _BITS == _BITS - 1) else -quotient


def _rotate(value: int, left: int, kind: int) -> int:
    """Rotate the bits of a number of its type; a wider target also gets the bits that leave it."""
    width = 8 * SIZES[kind]
    bits = value & (1 << width) - 1
    return bits << left % _BITS | bits >> (width - left) % _BITS


def _rotate_right(value: int, count: int, kind: int) -> int:
    width = 8 * SIZES[kind]
    bits = value & (1 << width) - 1
    return bits >> count % _BITS | bits << (width - count) % _BITS


_SHIFTS: Mapping[int, Callable[[int, int, int], int]] = {
    0x0B: _left,
    0x0C: _logical_right,
    0x0D: _left,
    0x0E: _arithmetic_right,
    0x0F: _rotate,
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
    """A power; 0 where it is not defined."""
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
        return single(function(single(left), single(right))) if Type.FLOAT in (target, left_kind, right_kind) else 0

    return run


def _of_one(opcode: int) -> Unary:
    function = _OF_ONE[opcode]

    def run(target: int, value: Number, kind: int) -> Number:
        if Type.FLOAT not in (target, kind):
            return 0
        try:
            return single(function(single(value)))
        except OverflowError:
            return math.inf
        except ValueError:
            return math.nan

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
"""Opcode to its operation of two numbers."""

UNARY: Mapping[int, Unary] = {
    **{opcode: _of_one(opcode) for opcode in _OF_ONE},
    0x0A: _complement,
    0x66: _sign,
}
"""Opcode to its operation of one number."""


def multiply_divide(factor: int, other: int, divisor: int) -> int:
    """A product of 64 bits divided by a number; unsigned, 0 if the divisor is 0."""
    divisor &= _U32
    return (factor & _U32) * (other & _U32) // divisor if divisor else 0


def summary(operation: int, values: Sequence[Number]) -> float:
    """Sum, mean, sum of squares, standard deviation, least or greatest of an array's elements; 0 of none."""
    if not values:
        return 0
    total = math.fsum(values)
    match operation:
        case 0:
            return total
        case 1:
            return total / len(values)
        case 2:
            return math.fsum(value * value for value in values)
        case 3:
            mean = total / len(values)
            return math.sqrt(math.fsum((value - mean) ** 2 for value in values) / max(len(values) - 1, 1))
        case 4:
            return min(values)
        case _:
            return max(values)
