"""The records of the clumps at the beginning of the memory pool, as the Command map shows them.

The interpreter keeps the fire counts and the links there itself; the rest is only shown. Source: docs/firmware.md
section 8.1.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

from sim_backend.firmware.module import NEVER
from sim_backend.firmware.vm.clump_queue import NO_CLUMP
from sim_backend.firmware.vm.pool_layout import Layout
from sim_backend.firmware.vm.rxe import Clump, Program
from sim_backend.firmware.vm.task import Task

_WORD = 2
_ADDRESS_MASK, _WORD_MASK = 0xFFFF_FFFF, 0xFFFF
_POINT = 4
"""Bytes of a breakpoint in a record."""


NO_BREAKPOINTS = ((0, 0),) * 4
"""The breakpoints of a clump at the start of a program: for each whether it is enabled, and its offset."""


class RecordFormat(NamedTuple):
    """Places in a record; the initial fire count is in front of the fire count, the link after it.

    Attributes:
        numbers: Format of start, last word and place in the code: addresses, or words, of which the place counts from
            the start.
        addresses: Whether they are addresses.
        tail: The byte after the link.
        dependents: Address of the dependents in the file, 0 without any.
        number_of: Number of the dependents.
        wake: Tick at which it wakes, 0 after that; None without such an instruction.
        compares: Byte whose bit 0 is cleared if the clump compares arrays or clusters; None without such a byte.
        points: Breakpoints, after the number of the clump that it has called; None if there are none.
    """

    numbers: struct.Struct
    addresses: bool
    tail: int
    dependents: int
    number_of: int
    wake: int | None = None
    compares: int | None = None
    points: int | None = None


ADDRESSES = RecordFormat(
    struct.Struct("<3I"), addresses=True, tail=0xDF, compares=15, dependents=16, wake=20, number_of=24
)
WORDS = RecordFormat(struct.Struct("<3H"), addresses=False, tail=20, dependents=12, number_of=16)
WITH_POINTS = ADDRESSES._replace(tail=20, compares=16, dependents=20, wake=24, number_of=28, points=30)


class ClumpRecords:
    """The records of one program."""

    def __init__(self, pool: bytearray, layout: Layout, record: RecordFormat, program: Program) -> None:
        """Write the constant parts.

        Args:
            pool: The memory pool.
            layout: Its layout.
            record: The format of the records.
            program: The program.
        """
        self._pool, self._layout, self._format, self._program = pool, layout, record, program
        self._code = program.address + len(program.content) - _WORD * len(program.code)
        for number, clump in enumerate(program.clumps):
            at = number * layout.clump
            self._place(at, clump, clump.start)
            pool[at + layout.fire_count - 1] = pool[at + layout.fire_count] = clump.fire_count
            pool[at + layout.fire_count + 1 : at + layout.fire_count + 3] = bytes((NO_CLUMP, record.tail))
            struct.pack_into(
                "<I", pool, at + record.dependents, program.address + clump.list_at if clump.dependents else 0
            )
            pool[at + record.number_of] = clump.dependents
            if record.points is not None:
                pool[at + record.points - 1] = NO_CLUMP  # it has called none
                self._show_points(at + record.points, NO_BREAKPOINTS)

    def show(self, tasks: Sequence[Task], points: Sequence[Sequence[tuple[int, int]]]) -> None:
        """Write where the clumps are, when they wake, and their breakpoints."""
        record = self._format
        for task, clump in zip(tasks, self._program.clumps, strict=True):
            at = task.number * self._layout.clump
            self._place(at, clump, task.pc)
            if record.compares is not None and task.compares:
                self._pool[at + record.compares] &= ~1
            if record.wake is not None and task.wake_ms != NEVER:
                struct.pack_into("<I", self._pool, at + record.wake, task.wake_ms - 1 & _ADDRESS_MASK)
        if record.points is not None:
            for number, each in enumerate(points):
                self._show_points(number * self._layout.clump + record.points, each)

    def _place(self, at: int, clump: Clump, pc: int) -> None:
        """Write where a clump begins, ends and continues."""
        record = self._format
        places = [clump.start, clump.end - 1, pc - (0 if record.addresses else clump.start)]
        if record.addresses:
            places = [self._code + _WORD * place for place in places]
        mask = _ADDRESS_MASK if record.addresses else _WORD_MASK
        record.numbers.pack_into(self._pool, at, *(place & mask for place in places))

    def _show_points(self, at: int, points: Sequence[tuple[int, int]]) -> None:
        for number, (enabled, offset) in enumerate(points):
            struct.pack_into("<HB", self._pool, at + number * _POINT, offset, enabled)
