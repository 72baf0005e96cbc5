"""The records of the clumps at the beginning of the memory pool, as the Command map shows them.

The interpreter keeps the fire counts, the links and the breakpoints there itself; the rest is only shown. Source:
docs/firmware.md section 8.1.
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


_BREAKPOINT = struct.Struct("<BH")
"""Whether it is enabled, and its offset."""
_BREAKPOINTS = 4
"""Number of a clump's breakpoints."""

_BEGIN, _LAST, _PLACE = range(3)
"""Order of the numbers of a record."""


class RecordFormat(NamedTuple):
    """Places in a record; the initial fire count is in front of the fire count, the link after it.

    Attributes:
        number: Format of start, last word and place in the code: addresses, or words, of which the place counts from
            the start.
        addresses: Whether they are addresses.
        tail: The byte after the link.
        dependents: Address of the dependents in the file, 0 without any.
        number_of: Number of the dependents.
        wake: Tick at which it wakes, 0 after that; None without such an instruction.
        compares: Byte whose bit 0 is cleared if the clump compares arrays or clusters; None without such a byte.
        points: Breakpoints, after the number of the clump that it has called; None if there are none.
    """

    number: struct.Struct
    addresses: bool
    tail: int
    dependents: int
    number_of: int
    wake: int | None = None
    compares: int | None = None
    points: int | None = None


ADDRESSES = RecordFormat(
    struct.Struct("<I"), addresses=True, tail=0xDF, compares=15, dependents=16, wake=20, number_of=24
)
WORDS = RecordFormat(struct.Struct("<H"), addresses=False, tail=20, dependents=12, number_of=16)
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
            for which, place in ((_BEGIN, clump.start), (_LAST, clump.end - 1), (_PLACE, clump.start)):
                self._put(at, clump, which, place)
            pool[at + layout.fire_count - 1] = pool[at + layout.fire_count] = clump.fire_count
            pool[at + layout.fire_count + 1 : at + layout.fire_count + 3] = bytes((NO_CLUMP, record.tail))
            struct.pack_into(
                "<I", pool, at + record.dependents, program.address + clump.list_at if clump.dependents else 0
            )
            pool[at + record.number_of] = clump.dependents
            if record.points is not None:
                pool[at + record.points - 1] = NO_CLUMP  # it has called none
                for point in range(_BREAKPOINTS):
                    self.set_breakpoint(number, point, 0, 0)
        self._shown = [(clump.start, NEVER) for clump in program.clumps]

    def show(self, tasks: Sequence[Task]) -> None:
        """Write where the clumps are and when they wake, if that has changed since the last time."""
        record = self._format
        for task, clump in zip(tasks, self._program.clumps, strict=True):
            at = task.number * self._layout.clump
            place, wake_ms = self._shown[task.number]
            self._shown[task.number] = task.pc, task.wake_ms
            if task.pc != place:
                self._put(at, clump, _PLACE, task.pc)
            if record.compares is not None and task.compares:
                self._pool[at + record.compares] &= ~1
            if record.wake is not None and task.wake_ms not in {wake_ms, NEVER}:
                struct.pack_into("<I", self._pool, at + record.wake, task.wake_ms - 1 & _ADDRESS_MASK)

    def set_breakpoint(self, clump: int, number: int, enabled: int, offset: int) -> None:
        """Store a breakpoint; a number beyond the last is a place in the records that follow."""
        _BREAKPOINT.pack_into(self._pool, self._point_at(clump, number), enabled, offset)

    def breakpoints(self, clump: int) -> list[int]:
        """Return for each breakpoint of a clump whether it is enabled, and its offset."""
        points = range(_BREAKPOINTS)
        return [n for point in points for n in _BREAKPOINT.unpack_from(self._pool, self._point_at(clump, point))]

    def _point_at(self, clump: int, number: int) -> int:
        return clump * self._layout.clump + (self._format.points or 0) + number * _POINT

    def _put(self, at: int, clump: Clump, which: int, place: int) -> None:
        """Write a place in the code into a record."""
        record = self._format
        if record.addresses:
            value = self._code + _WORD * place & _ADDRESS_MASK
        else:
            value = place - (clump.start if which == _PLACE else 0) & _WORD_MASK
        record.number.pack_into(self._pool, at + which * record.number.size, value)
