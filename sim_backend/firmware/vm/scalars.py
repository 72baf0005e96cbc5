"""Operations of numbers. Source: docs/firmware.md section 8.2."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from sim_backend.firmware.cint import divide, s32
from sim_backend.firmware.vm.aggregates import Binary, Unary, comparable
from sim_backend.firmware.vm.data import rounded, truncated
from sim_backend.firmware.vm.numbers import Number, single
from sim_backend.firmware.vm.rxe import Type

ADD, SUB, NEG, MUL, DIV, MOD, AND, OR, XOR, NOT = range(10)
SQRT, ABS = 0x36, 0x37


def remainder(left: int, right: int) -> int:
    """Return the remainder of a division that rounds towards zero; a division by zero leaves the dividend."""
    return left - right * divide(left, right) if right else left


_INTEGER: Mapping[int, Callable[[int, int], int]] = {
    ADD: int.__add__,
    SUB: int.__sub__,
    MUL: int.__mul__,
    DIV: divide,
    MOD: remainder,
    AND: int.__and__,
    OR: int.__or__,
    XOR: int.__xor__,
}
_SIGN_MATTERS = (DIV, MOD)

WHOLE: Mapping[int, np.ufunc] = {
    ADD: np.add,
    SUB: np.subtract,
    NEG: np.negative,
    MUL: np.multiply,
    AND: np.bitwise_and,
    OR: np.bitwise_or,
    XOR: np.bitwise_xor,
}
"""Operations of whole arrays whose low bits do not depend on the signs."""


def float_divide(left: float, right: float) -> float:
    """Return the quotient; 0.0 if the divisor is 0."""
    return left / right if right else 0.0


def _whole_remainder(left: float, right: float) -> float:
    return remainder(truncated(left), truncated(right)) if right else left


def _float_remainder(left: float, right: float) -> float:
    """Return the result of C's fmod, or the dividend if the divisor is 0."""
    if not right:
        return left
    return -math.nan if math.isinf(left) else math.fmod(left, right)


_FLOAT: Mapping[int, Callable[[float, float], float]] = {
    ADD: float.__add__,
    SUB: float.__sub__,
    MUL: float.__mul__,
    DIV: float_divide,
    MOD: _whole_remainder,
    AND: lambda left, right: truncated(left) & truncated(right),
    OR: lambda left, right: truncated(left) | truncated(right),
    XOR: lambda left, right: truncated(left) ^ truncated(right),
}


def as_float(value: Number, kind: int) -> float:
    """Return a number of a type as an operation of floats uses it: a VOID counts as 0."""
    return 0.0 if kind == Type.VOID else single(value)


def binary(opcode: int, *, float_remainder: bool) -> Binary:
    """Return the operation of two numbers of an opcode; remainders of floats are floats or integers."""
    of_integers, of_floats = _INTEGER[opcode], _FLOAT[opcode]
    if opcode == MOD and float_remainder:
        of_floats = _float_remainder

    def run(target: int, left: Number, left_kind: int, right: Number, right_kind: int) -> Number:
        if Type.FLOAT in (target, left_kind, right_kind):
            return single(of_floats(as_float(left, left_kind), as_float(right, right_kind)))
        if opcode in _SIGN_MATTERS:
            left, right = comparable(left, left_kind, right, right_kind)
        return of_integers(int(left), int(right))

    return run


def unary(opcode: int) -> Unary:
    """Return the operation of one number of an opcode."""

    def run(target: int, value: Number, kind: int) -> Number:
        if Type.FLOAT in (target, kind):
            return single(_FLOAT_UNARY[opcode](as_float(value, kind)))
        return _INTEGER_UNARY[opcode](int(value))

    return run


def rounded_not(_: int, value: Number, __: int) -> float:
    """Return whether a number that is no part of an array or cluster is rounded to 0."""
    return float(not rounded(value))


_INTEGER_UNARY: Mapping[int, Callable[[int], int]] = {
    NEG: int.__neg__,
    NOT: lambda value: int(not value),
    SQRT: lambda _: 0,
    ABS: lambda value: abs(s32(value)),
}
_FLOAT_UNARY: Mapping[int, Callable[[float], float]] = {
    NEG: float.__neg__,
    SQRT: lambda value: -math.nan if value < 0 else math.sqrt(value),
    ABS: abs,
    NOT: lambda value: float(not value),
}
