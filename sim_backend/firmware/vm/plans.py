"""Instructions for arrays, repeated without another search for the arrays until these move.

An instruction is executed step by step until it has changed no descriptor, and then returns how to do it again; its
share of the time of a pass is the same each time. Whether the descriptors are still the same is read from the pool,
since programs can write anywhere.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Callable, Sequence
from typing import Any

from sim_backend.firmware.vm.array_descriptor import DESCRIPTOR, DESCRIPTOR_SIZE, INDEX
from sim_backend.firmware.vm.bulk import OFFSETS, Again
from sim_backend.firmware.vm.data import ERR_ARG, Data, ProgramError
from sim_backend.firmware.vm.instructions import Effect, Instruction, Ports, Translation
from sim_backend.firmware.vm.machine import Machine
from sim_backend.firmware.vm.numbers import SCALARS, Number
from sim_backend.firmware.vm.rxe import Type

_KEY_SIZE = 8
"""Size of the part that shows whether a descriptor changed: all but the link."""
_NOWHERE = -1


class Arrays:
    """The array variables of one instruction, as names in its statements.

    Attributes:
        unmoved: Expression of whether they are where `remember` found them.
    """

    def __init__(self, machine: Machine, instruction: Instruction, arrays: Sequence[int]) -> None:
        """Name the arrays.

        Args:
            machine: The program.
            instruction: The instruction.
            arrays: The variables; they must be `fixed`.
        """
        self._memory, self._names, self._at = machine.memory, machine.operands.names, instruction.at
        self._cells = [_cell(machine.data, array) for array in dict.fromkeys(arrays)]
        parts = [f"memory.descriptors == table_{self._at}"]
        for i, cell in enumerate(self._cells):
            name = f"{self._at}_{i}"
            parts += [f"H[{cell}] == index_{name}", f"cells_{name}[cell_{name}] == key_{name}"]
        self.unmoved = " and ".join(parts)
        self.forget()

    def name(self, name: str, value: object) -> str:
        """Give a value a name for this instruction; return the name."""
        self._names[f"{name}_{self._at}"] = value
        return f"{name}_{self._at}"

    def forget(self) -> None:
        """Make `unmoved` false."""
        self.name("table", _NOWHERE)

    def find(self) -> tuple[Any, ...] | None:
        """Return where the arrays are now; None if that cannot be found fast."""
        memory, indices = self._memory, self._names["H"]
        table = memory.base + memory.descriptors
        found = list[Any]()
        for cell in self._cells:
            index = indices[cell]
            number, shift = divmod(table + DESCRIPTOR_SIZE * index, _KEY_SIZE)
            cells = self._names["keys"].get(shift)
            if cells is None or number >= len(cells):
                return None
            found += index, shift, number, cells[number]
        return memory.descriptors, *found

    def remember(self, place: tuple[Any, ...]) -> None:
        """Make `unmoved` true while the arrays are where they were found."""
        table, *found = place
        self.name("table", table)
        for i, (index, shift, number, key) in enumerate(zip(*[iter(found)] * 4, strict=True)):
            values = {"index": index, "cells": self._names["keys"][shift], "cell": number, "key": key}
            self._names.update({f"{name}_{self._at}_{i}": value for name, value in values.items()})


class Elements:
    """The elements of an array variable of numbers, as names in the statements of one instruction.

    Attributes:
        locate: Statement that finds the array, unless it is where it was.
        numbers: Name of the elements.
        count: Name of the number of its elements; 0 if they do not lie side by side.
    """

    def __init__(self, machine: Machine, instruction: Instruction, array: int, code: str) -> None:
        """Name the arrays.

        Args:
            machine: The program.
            instruction: The instruction.
            array: The variable, which must be `fixed`.
            code: Type of the elements, as for `memoryview.cast`.
        """
        self._data, self._array, self._code = machine.data, array, code
        self._places = Arrays(machine, instruction, [array])
        self.numbers, self.count = self._places.name("numbers", ()), self._places.name("count", 0)
        self.locate = f"if not ({self._places.unmoved}): {self._places.name('locate', self._locate)}()"

    def _locate(self) -> None:
        place, element = self._places.find(), self._array + 1
        self._places.name("count", 0)
        self._places.forget()
        if place:
            memory, size = self._data.memory, SCALARS[self._data.kind(element)].size
            offset, width, length, _, _ = DESCRIPTOR.unpack_from(
                memory.pool, memory.base + memory.descriptors + DESCRIPTOR_SIZE * place[1]
            )
            first = self._data.entry(element).data + offset
            if width == size and first + length * size <= OFFSETS:
                at = memory.base + first
                self._places.name("numbers", memoryview(memory.pool)[at : at + length * size].cast(self._code))  # type: ignore[call-overload]
                self._places.name("count", length)
                self._places.remember(place)


def element_reader(data: Data, array: int) -> Callable[[int], Number]:
    """Return a fast function for the elements of a variable that is an array of numbers.

    It raises ProgramError for a missing element.
    """
    memory, pool, base = data.memory, data.memory.pool, data.memory.base
    variable, first = base + data.variables[array].data, data.variables[array + 1].data
    index, descriptor, unpack = INDEX.unpack_from, DESCRIPTOR.unpack_from, SCALARS[data.kind(array + 1)].unpack_from

    def read(number: int) -> Number:
        found = base + memory.descriptors + DESCRIPTOR_SIZE * index(pool, variable)[0]
        offset, element, length, _, _ = descriptor(pool, found)
        number &= 0xFFFF
        if number >= length:
            raise ProgramError(ERR_ARG, f"an array has no element {number}")
        value: Number = unpack(pool, base + first + (offset + number * element & 0xFFFF))[0]
        return value

    return read


def element_writer(data: Data, array: int) -> Callable[[int, int], None]:
    """Return a fast function that sets elements of a variable that is an array of integers; nothing beyond its end."""
    memory, pool, base, layout = data.memory, data.memory.pool, data.memory.base, SCALARS[data.kind(array + 1)]
    variable, first = base + data.variables[array].data, data.variables[array + 1].data
    index, descriptor = INDEX.unpack_from, DESCRIPTOR.unpack_from
    pack, mask = struct.Struct(layout.format.upper()).pack_into, (1 << 8 * layout.size) - 1

    def write(number: int, value: int) -> None:
        found = base + memory.descriptors + DESCRIPTOR_SIZE * index(pool, variable)[0]
        offset, element, length, _, _ = descriptor(pool, found)
        number &= 0xFFFF
        if number < length:
            pack(pool, base + first + (offset + number * element & 0xFFFF), value & mask)

    return write


def fixed(data: Data, arrays: Sequence[int]) -> bool:
    """Return whether cells of the pool identify the descriptors of variables."""
    return sys.byteorder == "little" and all(
        array < len(data.variables)
        and data.kind(array) == Type.ARRAY
        and (data.memory.base + data.entry(array).data) % INDEX.size == 0
        for array in arrays
    )


def _cell(data: Data, array: int) -> int:
    return (data.memory.base + data.entry(array).data) // INDEX.size


def repeatable(
    machine: Machine, instruction: Instruction, arrays: Sequence[int], perform: Callable[[], Again | None]
) -> Translation:
    """Translate an instruction so that its repeats are fast.

    Args:
        machine: The program.
        instruction: The instruction.
        arrays: The variables that are arrays.
        perform: Executes it, and returns how to do so again.
    """
    if not arrays or not fixed(machine.data, arrays):
        return perform
    places = Arrays(machine, instruction, arrays)
    memory = machine.memory

    def plan() -> None:
        before, left = places.find(), memory.work_left
        places.forget()
        again = perform()
        if again and before and places.find() == before:
            places.name("work", left - memory.work_left)
            places.name("again", again)
            places.remember(before)

    names = {name: places.name(name, value) for name, value in (("plan", plan), ("again", None), ("work", 0))}
    statements = (
        f"if {places.unmoved} and {names['again']}() is not False: memory.work_left -= {names['work']}",
        f"else: {names['plan']}()",
    )
    return Effect(statements, Ports.NOTHING, takes_time=True)
