"""Compile instructions that follow each other into one function, which Python carries out faster than one by one.

A block ends where the next instruction depends on values, at the end of a turn, or after `LONGEST` instructions; a jump
to a fixed place does not end it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from types import CodeType
from typing import Any, NamedTuple

from sim_backend.firmware.vm.data import ERR_INSTR, ProgramError
from sim_backend.firmware.vm.instructions import Effect, Instruction, Next, Ports, Step, Translation
from sim_backend.firmware.vm.memory import OutOfMemory

LONGEST = 20
"""Most instructions of a block."""

FAILURES = (ProgramError, OutOfMemory, struct.error, LookupError, ArithmeticError, ValueError, RecursionError)
"""Exceptions by which a program ends with an error."""


class Block(NamedTuple):
    """Instructions that are carried out together.

    Attributes:
        run: Carries them out; returns the next word of code, or `END_TURN`.
        size: Number of instructions.
        quiet: Whether they change variables and ports only, and the same ones give the same result within a pass.
        ports: What they do with ports.
    """

    run: Step
    size: int
    quiet: bool
    ports: int


class Compiler:
    """Compiles the code of one program."""

    def __init__(
        self,
        code: Sequence[int],
        decode: Callable[[Sequence[int], int], Instruction],
        translate: Callable[[Instruction], Translation],
        names: dict[str, Any],
    ) -> None:
        """Make a compiler.

        Args:
            code: Words of code.
            decode: Decodes the instruction at a word.
            translate: Translates one instruction.
            names: What the names in translated instructions stand for; functions are added to it.
        """
        self._code, self._decode, self._translate, self._names = code, decode, translate, names
        self._translated: dict[int, tuple[Instruction, Translation]] = {}

    def block(self, start: int, end: int, most: int) -> Block:
        """The block that begins at a word of code.

        Args:
            start: The word.
            end: End of the clump; there is no instruction from there on.
            most: Most instructions.

        Raises:
            ProgramError, OutOfMemory, struct.error, LookupError, ArithmeticError, ValueError, RecursionError: There is
                no instruction at the word.
        """
        lines, at, quiet, ports = list[str](), start, True, 0
        for count in range(min(most, LONGEST)):
            try:
                instruction, translation = self._at(at, end)
            except FAILURES:
                if not count:
                    raise
                break
            at = instruction.following
            if isinstance(translation, str):
                lines.append(translation)
            elif isinstance(translation, Effect):
                quiet = quiet and translation.ports is not None
                ports |= int(translation.ports or 0)
                lines.extend(translation.statements)
            elif not isinstance(translation, Next):
                quiet = False
                lines.append(f"{self._named(instruction, translation)}()")
                if at == instruction.at:  # it has no size and follows itself: once a turn is enough
                    count = min(most, LONGEST)
                    break
            elif isinstance(translation.word, int):
                at = translation.word
                if at == start and ports & Ports.SETS:  # the second time, it may change nothing
                    count += 1
                    break
            elif isinstance(translation.word, str):
                return self._compiled([*lines, f"return {translation.word}"], count + 1, quiet, ports)
            else:
                lines.append(f"return {self._named(instruction, translation.word)}()")
                return self._compiled(lines, count + 1, False, ports)
        else:
            count = min(most, LONGEST)
        return self._compiled([*lines, f"return {at}"], count, quiet, ports)

    def _at(self, at: int, end: int) -> tuple[Instruction, Translation]:
        if at >= end:
            raise ProgramError(ERR_INSTR, "a clump ran past its end")
        if at not in self._translated:
            instruction = self._decode(self._code, at)
            self._translated[at] = instruction, self._translate(instruction)
        return self._translated[at]

    def _named(self, instruction: Instruction, function: Callable[[], object]) -> str:
        name = f"at_{instruction.at}"
        self._names[name] = function
        return name

    def _compiled(self, lines: list[str], count: int, quiet: bool, ports: int) -> Block:
        exec(_compile("\n    ".join(("def block():", *lines))), self._names)  # noqa: S102 - our own translation
        return Block(self._names.pop("block"), count, quiet, ports)


@lru_cache(maxsize=4096)
def _compile(source: str) -> CodeType:
    return compile(source, "<block>", "exec")
