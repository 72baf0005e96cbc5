"""Instructions for arrays and texts; a text is a zero-terminated array of bytes."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from sim_backend.firmware.vm.machine import NONE, Instruction, Machine, ProgramError, number
from sim_backend.firmware.vm.memory import POOL_SIZE, Value
from sim_backend.firmware.vm.rxe import Type

_NUMBER = re.compile(r"\s*[+-]?\d+(\.\d+)?")


def elements(value: Value) -> list[Value]:
    """The elements of an array.

    Raises:
        ProgramError: The value is not an array.
    """
    if not isinstance(value, list):
        raise ProgramError("a number where an array is needed")
    return value


def text(value: Value) -> str:
    """The text of a zero-terminated array."""
    return bytes(number(element) & 0xFF for element in elements(value)).split(b"\0")[0].decode("latin-1")


def from_text(characters: str) -> list[Value]:
    """The array for a text."""
    return [*characters.encode("latin-1", "replace"), 0]


def _optional(machine: Machine, argument: int, default: int) -> int:
    return default if argument == NONE else number(machine.get(argument))


def _index(machine: Machine, instruction: Instruction) -> None:
    target, array, index = instruction.arguments
    machine.put(target, elements(machine.get(array))[_optional(machine, index, 0)])


def _replace(machine: Machine, instruction: Instruction) -> None:
    """Copy an array with some elements replaced."""
    target, array, index, new = instruction.arguments
    result, value, first = elements(machine.get(array)), machine.get(new), _optional(machine, index, 0)
    parts = value if isinstance(value, list) else [value]
    if not 0 <= first < len(result):
        raise ProgramError(f"an array has no element {first}")
    result[first : first + len(parts)] = parts[: len(result) - first]
    machine.put(target, result)


def _size(machine: Machine, instruction: Instruction) -> None:
    target, array = instruction.arguments
    machine.put(target, machine.memory.count(array))


def _build(machine: Machine, instruction: Instruction) -> None:
    """Concatenate values and arrays."""
    target, *sources = instruction.arguments
    nested = machine.memory.kind(target + 1) == Type.ARRAY
    result: list[Value] = []
    for source in sources:
        value = machine.get(source)
        whole = isinstance(value, list) and machine.memory.kind(source) == Type.ARRAY
        deeper = nested and machine.memory.kind(source + 1) != Type.ARRAY
        result += elements(value) if whole and not deeper else [value]
        if len(result) > POOL_SIZE:
            raise ProgramError("an array larger than the memory pool")
    machine.put(target, result)


def _subset(machine: Machine, instruction: Instruction) -> None:
    target, array, index, length = instruction.arguments
    values = elements(machine.get(array))
    first = max(_optional(machine, index, 0), 0)
    machine.put(target, values[first : first + max(_optional(machine, length, len(values)), 0)])


def _initialise(machine: Machine, instruction: Instruction) -> None:
    target, value, length = instruction.arguments
    machine.put(target, [machine.get(value)] * (number(machine.get(length)) & 0xFFFF))


def _number_to_text(machine: Machine, instruction: Instruction) -> None:
    target, source = instruction.arguments
    value = machine.get(source)
    if isinstance(value, list):
        raise ProgramError("an array where a number is needed")
    machine.put(target, from_text(f"{value:.2f}" if isinstance(value, float) else str(value)))


def _text_to_number(machine: Machine, instruction: Instruction) -> None:
    target, past, source, offset, default = instruction.arguments
    start = _optional(machine, offset, 0)
    found = _NUMBER.match(text(machine.get(source)), start)
    machine.put(target, float(found[0]) if found else _optional(machine, default, 0))
    if past != NONE:
        machine.put(past, found.end() if found else start)


def _join_texts(machine: Machine, instruction: Instruction) -> None:
    target, *sources = instruction.arguments
    machine.put(target, from_text("".join(text(machine.get(source)) for source in sources)))


def _part_of_text(machine: Machine, instruction: Instruction) -> None:
    target, source, index, length = instruction.arguments
    characters = text(machine.get(source))
    first = max(_optional(machine, index, 0), 0)
    machine.put(target, from_text(characters[first : first + max(_optional(machine, length, len(characters)), 0)]))


def _text_to_bytes(machine: Machine, instruction: Instruction) -> None:
    target, source = instruction.arguments
    machine.put(target, elements(machine.get(source))[:-1])


def _bytes_to_text(machine: Machine, instruction: Instruction) -> None:
    target, source = instruction.arguments
    machine.put(target, [*elements(machine.get(source)), 0])


TABLE: Mapping[int, Callable[[Machine, Instruction], None]] = {
    0x15: _index,
    0x16: _replace,
    0x17: _size,
    0x18: _build,
    0x19: _subset,
    0x1A: _initialise,
    0x1F: _number_to_text,
    0x20: _text_to_number,
    0x21: _join_texts,
    0x22: _part_of_text,
    0x23: _text_to_bytes,
    0x24: _bytes_to_text,
}
