"""Instructions that calculate, compare and copy."""

from __future__ import annotations

import operator
import sys
from collections.abc import Callable, Mapping
from typing import Any

from sim_backend.firmware.vm import aggregates, scalars
from sim_backend.firmware.vm.aggregates import COMPARISONS, comparable
from sim_backend.firmware.vm.data import FIRST_FIELD, INTEGERS, Data, Place
from sim_backend.firmware.vm.machine import Instruction, Machine, Step, Translate
from sim_backend.firmware.vm.rxe import SIZES, Type

_UNSIGNED = {1: Type.UBYTE, 2: Type.UWORD, 4: Type.ULONG}
_PLAIN: Mapping[int, Callable[[Any, Any], int]] = {
    scalars.ADD: operator.add,
    scalars.SUB: operator.sub,
    scalars.MUL: operator.mul,
    scalars.AND: operator.and_,
    scalars.OR: operator.or_,
    scalars.XOR: operator.xor,
}
"""Operations whose low bits do not depend on the signs."""


def _cell(data: Data, argument: int) -> tuple[int, int] | None:
    """Type of an integer variable and its number among those of its size in the pool, if it has one."""
    if argument >= FIRST_FIELD or sys.byteorder != "little":
        return None
    kind = data.kind(argument)
    if kind not in INTEGERS:
        return None
    size = SIZES[kind]
    cell, rest = divmod(data.memory.base + data.variables[argument].data, size)
    return None if rest or (cell + 1) * size > len(data.memory.pool) else (kind, cell)


def _binary(machine: Machine, instruction: Instruction) -> Step:
    data, opcode = machine.data, instruction.opcode
    target, left, right = (Place(argument) for argument in instruction.arguments)
    if opcode in _PLAIN:
        cells = [_cell(data, argument) for argument in instruction.arguments]
        if cells[0] and cells[1] and cells[2]:
            return _plain(machine, instruction, cells[0], cells[1], cells[2])
    operation = scalars.binary(opcode)
    return machine.finished(lambda: aggregates.calculate(data, operation, target, left, right), instruction)


def _plain(
    machine: Machine,
    instruction: Instruction,
    target: tuple[int, int],
    left: tuple[int, int],
    right: tuple[int, int],
) -> Step:
    """A calculation with integer variables."""
    memory, function, following = machine.memory, _PLAIN[instruction.opcode], instruction.following
    size = SIZES[target[0]]
    views = memory.view(_UNSIGNED[size]), memory.view(left[0]), memory.view(right[0])
    to, of, a, b, c = *views[:2], target[1], left[1], right[1]
    third, mask = views[2], (1 << 8 * size) - 1

    def run() -> int:
        to[a] = function(of[b], third[c]) & mask
        return following

    return run


def _unary(machine: Machine, instruction: Instruction) -> Step:
    data, operation = machine.data, scalars.unary(instruction.opcode)
    copies = aggregates.same_integers if machine.dialect.copies_arrays else aggregates.never
    target, source = (Place(argument) for argument in instruction.arguments)
    return machine.finished(
        lambda: aggregates.calculate_each(data, operation, target, source, copies_arrays=copies), instruction
    )


def _compare(machine: Machine, instruction: Instruction) -> Step:
    """Store whether a comparison holds; for arrays as a whole if the target is a number."""
    data, relation = machine.data, instruction.flags
    target, left, right = (Place(argument) for argument in instruction.arguments)
    test = COMPARISONS[relation]

    def each(_: int, a: float, a_kind: int, b: float, b_kind: int) -> int:
        return int(test(*comparable(a, a_kind, b, b_kind)))

    def run() -> None:
        if data.is_aggregate(target.entry) or data.is_aggregate(left.entry) != data.is_aggregate(right.entry):
            aggregates.calculate(data, each, target, left, right)
        else:
            data.put(target.entry, int(aggregates.compare(data, relation, left, right)))

    return machine.finished(run, instruction)


def _test(machine: Machine, instruction: Instruction) -> Step:
    data, test = machine.data, COMPARISONS[instruction.flags]
    copies = aggregates.same_integers if machine.dialect.copies_arrays else aggregates.never
    target, value = (Place(argument) for argument in instruction.arguments)

    def each(_: int, a: float, __: int) -> int:
        return int(test(a, 0))

    return machine.finished(
        lambda: aggregates.calculate_each(data, each, target, value, copies_arrays=copies), instruction
    )


def _move(machine: Machine, instruction: Instruction) -> Step:
    data, following = machine.data, instruction.following
    target, source = (Place(argument) for argument in instruction.arguments)
    cells = _cell(data, target.entry), _cell(data, source.entry)
    if cells[0] and cells[1]:
        (kind, a), (of, b) = cells[0], cells[1]
        size = SIZES[kind]
        to, origin, mask = data.memory.view(_UNSIGNED[size]), data.memory.view(of), (1 << 8 * size) - 1

        def run() -> int:
            to[a] = origin[b] & mask
            return following

        return run
    return machine.finished(lambda: aggregates.move(data, target, source), instruction)


def _set(machine: Machine, instruction: Instruction) -> Step:
    target, value = instruction.arguments
    return machine.finished(lambda: machine.data.put(target, value), instruction)


TABLE: Mapping[tuple[int, int], Translate] = {
    **{(opcode, 3): _binary for opcode in (*_PLAIN, scalars.DIV, scalars.MOD)},
    **{(opcode, 2): _unary for opcode in (scalars.NEG, scalars.NOT, scalars.SQRT, scalars.ABS)},
    (0x11, 3): _compare,
    (0x12, 2): _test,
    (0x1B, 2): _move,
    (0x1C, 2): _set,
}
"""Opcode and number of arguments to the function that translates it."""
