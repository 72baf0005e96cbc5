"""The running clumps of a program. Source: LEGO's executable file specification; docs/firmware.md section 8.3."""

from __future__ import annotations

from collections.abc import Sequence

from sim_backend.firmware.module import NEVER
from sim_backend.firmware.vm.blocks import Block
from sim_backend.firmware.vm.data import Data
from sim_backend.firmware.vm.instructions import scanned
from sim_backend.firmware.vm.rxe import Clump, Program, Type

TURN = 20
"""Largest number of instructions of a turn, unless the program changes it."""

AWAKE = 1
"""Pass in which a clump continues that does not sleep: before any program."""

_COMPARE, _BRANCH_IF = 0x11, 0x26


class Task:
    """A running clump.

    Attributes:
        number: Number of the clump.
        pc: Index of the next word of code.
        end: The word from which on there is no instruction.
        wake_ms: Pass in which a sleeping one continues, `AWAKE` after that, `NEVER` if it never slept.
        turn: Largest number of instructions of its turn.
        compares: Whether it compares arrays or clusters, as its record shows; not in 1.05.
        misses: Whether its conditional jumps that are not made lead to a wrong place, see `Dialect.misses_jumps`.
        blocks: Compiled code by its first word.
    """

    __slots__ = ("blocks", "compares", "end", "misses", "number", "pc", "turn", "wake_ms")

    def __init__(self, number: int, start: int, end: int) -> None:
        self.number, self.pc, self.end = number, start, end
        self.wake_ms, self.turn, self.compares, self.misses = NEVER, TURN, False, False
        self.blocks: dict[int, Block] = {}


def end_of(clump: Clump, program: Program, *, past_end: bool) -> int:
    """Return the word from which on there is no instruction of a clump.

    Args:
        clump: The clump.
        program: Its program.
        past_end: See `Dialect.runs_past_end`.
    """
    if not past_end:
        return clump.end
    return clump.end + 1 if clump.end >= clump.start else len(program.code)


def compares_aggregates(task: Task, code: Sequence[int], data: Data, known: dict[int, int]) -> bool:
    """Return whether a clump compares arrays or clusters, other than by comparing texts and storing a number.

    Args:
        task: The clump.
        code: The program's code, which is read by the sizes of instructions alone.
        data: The program's variables.
        known: The next such comparison by word; words on the way are added, so that no word is read twice.
    """
    at, passed = task.pc, list[int]()
    while at not in known:
        passed.append(at)
        known[at] = at
        if at < len(code):
            opcode, arguments, following = scanned(code, at)
            if not _compares_aggregates(opcode, arguments, data):
                at = following if following != at else len(code)  # without a size the firmware hangs
    known.update(dict.fromkeys(passed, known[at]))
    return known[at] < min(task.end, len(code))


def _compares_aggregates(opcode: int, arguments: Sequence[int], data: Data) -> bool:
    target, *compared = arguments[:3] or (0,)
    if opcode not in (_COMPARE, _BRANCH_IF) or not any(map(data.is_aggregate, compared)):
        return False
    texts = all(data.kind(it) == Type.ARRAY and data.kind(it + 1) == Type.UBYTE for it in compared)
    return opcode == _BRANCH_IF or data.is_aggregate(target) or not texts
