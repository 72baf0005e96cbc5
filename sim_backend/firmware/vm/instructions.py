"""Decode instructions. Source: LEGO's executable file specification."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import IntFlag
from typing import NamedTuple

from sim_backend.firmware.cint import s8
from sim_backend.firmware.vm.data import ERR_INSTR, ProgramError

MANY = 4
"""Number of arguments beyond which the firmware does not distinguish."""

_ERASED = 0xFFFF
"""Word past the end of the code."""
_SHORT = 0x8
_VARIABLE_SIZE = 0xE
_WORD = 2
_READ = 6
"""Words that an instruction of `MANY` arguments reads, even if it is shorter."""
_SHORT_FORMS = ((0x1B, 2), (0x2C, 1), (0x2D, 1), (0x2E, 2))
"""Opcode and number of words of the short forms of move, acquire, release and call."""


class Instruction(NamedTuple):
    """One instruction.

    Attributes:
        opcode: Number of the operation.
        flags: Index of the comparison.
        arguments: Words after the instruction word.
        at: Index of its first word.
        following: Index of the word after it.
        form: Number of arguments by which the firmware chooses the handler; at most `MANY`.
    """

    opcode: int
    flags: int
    arguments: tuple[int, ...]
    at: int
    following: int
    form: int


Action = Callable[[], object]
"""Executes an instruction."""

Step = Callable[[], int]
"""Executes an instruction; returns the index of the next word of code, or `END_TURN`."""

END_TURN = -1
"""Next word of an instruction that suspended its clump or stopped the program."""


class Next(NamedTuple):
    """Translation of an instruction that chooses the next one.

    Attributes:
        word: Index of the next word, or a function that returns it.
    """

    word: int | Step


class Cell(NamedTuple):
    """A scalar variable that lies in the pool at a multiple of its size.

    Attributes:
        code: Its type without the sign, as `struct` names it: "b", "h", "i" or "f".
        number: Its number among the places of its size.
    """

    code: str
    number: int


class Branch(NamedTuple):
    """Translation of an instruction that chooses between two next ones.

    Attributes:
        condition: Expression of whether it jumps.
        target: Index of the next word if it does.
        following: Index of the next word if it does not.
        cells: The variables in the condition; None if one is no `Cell`.
    """

    condition: str
    target: int
    following: int
    cells: tuple[Cell, ...] | None


class Ports(IntFlag):
    """Use of ports by a part of a program.

    Repeats of a loop that sets ports change nothing, unless it reads them, too.
    """

    NOTHING = 0
    READS = 1
    SETS = 2
    BOTH = 3


class Effect(NamedTuple):
    """Translation of an instruction to statements.

    Attributes:
        statements: Statements that do it.
        ports: Its use of ports; None if it has further effects.
        reads_clock: Whether it reads the time.
        takes_time: Whether it works on whole arrays, which counts against the work that a pass has time for.
        cells: If it only calculates a variable from others, which cannot fail: that variable, then the others. None for
            anything else, or if one is no `Cell`.
        factors: Of the others, and last of 1, if it calculates a sum.
    """

    statements: tuple[str, ...]
    ports: Ports | None = None
    reads_clock: bool = False
    takes_time: bool = False
    cells: tuple[Cell, ...] | None = None
    factors: tuple[int, ...] | None = None


Translation = Effect | Action | Next | Branch
"""Translation of an instruction: statements or a function, or the choice of the next instruction."""


def decode(code: Sequence[int], at: int, *, checks_short_forms: bool) -> Instruction:
    """Return the instruction at a word of code.

    Args:
        code: All words.
        at: Index of the word.
        checks_short_forms: Whether the size of a short form counts.

    Raises:
        ProgramError: There is no such short form, or no such size; or the code ends before it.
        IndexError: The code ends before its size.
    """
    if at >= len(code):
        raise ProgramError(ERR_INSTR, "an instruction past the end of the code")
    word = code[at]
    size, flags, opcode = word >> 12, word >> 8 & 0x7, word & 0xFF
    short_form = word >> 8 & _SHORT
    if size % _WORD and (checks_short_forms or not short_form):
        raise ProgramError(ERR_INSTR, "an instruction of half a word")
    if short_form:
        short, words = _SHORT_FORMS[flags] if flags < len(_SHORT_FORMS) else (0, 0)
        if checks_short_forms:
            words = size // _WORD
        elif not words:
            raise ProgramError(ERR_INSTR, "a short form that does not exist")
        first = s8(opcode) if words == 1 else s8(opcode) + code[at + 1]
        arguments = (first & 0xFFFF, *code[at + 1 : at + words])
        return Instruction(short, 0, arguments, at, at + words, len(arguments))
    if not (size or checks_short_forms):
        raise ProgramError(ERR_INSTR, "an instruction without a size")
    form = min(size // _WORD - 1, MANY) if size else MANY
    if size == _VARIABLE_SIZE:
        size = code[at + 1]
    following = at + size // _WORD
    arguments = tuple(code[at + 1 : max(following, at + _READ) if form == MANY else following])
    if form == MANY:
        arguments += (_ERASED,) * (_READ - 1 - len(arguments))
    return Instruction(opcode, flags, arguments, at, following, form)


def scanned(code: Sequence[int], at: int) -> tuple[int, Sequence[int], int]:
    """Return the opcode of an instruction, its arguments, and the next word, by its size alone, also if it has no form.

    A short form has the opcode -1. The next word is the same one if there is no size.
    """
    word, size = code[at], code[at] >> 12
    if size == _VARIABLE_SIZE:
        size = code[at + 1] if at + 1 < len(code) else 0
    following = at + size // _WORD
    return -1 if word >> 8 & _SHORT else word & 0xFF, code[at + 1 : following], following


def sized_arguments(code: Sequence[int], instruction: Instruction, more: int = 0) -> tuple[int, ...]:
    """Return the arguments of an instruction that has any number of them; its first word is its size in bytes.

    Past the end of the code they are those of erased flash memory.

    Args:
        code: All words.
        instruction: The instruction.
        more: Number of words after it that are returned, too.
    """
    count = max(code[instruction.at + 1] // _WORD - 2, 0) + more
    found = tuple(code[instruction.at + 2 : instruction.at + 2 + count])
    return found + (_ERASED,) * (count - len(found))
