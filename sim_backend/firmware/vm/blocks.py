"""Compile instructions that follow each other into one function, which Python executes faster than one by one.

A block is the tree of all paths from its first instruction on: jumps and branches continue inside it, and a path that
returns to the first instruction makes the function loop. Each path has a known number of instructions, so turns
are exact. A path ends where only the instruction itself determines the next one, where it meets itself, or after
`LONGEST` instructions.

Each block has two functions. The quick one executes whole paths only, while enough instructions are left for the
longest of them. The exact one can stop after any instruction. Compiling takes longer than running: they are
compiled only when a block runs often, and until then its instructions are executed one by one.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache, partial
from types import CodeType
from typing import Any

from sim_backend.firmware.vm.data import ERR_ARG, ERR_INSTR, ERR_MEM, ProgramError
from sim_backend.firmware.vm.instructions import Action, Branch, Effect, Instruction, Next, Ports, Translation
from sim_backend.firmware.vm.linear_loops import linear
from sim_backend.firmware.vm.memory import OutOfMemory
from sim_backend.firmware.vm.operands import Operands

LONGEST = 20
"""Largest number of instructions of one path through a block."""
_MOST_INSTRUCTIONS = 40
"""Largest number of instructions of a block: each path repeats those that it shares with others."""

OFTEN = 50
"""Number of runs after which a block is compiled."""

_KEPT_EFFECTS = 64
"""Number of effects of repeated loops that are kept; most loops have few, as passes have equally many instructions."""

FAILURES = (ProgramError, OutOfMemory, struct.error, LookupError, ArithmeticError, ValueError, RecursionError)
"""Exceptions by which a program ends with an error."""

_Path = Mapping[int, Translation]
"""The translations of the instructions from the first one to a place in a block, by the words at which they begin."""

Run = Callable[[int], tuple[int, int]]
"""Executes at most some instructions; returns the next word of code, or `END_TURN`, and how many are left."""


def error_code(failure: Exception) -> int:
    """Return the code of the error that one of the `FAILURES` is, a negative number of eight bits."""
    if isinstance(failure, ProgramError):
        return failure.code
    return ERR_MEM if isinstance(failure, OutOfMemory) else ERR_ARG


class Block:
    """Instructions that are executed together.

    Attributes:
        quick: Executes them while at least `longest` are left, which must be so at first.
        longest: Number of instructions of the longest path.
        exact: Executes some of them, at least one.
        plain: Whether they are compiled, change variables and ports only, and do not read the time.
        calculates: Whether they are compiled and only calculate with variables, which cannot fail.
    """

    __slots__ = ("_compiler", "_end", "_runs", "_start", "calculates", "exact", "longest", "plain", "quick")

    def __init__(self, start: int, end: int, compiler: Compiler) -> None:
        self._start, self._end, self._compiler, self._runs = start, end, compiler, 0
        self.longest, self.plain, self.calculates = 1, False, False
        self.quick: Run = self._first_runs
        self.exact: Run = self._first_runs

    def _first_runs(self, left: int) -> tuple[int, int]:
        """Execute instructions one by one, up to the first one that jumps back or ends the turn."""
        self._runs += 1
        if self._runs >= OFTEN:
            self._compile()
            return self.quick(left) if left >= self.longest else self.exact(left)
        at, following, compiler = -1, self._start, self._compiler
        while at < following < self._end and left > 0:
            at = following
            try:
                following, left = compiler.step(at, self._end)(left)
            except FAILURES:
                compiler.failed_at = at
                raise
            if compiler.memory.work_left <= 0:
                break
        return following, left

    def _compile(self) -> None:
        tree = _PathTree(self._start, self._end, self._compiler)
        self.quick, self.exact = self._compiler.function(tree.lines), self._first_exact
        self.longest, self.plain, self.calculates = tree.longest, tree.plain, tree.calculates

    def _first_exact(self, left: int) -> tuple[int, int]:
        self.exact = self._compiler.function(_PathTree(self._start, self._end, self._compiler, exact=True).lines)
        return self.exact(left)


def _step(instruction: Instruction, translation: Translation, names: dict[str, Any]) -> Run:
    """Return the function that executes an instruction alone; one without a size is executed once a turn."""
    if isinstance(translation, Next):
        word = translation.word
        return lambda left: (word if isinstance(word, int) else word(), left - 1)
    if isinstance(translation, Branch):
        condition, (_, target, following, _) = _compile(translation.condition, "eval"), translation
        return lambda left: (target if eval(condition, names) else following, left - 1)  # noqa: S307 - our own translation
    if isinstance(translation, Effect):
        action: Action = partial(exec, _compile("\n".join(translation.statements)), names)
    else:
        action = translation
    takes_time = not isinstance(translation, Effect) or translation.takes_time
    following = instruction.following
    taken = LONGEST if takes_time and following == instruction.at else 1

    def step(left: int) -> tuple[int, int]:
        action()
        return following, max(left - taken, 0)

    return step


class Compiler:
    """Compiles the code of one program.

    Attributes:
        operands: See `__init__`.
        failed_at: Word of the instruction that failed; None if there was none, or if it was compiled.
    """

    def __init__(
        self,
        code: Sequence[int],
        decode: Callable[[Sequence[int], int], Instruction],
        translate: Callable[[Instruction], Translation],
        operands: Operands,
    ) -> None:
        """Make a compiler.

        Args:
            code: Words of code.
            decode: Decodes the instruction at a word.
            translate: Translates one instruction.
            operands: The values of the names in translated instructions; functions are added to it.
        """
        self._code, self._decode, self._translate, self.operands = code, decode, translate, operands
        self.memory = operands.names["memory"]
        self.failed_at: int | None = None
        self._steps: dict[int, Run] = {}
        self._translated: dict[int, tuple[Instruction, Translation]] = {}

    def block(self, start: int, end: int) -> Block:
        """Return the block that begins at a word of code.

        Args:
            start: The word.
            end: End of the clump; there is no instruction from there on.

        Raises:
            ProgramError, OutOfMemory, struct.error, LookupError, ArithmeticError, ValueError, RecursionError: There is
                no instruction at the word.
        """
        self.failed_at = start
        self._at(start, end)
        self.failed_at = None
        return Block(start, end, self)

    def _at(self, at: int, end: int) -> tuple[Instruction, Translation]:
        if at >= end:
            raise ProgramError(ERR_INSTR, "a clump ran past its end")
        if at not in self._translated:
            instruction = self._decode(self._code, at)
            self._translated[at] = instruction, self._translate(instruction)
        return self._translated[at]

    def step(self, at: int, end: int) -> Run:
        """Return the function that executes the instruction at a word alone."""
        if at not in self._steps:
            self._steps[at] = _step(*self._at(at, end), self.operands.names)
        return self._steps[at]

    def try_at(self, at: int, end: int) -> tuple[Instruction, Translation] | None:
        """Return the instruction at a word and its translation; None if there is none."""
        try:
            return self._at(at, end)
        except FAILURES:
            return None

    def named(self, at: int, function: Callable[[], object]) -> str:
        """Return a call of the function that carries out the instruction at a word."""
        return f"{self.operands.function(f'at_{at}', function)}()"

    def function(self, lines: list[str]) -> Run:
        """Return the function `block` of some lines."""
        names = self.operands.names
        exec(_compile("\n".join(lines)), names)  # noqa: S102 - our own translation
        function: Run = names.pop("block")
        return function


class _PathTree:
    """The paths from one instruction on, as a function in Python.

    Attributes:
        lines: Its lines.
        longest: Number of instructions of the longest path.
        plain, calculates: See `Block`.
    """

    def __init__(self, start: int, end: int, compiler: Compiler, *, exact: bool = False) -> None:
        self._start, self._end, self._compiler, self._exact = start, end, compiler, exact
        self.longest, self.plain, self.calculates = 1, True, True
        self._loops = self._watches = False
        body = self._branch(start, {}, _MOST_INSTRUCTIONS)
        if self._loops:
            body = [f"while left >= {self.longest}:", *_indented(body), f"return {start}, left"]
        if self._watches:
            low, high = compiler.operands.written
            body = [f"low, high = {low}, {high}", "before = pool[low:high]", *body]
        self.lines = ["def block(left):", *_indented(body)]

    def _branch(self, at: int, path: _Path, most: int) -> list[str]:
        """Return the lines from a place on, of at most some instructions."""
        lines = list[str]()
        while True:
            count = len(path)
            if at == self._start and count:
                return [*lines, *self._again(path)]
            found = self._compiler.try_at(at, self._end)
            if found is None or count >= LONGEST or most <= 0 or at in path:
                return [*lines, self._leave(at, count)]
            instruction, translation = found
            path, most, count = {**path, at: translation}, most - 1, count + 1
            self.calculates = self.calculates and _calculates(translation)
            if isinstance(translation, Effect):
                if translation.takes_time and instruction.following == at:
                    return [*lines, *self._itself(translation.statements, at, count)]
                lines.extend(translation.statements)
                self.plain = self.plain and translation.ports is not None and not translation.reads_clock
                if translation.takes_time:
                    lines.append(self._rest(instruction, count))
            elif isinstance(translation, Branch):
                most //= 2
                lines.append(f"if {translation.condition}:")
                if self._exact:
                    lines.append(f"    if left == {count}: {self._leave(translation.target, count)}")
                lines.extend(_indented(self._branch(translation.target, path, most)))
            elif isinstance(translation, Next):
                if not isinstance(translation.word, int):
                    self.plain = False
                    return [*lines, self._leave(self._compiler.named(at, translation.word), count)]
            else:
                self.plain = False
                call = self._compiler.named(at, translation)
                if instruction.following == at:
                    return [*lines, *self._itself([call], at, count)]
                lines += [call, self._rest(instruction, count)]
            at = _following(instruction, translation)
            if self._exact:
                lines.append(f"if left == {count}: {self._leave(at, count)}")

    def _rest(self, instruction: Instruction, count: int) -> str:
        """Return the line after an instruction that may take the rest of the pass."""
        return f"if memory.work_left <= 0: {self._leave(instruction.following, count)}"

    def _leave(self, at: int | str, count: int) -> str:
        self.longest = max(self.longest, count)
        self.calculates = self.calculates and not (isinstance(at, int) and at >= self._end)
        return f"return {at}, left - {count}"

    def _itself(self, statements: Sequence[str], at: int, count: int) -> list[str]:
        """Return the lines where an instruction has no size and follows itself: once a turn is enough."""
        if count > 1:
            return [self._leave(at, count - 1)]
        return [*statements, f"return {at}, max(left - {LONGEST}, 0)"]

    def _again(self, path: _Path) -> list[str]:
        """Return the lines where the first instruction follows.

        Repeats of a loop are left out if it changed nothing, reads nothing that may change, and does not set ports
        that it reads.
        """
        count = len(path)
        leave = self._leave(self._start, count)
        if self._exact:
            return [leave]
        self._loops = True
        closed = self._closed(path)
        if closed:
            return [f"times, left = divmod(left - {count}, {count})", *closed, "continue"]
        lines = [f"left -= {count}"]
        if _settles(path.values()):
            self._watches = True
            clock_reads = sum(isinstance(each, Effect) and each.reads_clock for each in path.values())
            rest = f"without_repeats(left, {count}, {clock_reads})" if clock_reads else f"left % {count}"
            lines += ["after = pool[low:high]", f"if after == before: left = {rest}", "before = after"]
        return [*lines, "continue"]

    def _closed(self, path: _Path) -> list[str] | None:
        """Return the lines with the effect of `times` repeats of a path, all at once; None if that is not known."""
        repeated = linear([each for each in path.values() if not isinstance(each, Next)])
        if repeated is None:
            return None
        powers = self._compiler.operands.function(f"powers_{self._start}", lru_cache(_KEPT_EFFECTS)(repeated.powers))
        return [f"{repeated.factors} = {powers}(times)", repeated.statement]


def _settles(path: Iterable[Translation]) -> bool:
    """Return whether repeats of a path in a pass change nothing as soon as one of them changes nothing.

    It changes variables and ports only, does not read ports that it sets, and calculates no variable from itself.
    """
    ports = Ports.NOTHING
    for each in path:
        if isinstance(each, Effect):
            target, *others = each.cells or (None,)
            if each.ports is None or each.takes_time or target in others:
                return False
            ports |= each.ports
        elif not isinstance(each, Next | Branch):
            return False
    return ports != Ports.BOTH


def _calculates(translation: Translation) -> bool:
    """Return whether an instruction only calculates with variables that are cells."""
    if isinstance(translation, Next):
        return isinstance(translation.word, int)
    return isinstance(translation, Effect | Branch) and translation.cells is not None


def _following(instruction: Instruction, translation: Translation) -> int:
    if isinstance(translation, Next) and isinstance(translation.word, int):
        return translation.word
    return translation.following if isinstance(translation, Branch) else instruction.following


def _indented(lines: list[str]) -> list[str]:
    return [f"    {line}" for line in lines]


@lru_cache(maxsize=4096)
def _compile(source: str, mode: str = "exec") -> CodeType:
    return compile(source, "<block>", mode)
