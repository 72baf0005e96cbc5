"""Arithmetic instructions; on arrays they work element by element."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping

from sim_backend.firmware.cint import divide
from sim_backend.firmware.vm.flow import compare
from sim_backend.firmware.vm.machine import Instruction, Machine
from sim_backend.firmware.vm.memory import Value

Number = int | float
_WORD = 0xFFFF_FFFF


def _divide(left: Number, right: Number) -> Number:
    """Divide, integers towards zero; division by zero gives zero."""
    if isinstance(left, int) and isinstance(right, int):
        return divide(left, right)
    return left / right if right else 0


def _remainder(left: Number, right: Number) -> Number:
    return left - right * divide(int(left), int(right)) if right else left


def _whole(function: Callable[[int, int], int]) -> Callable[[Number, Number], Number]:
    return lambda left, right: function(int(left), int(right))


def _shift(value: int, places: int) -> int:
    """Shift left by `places`, right if negative."""
    return value << min(places, 32) if places >= 0 else value >> min(-places, 32)


_BINARY: Mapping[int, Callable[[Number, Number], Number]] = {
    0x00: operator.add,
    0x01: operator.sub,
    0x03: operator.mul,
    0x04: _divide,
    0x05: _remainder,
    0x06: _whole(operator.and_),
    0x07: _whole(operator.or_),
    0x08: _whole(operator.xor),
    0x0B: _whole(lambda value, places: _shift(value & _WORD, places)),
    0x0C: _whole(lambda value, places: _shift(value & _WORD, -places)),
    0x0D: _whole(_shift),
    0x0E: _whole(lambda value, places: _shift(value, -places)),
}
_UNARY: Mapping[int, Callable[[Number], Number]] = {
    0x02: operator.neg,
    0x09: lambda value: int(not value),
    0x0A: lambda value: ~int(value),
    0x36: lambda value: math.sqrt(value) if value > 0 else 0,
    0x37: abs,
}


def _pairwise(function: Callable[[Number, Number], Number], left: Value, right: Value) -> Value:
    if isinstance(left, list):
        partners = right if isinstance(right, list) else [right] * len(left)
        return [_pairwise(function, a, b) for a, b in zip(left, partners, strict=False)]
    if isinstance(right, list):
        return [_pairwise(function, left, element) for element in right]
    return function(left, right)


def _each(function: Callable[[Number], Number], value: Value) -> Value:
    return [_each(function, element) for element in value] if isinstance(value, list) else function(value)


def _binary(function: Callable[[Number, Number], Number]) -> Callable[[Machine, Instruction], None]:
    def run(machine: Machine, instruction: Instruction) -> None:
        target, left, right = instruction.arguments
        machine.put(target, _pairwise(function, machine.get(left), machine.get(right)))

    return run


def _unary(function: Callable[[Number], Number]) -> Callable[[Machine, Instruction], None]:
    def run(machine: Machine, instruction: Instruction) -> None:
        target, source = instruction.arguments
        machine.put(target, _each(function, machine.get(source)))

    return run


def _compare(machine: Machine, instruction: Instruction) -> None:
    target, left, right = instruction.arguments
    machine.put(target, int(compare(instruction, machine.get(left), machine.get(right))))


def _test(machine: Machine, instruction: Instruction) -> None:
    target, value = instruction.arguments
    machine.put(target, int(compare(instruction, machine.get(value), 0)))


def _compare_set(machine: Machine, instruction: Instruction) -> None:
    target, source, left, right = instruction.arguments
    if compare(instruction, machine.get(left), machine.get(right)):
        machine.put(target, machine.get(source))


def _test_set(machine: Machine, instruction: Instruction) -> None:
    target, source, value = instruction.arguments
    if compare(instruction, machine.get(value), 0):
        machine.put(target, machine.get(source))


def _move(machine: Machine, instruction: Instruction) -> None:
    target, source = instruction.arguments
    machine.put(target, machine.get(source))


def _set(machine: Machine, instruction: Instruction) -> None:
    target, value = instruction.arguments
    machine.put(target, value)


TABLE: Mapping[int, Callable[[Machine, Instruction], None]] = {
    **{opcode: _binary(function) for opcode, function in _BINARY.items()},
    **{opcode: _unary(function) for opcode, function in _UNARY.items()},
    0x11: _compare,
    0x12: _test,
    0x13: _compare_set,
    0x14: _test_set,
    0x1B: _move,
    0x1C: _set,
}
