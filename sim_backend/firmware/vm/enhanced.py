"""Instructions that only firmware 1.32 has. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

from collections.abc import Mapping

from sim_backend.firmware.vm import aggregates
from sim_backend.firmware.vm.data import ERR_INSTR, Data, Place, ProgramError
from sim_backend.firmware.vm.enhanced_numbers import BINARY, UNARY, multiply_divide, summary
from sim_backend.firmware.vm.flow import end_clump, start_clump
from sim_backend.firmware.vm.instructions import MANY, Instruction, Next, Translation, sized_arguments
from sim_backend.firmware.vm.machine import QUEUE_CHANGED, Machine, Translate
from sim_backend.firmware.vm.numbers import Number
from sim_backend.firmware.vm.printf import printed
from sim_backend.firmware.vm.rxe import Type

_SORT = 6
_ARRAY_ARGUMENTS = 5
_CASES = (bytes.upper, bytes.lower)
"""The operations of arrays after `_SORT`, which change ASCII letters."""
_U32 = 0xFFFF_FFFF


def _binary(machine: Machine, instruction: Instruction) -> Translation:
    data, operation = machine.data, BINARY[instruction.opcode]
    target, left, right = (Place(argument) for argument in instruction.arguments)
    return lambda: aggregates.calculate(data, operation, target, left, right)


def _unary(machine: Machine, instruction: Instruction) -> Translation:
    data, operation = machine.data, UNARY[instruction.opcode]
    target, source = (Place(argument) for argument in instruction.arguments)
    return lambda: aggregates.calculate_each(data, operation, target, source, copies_arrays=aggregates.never)


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
    return Next(lambda: start_clump(machine, instruction.arguments[0] & 0xFF, instruction.following))


def _stop_clump(machine: Machine, instruction: Instruction) -> Next:
    """End a clump wherever it is; the current one continues until the end of its turn."""

    def run() -> int:
        end_clump(machine, instruction.arguments[0] & 0xFF)
        return QUEUE_CHANGED - instruction.following

    return Next(run)


def _priority(machine: Machine, instruction: Instruction) -> Translation:
    """Set how many instructions a turn of a clump has."""
    clump, turn = instruction.arguments
    return lambda: machine.set_turn(clump, turn)


def _print(machine: Machine, instruction: Instruction) -> Translation:
    """Print a number by a pattern of C's printf: target, pattern, number; texts must be of bytes."""
    data, (target, pattern, source) = machine.data, instruction.arguments
    texts = all(data.kind(text + 1 & 0xFFFF) == Type.UBYTE for text in (target, pattern))

    def run() -> None:
        if not texts:
            raise ProgramError(ERR_INSTR, "what is printed is not a text")
        text = printed(data.text(pattern).decode("latin-1"), data.get(source))
        data.set_bytes(target, text.encode("latin-1") + b"\0")

    return run


def _on_array(machine: Machine, instruction: Instruction) -> Translation:
    """Summarize, sort or write in one case a part of an array: operation, target, array, first element, count."""
    data, arguments = machine.data, instruction.arguments
    if len(arguments) != _ARRAY_ARGUMENTS:
        arguments = sized_arguments(machine.program.code, instruction)
    operation, target, source, first, count = arguments
    act = _summarize if operation < _SORT else _sort if operation == _SORT else _write_in_case

    def run() -> None:
        parts = data.parts(Place(source))
        start = data.integer_or(first, 0) & _U32
        act(data, operation, target, _Part(source, parts, start, data.integer_or(count, _U32) & _U32))

    return run


class _Part:
    """A part of an array.

    Attributes:
        array: The variable.
        length: Number of elements of the array.
        start: The first one of the part.
        chosen: The elements of the part.
    """

    def __init__(self, array: int, parts: list[Place], start: int, count: int) -> None:
        self.array, self.length, self.start = array, len(parts), start
        self.chosen = parts[start : start + count]

    def values(self, data: Data) -> list[Number]:
        """Return its numbers."""
        return [data.get(part.entry, part.offset) for part in self.chosen]


def _summarize(data: Data, operation: int, target: int, part: _Part) -> None:
    if data.kind(target) != Type.ARRAY:
        values = part.values(data)
        data.put(target, summary(operation, values, data.kind(target)) if part.start <= part.length else 0)


def _sort(data: Data, _: int, target: int, part: _Part) -> None:
    values = part.values(data)
    if data.kind(target) == Type.ARRAY:
        data.resize(Place(target), len(values))
        places = data.parts(Place(target))
        for place, value in zip(places, values, strict=True):
            data.put(place.entry, value, place.offset)
        stored = sorted(data.get(place.entry, place.offset) for place in places)
        for place, value in zip(places, stored, strict=True):
            data.put(place.entry, value, place.offset)


def _write_in_case(data: Data, operation: int, target: int, part: _Part) -> None:
    """Copy a text whole, also into a shorter target, with the part and the byte after it in upper or lower case.

    Raises:
        ProgramError: There is no such operation.
    """
    if part.start > part.length:
        return
    if operation > _SORT + len(_CASES):
        raise ProgramError(ERR_INSTR, f"there is no operation {operation} of arrays")
    if data.kind(target) != Type.ARRAY:
        return
    data.resize(Place(target), len(part.chosen))
    if part.chosen:
        memory, to, end = data.memory, data.array(Place(target)).offset, part.start + len(part.chosen) + 1
        text = memory.read(data.span(part.array)[0] - memory.base, part.length)
        changed = _CASES[operation - _SORT - 1](text[part.start : end])
        memory.write(to, text[: part.start] + changed + text[end:])


def _address(machine: Machine, instruction: Instruction) -> Translation:
    """Return the address of a variable, or of an array's elements, in the pool; absolute ones match no real brick."""
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
    (0x6B, MANY): _on_array,
    (0x7E, MANY): _multiply_divide,
    (0x89, 3): _address,
}
"""Opcode and number of arguments, `MANY` for more, to the function that translates it."""
