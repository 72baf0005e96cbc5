"""A system call's arguments: the members of a cluster. Source: docs/firmware.md section 8.4."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from struct import Struct
from typing import TYPE_CHECKING

from sim_backend.firmware.cint import s16, s32
from sim_backend.firmware.vm.array_descriptor import NOT_AN_OFFSET, Array
from sim_backend.firmware.vm.call_types import LETTERS
from sim_backend.firmware.vm.data import NONE, Place
from sim_backend.firmware.vm.memory import BYTES_PER_ACCESS
from sim_backend.firmware.vm.numbers import Number
from sim_backend.firmware.vm.rxe import Type

if TYPE_CHECKING:
    from sim_backend.firmware.vm.machine import Machine


MOST_ARGUMENTS = 16
"""Largest number of arguments of a system call."""
LONG = Struct("<i")
"""A signed number of 32 bits."""
PIXELS_PER_PART = 4
"""Pixels that are drawn in the time of a part of an array; see `Memory.spend`."""


class Call:
    """The arguments of one call, by their position.

    Attributes:
        machine: The program.
        devices: The brick's modules.
        members: Entries of the arguments in the variable table; those that a damaged program lacks read as 0.
    """

    def __init__(self, machine: Machine, members: Sequence[int], types: str) -> None:
        """Use the members of a cluster as the arguments, of the types of `CALL_TYPES`."""
        self.machine, self.devices = machine, machine.devices
        self.members = [*members, *[NONE] * (MOST_ARGUMENTS - len(members))]
        self._data = machine.data
        self._types = [LETTERS.get(letter) for letter in types]

    def _type(self, position: int) -> Type | None:
        """Return the type as which the firmware reads a number; None for the declared type."""
        is_variable = self.members[position] < min(NONE, self._data.first_field)
        return self._types[position] if is_variable and position < len(self._types) else None

    def value(self, position: int) -> Number:
        """Return a number as it is stored."""
        member, kind = self.members[position], self._type(position)
        if kind is None:
            return self._data.get(member)
        return self._data.memory.load(kind, self._data.address(Place(member)))

    def number(self, position: int) -> int:
        """Return a number as an unsigned one of 32 bits."""
        return int(self.value(position)) & 0xFFFF_FFFF

    def signed(self, position: int) -> int:
        """Return a number as a signed one of 32 bits."""
        return s32(int(self.value(position)))

    def numbers(self, position: int) -> list[int]:
        """Return the numbers of an array or cluster."""
        parts = self._data.parts(Place(self.members[position]))
        return [int(self._data.get(part.entry, part.offset)) for part in parts]

    def longs(self, position: int, count: int | None = None) -> list[int]:
        """Return signed numbers of 32 bits, whatever the elements of an array are: as many as it has, or `count`."""
        if count is None:
            count = self._array(position).length if self.members[position] != NONE else 0
        content = self.content(position, count * LONG.size).ljust(count * LONG.size, b"\0")
        return [number for (number,) in LONG.iter_unpack(content)]

    def pair(self, position: int) -> tuple[int, int]:
        """Return two signed numbers, such as a point; those that a damaged program lacks are 0."""
        first, second = (*self.numbers(position)[:2], 0, 0)[:2]
        return s16(first), s16(second)

    def content(self, position: int, count: int | None = None) -> bytes:
        """Return the stored bytes of an array, or as many from its beginning on; none if the argument is missing."""
        if self.members[position] == NONE:
            return b""
        array, memory = self._array(position), self._data.memory
        at = memory.base + array.offset
        content = memory.pool[at : at + (array.length if count is None else count)]
        memory.spend(len(content) // BYTES_PER_ACCESS)
        return bytes(content)

    def live(self, position: int) -> memoryview:
        """Return the place in the pool of the stored bytes of an array: none if the argument is missing."""
        memory = self._data.memory
        array = self._array(position) if self.members[position] != NONE else Array(0, 0, 0, 0, 0)
        memory.spend(array.length // BYTES_PER_ACCESS)
        return memoryview(memory.pool)[memory.base + array.offset :][: array.length]

    def text(self, position: int) -> bytes:
        """Return the bytes of a text before the next zero, even past its end; none of an array without memory."""
        if self.members[position] == NONE:
            return b""
        at = self._array(position).offset
        return b"" if at == NOT_AN_OFFSET else bytes(self._data.text_at(self._data.memory.base + at))

    def _array(self, position: int) -> Array:
        """Return the descriptor whose number an argument has, of whatever type that is."""
        return self._data.array(Place(self.members[position]))

    def put(self, position: int, value: int) -> None:
        """Return a number, unless the argument is missing."""
        member, kind = self.members[position], self._type(position)
        if member == NONE:
            return
        if kind is None:
            self._data.put(member, value)
        else:
            self._data.memory.store(kind, self._data.address(Place(member)), value)

    def put_bytes(self, position: int, content: bytes) -> None:
        """Return an array of bytes, unless the argument is missing."""
        if self.members[position] != NONE:
            memory, index = self._data.memory, self._data.index_of(self.members[position])
            memory.resize(index, len(content))
            memory.write(memory.array(index).offset, content)

    def resize(self, position: int, count: int) -> None:
        """Set the length of an array; new elements keep what was in memory."""
        self._data.resize(Place(self.members[position]), count)

    def put_words(self, position: int, values: Sequence[int]) -> None:
        """Store numbers of 16 bits side by side in an array, whatever its elements are.

        Raises:
            OutOfMemory: They are outside of the pool.
        """
        at = self._array(position).offset
        self._data.memory.write(at, b"".join((value & 0xFFFF).to_bytes(2, "little") for value in values))

    def put_texts(self, position: int, texts: Sequence[bytes]) -> None:
        """Return an array of texts."""
        place = Place(self.members[position])
        self._data.resize(place, len(texts))
        for i, content in enumerate(texts):
            inner = self._data.parts(place)[i]
            self._data.memory.set_bytes(self._data.index(inner), content + b"\0")

    def end_pass(self) -> None:
        """Take the rest of the pass: the program continues in the next one."""
        memory = self._data.memory
        memory.spend(max(memory.work_left, 0))

    def spend_pixels(self, count: int) -> None:
        """Count the work of drawing pixels, including those outside of the screen.

        Raises:
            OutOfMemory: It is more than an instruction may cause.
        """
        self._data.memory.spend(count // PIXELS_PER_PART)


Function = Callable[[Call], None]
"""Executes a call."""
