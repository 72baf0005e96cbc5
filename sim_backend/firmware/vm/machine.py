"""The interpreter: clumps run in turns, a few instructions each per pass of one millisecond.

Source: LEGO's executable file specification; life cycle in docs/firmware.md section 8. An illegal operation ends the
program with an error.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import NamedTuple

from sim_backend.firmware.cint import s16
from sim_backend.firmware.module import NEVER
from sim_backend.firmware.vm.devices import FIRST_FIELD, Devices
from sim_backend.firmware.vm.memory import Memory, OutOfMemory, Value
from sim_backend.firmware.vm.rxe import Program

SLICE = 20
"""Instructions per turn of a clump; each clump has one turn per pass. On the real brick the number depends on the
instructions; programs that wait by the clock are not affected."""

NONE = 0xFFFF
"""An omitted argument."""

JUMP = 0x25
_SHORT = 0x08
_VARIABLE_SIZE = 0xE
_WORD = 2
_SHORT_OPCODES = (0x1B, 0x2C, 0x2D, 0x2E)
"""Move, acquire, release and call have short forms of one word less."""


class Outcome(IntEnum):
    """How a program ends."""

    OK = 1
    ERROR = 3


class ProgramError(Exception):
    """The program cannot continue."""


class Instruction(NamedTuple):
    """One instruction.

    Attributes:
        flags: Index of the comparison.
        arguments: Words after the instruction word.
    """

    flags: int
    arguments: tuple[int, ...]


class _Decoded(NamedTuple):
    handler: Callable[[Machine, Instruction], None]
    instruction: Instruction
    next: int
    spins: bool


class Task:
    """A running clump.

    Attributes:
        number: Number of the clump.
        pc: Index of the next word of code.
        missing: Number of clumps that must end before it starts.
        wake_ms: Pass in which it continues, `NEVER` in an empty endless loop.
    """

    __slots__ = ("missing", "number", "pc", "start", "wake_ms")

    def __init__(self, number: int, start: int, missing: int) -> None:
        self.number, self.start, self.missing = number, start, missing
        self.pc = start
        self.wake_ms = 0


class Machine:
    """A running program.

    Attributes:
        program: The program.
        memory: Its variables.
        devices: The brick's modules.
        task: The clump that runs now.
        now_ms: The current pass.
        mutexes: Number of the variable to the clumps that requested it; the first one holds it.
    """

    def __init__(
        self,
        program: Program,
        memory: Memory,
        devices: Devices,
        opcodes: Mapping[int, Callable[[Machine, Instruction], None]],
    ) -> None:
        self.program, self.memory, self.devices = program, memory, devices
        self._opcodes = opcodes
        self._decoded: dict[int, _Decoded] = {}
        self.tasks = [Task(i, clump.start, clump.fire_count) for i, clump in enumerate(program.clumps)]
        self._queue = [task for task in self.tasks if not task.missing]
        self.mutexes: dict[int, list[int]] = {}
        self.now_ms = self._at = 0
        self._stopped = False

    def run(self, now_ms: int) -> Outcome | None:
        """Run one turn of every clump; returns the outcome, or None while the program runs."""
        self.now_ms = now_ms
        try:
            for task in list(self._queue):
                if task.wake_ms <= now_ms:
                    self._turn(task)
        except (ProgramError, OutOfMemory, struct.error, LookupError, ArithmeticError, ValueError, RecursionError):
            return Outcome.ERROR
        return Outcome.OK if self._stopped or not self._queue else None

    @property
    def due_ms(self) -> int:
        """The next pass in which a clump continues."""
        return max(self.now_ms + 1, min((task.wake_ms for task in self._queue), default=NEVER))

    def _turn(self, task: Task) -> None:
        self.task = task
        for _ in range(SLICE):
            if self._stopped or task.wake_ms > self.now_ms or task not in self._queue:
                return
            decoded = self._decoded.get(task.pc) or self._decode(task.pc)
            if decoded.spins:
                task.wake_ms = NEVER
                return
            self._at, task.pc = task.pc, decoded.next
            decoded.handler(self, decoded.instruction)

    def _decode(self, pc: int) -> _Decoded:
        code = self.program.code
        if not 0 <= pc < len(code):
            raise ProgramError(f"there is no code at word {pc}")
        word = code[pc]
        size, flags, opcode = word >> 12, word >> 8 & 0x7, word & 0xFF
        start = pc + 1
        arguments: tuple[int, ...]
        if word >> 8 & _SHORT:
            arguments = (opcode,) if size == _WORD else (code[start] + _signed(opcode) & NONE, code[start])
            opcode, flags = _SHORT_OPCODES[flags], 0
        else:
            if size == _VARIABLE_SIZE:
                size, start = code[start], start + 1
            arguments = code[start : pc + size // _WORD]
        handler = self._opcodes.get(opcode)
        if handler is None or size < _WORD:
            raise ProgramError(f"instruction 0x{word:04x} is not known")
        following = pc + size // _WORD
        decoded = _Decoded(handler, Instruction(flags, arguments), following, spins=self._spins(pc))
        self._decoded[pc] = decoded
        return decoded

    def _spins(self, pc: int) -> bool:
        """Whether the code at `pc` is an endless loop of jumps only."""
        code, seen = self.program.code, set[int]()
        while pc not in seen and 0 <= pc < len(code) - 1 and code[pc] & (_SHORT << 8 | 0xFF) == JUMP:
            seen.add(pc)
            pc += s16(code[pc + 1])
        return pc in seen

    def get(self, argument: int) -> Value:
        """The value of a variable, or of a field of a port."""
        if argument >= FIRST_FIELD:
            return self.devices.get_field(argument)
        return self.memory.get(argument)

    def put(self, argument: int, value: Value) -> None:
        """Set a variable, or a field of a port."""
        if argument >= FIRST_FIELD:
            self.devices.put_field(argument, number(value))
        else:
            self.memory.put(argument, value)

    def jump(self, words: int) -> None:
        """Jump by `words` (16 bits, signed) from the start of the instruction."""
        self.task.pc = self._at + s16(words)

    def wait(self, duration_ms: int) -> None:
        """Put the current clump to sleep."""
        self.task.wake_ms = self.now_ms + max(duration_ms, 0)

    def suspend(self, task: Task) -> None:
        """Remove a clump from the queue."""
        if task in self._queue:
            self._queue.remove(task)

    def resume(self, task: Task) -> None:
        """Append a clump to the queue."""
        if task not in self._queue:
            self._queue.append(task)

    def fire(self, number: int) -> None:
        """Count the end of a clump that this one waits for."""
        task = self.tasks[number]
        task.missing -= 1
        if task.missing <= 0:
            self.restart(task)

    def restart(self, task: Task) -> None:
        """Start a clump from its beginning."""
        task.pc, task.missing, task.wake_ms = task.start, self.program.clumps[task.number].fire_count, 0
        self.resume(task)

    def stop(self) -> None:
        """End the program."""
        self._stopped = True


def number(value: Value) -> int:
    """A single value as a whole number.

    Raises:
        ProgramError: It is an array or a cluster.
    """
    if isinstance(value, list):
        raise ProgramError("an array where a number is needed")
    return round(value)


def _signed(byte: int) -> int:
    return byte - 0x100 if byte & 0x80 else byte
