"""Instructions that only firmware 1.32 has. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

from collections.abc import Mapping

from sim_backend.firmware.vm import aggregates
from sim_backend.firmware.vm.data import Place
from sim_backend.firmware.vm.enhanced_numbers import BINARY, UNARY, multiply_divide, summary
from sim_backend.firmware.vm.instructions import MANY, Instruction, Next, Translation, sized_arguments
from sim_backend.firmware.vm.machine import Machine, Translate
from sim_backend.firmware.vm.printf import printed
from sim_backend.firmware.vm.rxe import Type

_SORT = 6
_SUMMARY_ARGUMENTS = 5


def _binary(machine: Machine, instruction: Instruction) -> Translation:
    data, operation = machine.data, BINARY[instruction.opcode]
    target, left, right = (Place(argument) for argument in instruction.arguments)
    return lambda: aggregates.calculate(data, operation, target, left, right)


def _unary(machine: Machine, instruction: Instruction) -> Translation:
    data, operation = machine.data, UNARY[instruction.opcode]
    target, source = (Place(argument) for argument in instruction.arguments)
    return lambda: aggregates.calculate_each(data, operation, target, source, copies_arrays=aggregates.same_integers)


def _multiply_divide(machine: Machine, instruction: Instruction) -> Translation:
    data, (target, *operands) = machine.data, instruction.arguments[:4]
    return lambda: data.put(target, multiply_divide(*(data.integer(operand) for operand in operands)))


def _wait(machine: Machine, instruction: Instruction) -> Next:
    """Wait for a number of milliseconds that is the argument itself."""
    return Next(lambda: machine.sleep(instruction.arguments[0], instruction.following))


def _wait_for(machine: Machine, instruction: Instruction) -> Next:
    """Wait for a number of milliseconds that a variable has."""
    duration = instruction.arguments[0]
    return Next(lambda: machine.sleep(machine.data.integer_or(duration, 0), instruction.following))


def _start(machine: Machine, instruction: Instruction) -> Next:
    """Start a clump that does not run."""
    return Next(lambda: machine.start(instruction.arguments[0] & 0xFF, instruction.following))


def _stop_clump(machine: Machine, instruction: Instruction) -> Next:
    """End a clump where it is."""
    return Next(lambda: machine.halt(instruction.arguments[0] & 0xFF, instruction.following))


def _priority(machine: Machine, instruction: Instruction) -> Translation:
    """Set how many instructions a turn of a clump has."""
    clump, turn = instruction.arguments
    return lambda: machine.set_turn(clump, turn)


def _print(machine: Machine, instruction: Instruction) -> Translation:
    """Print a number by a pattern of C's printf: target, pattern, number."""
    data, (target, pattern, source) = machine.data, instruction.arguments

    def run() -> None:
        text = printed(data.text(pattern).decode("latin-1"), data.get(source))
        data.set_bytes(target, text.encode("latin-1") + b"\0")

    return run


def _summarize(machine: Machine, instruction: Instruction) -> Translation:
    """Calculate one number from a part of an array, or sort it: operation, target, array, first element, count."""
    data = machine.data
    arguments = instruction.arguments
    if len(arguments) != _SUMMARY_ARGUMENTS:
        arguments = sized_arguments(machine.program.code, instruction)
    operation, target, source, first, count = arguments

    def run() -> None:
        parts = data.parts(Place(source))
        start = data.integer_or(first, 0) & 0xFFFF
        wanted = data.integer_or(count, 0xFFFF) & 0xFFFF
        chosen = parts[start : start + wanted]
        values = [data.get(part.entry, part.offset) for part in chosen]
        if operation != _SORT:
            if data.kind(target) != Type.ARRAY:
                data.put(target, summary(operation, values, data.kind(target)) if start <= len(parts) else 0)
        elif data.kind(target) == Type.ARRAY:
            data.resize(Place(target), len(values))
            for part, value in zip(data.parts(Place(target)), sorted(values), strict=True):
                data.put(part.entry, value, part.offset)

    return run


def _address(machine: Machine, instruction: Instruction) -> Translation:
    """Return the address of a variable, or of an array's elements, in the pool; absolute ones of no real brick."""
    data, memory, (target, variable, relative) = machine.data, machine.memory, instruction.arguments

    def run() -> None:
        place = Place(variable)
        offset = data.array(place).offset if data.kind(variable) == Type.ARRAY else data.address(place)
        data.put(target, memory.base + offset + (0 if relative else _POOL_ADDRESS))

    return run


_POOL_ADDRESS = 0x0020_0000

TABLE: Mapping[tuple[int, int], Translate] = {
    **{(opcode, 3): _binary for opcode in BINARY},
    **{(opcode, 2): _unary for opcode in UNARY},
    (0x64, 1): _wait,
    (0x65, 1): _wait_for,
    (0x67, 1): _stop_clump,
    (0x68, 1): _start,
    (0x69, 2): _priority,
    (0x6A, 3): _print,
    (0x6B, MANY): _summarize,
    (0x7E, MANY): _multiply_divide,
    (0x89, 3): _address,
}
"""Opcode and number of arguments, `MANY` for more, to the function that translates it."""
