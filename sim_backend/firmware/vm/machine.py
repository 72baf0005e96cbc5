"""The interpreter: clumps take turns of twenty instructions, as many as fit into a pass of one millisecond.

Each instruction is translated once into a function without arguments that carries it out and returns the index of the
next word of code, or a negative number that ends the turn.

Source: LEGO's executable file specification; order and length of turns in docs/firmware.md section 8.3.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import NamedTuple

from sim_backend.firmware.cint import s8
from sim_backend.firmware.module import NEVER
from sim_backend.firmware.vm.data import ERR_INSTR, Data, ProgramError
from sim_backend.firmware.vm.devices import Devices
from sim_backend.firmware.vm.dialect import Dialect
from sim_backend.firmware.vm.memory import Memory, OutOfMemory
from sim_backend.firmware.vm.rxe import Program

TURN = 20
"""Most instructions of a turn."""

END_TURN = -1
"""Next word of an instruction that suspended its clump or stopped the program."""

ERR_MEM = -5
_NO_CLUMP = 0xFF
_SHORT = 0x8
_VARIABLE_SIZE = 0xE
_WORD = 2
_SHORT_OPCODES = (0x1B, 0x2C, 0x2D, 0x2E)
"""Move, acquire, release and call have short forms of one word less."""
_SHORT_FORMS = 4
_JUMP_TO_ITSELF = (0x4025, 0)


class Outcome(IntEnum):
    """How a program ends."""

    OK = 1
    ERROR = 3


class Instruction(NamedTuple):
    """One instruction.

    Attributes:
        opcode: Number of the operation.
        flags: Index of the comparison.
        arguments: Words after the instruction word.
        at: Index of its first word.
        following: Index of the word after it.
    """

    opcode: int
    flags: int
    arguments: tuple[int, ...]
    at: int
    following: int


Step = Callable[[], int]
Translate = Callable[["Machine", Instruction], Step]


class Task:
    """A running clump.

    Attributes:
        number: Number of the clump.
        pc: Index of the next word of code.
        missing: Number of clumps that must end before it starts.
        wake_ms: Pass in which a sleeping one continues.
        link: Number of the clump behind it that waits for the same mutex.
    """

    __slots__ = ("link", "missing", "number", "pc", "wake_ms")

    def __init__(self, number: int, start: int, missing: int) -> None:
        self.number, self.pc, self.missing = number, start, missing
        self.wake_ms, self.link = 0, _NO_CLUMP


class Machine:
    """A running program.

    Attributes:
        program: The program.
        data: Its variables.
        memory: The pool that holds them.
        devices: The brick's modules.
        task: The clump that runs now.
        now_ms: The current pass.
        sending: Whether it sent something over Bluetooth; to nowhere, since nothing is connected.
        semaphores: Two bytes of the firmware for programs.
        asked_time: Number of instructions of this turn that asked for the time.
    """

    def __init__(
        self,
        program: Program,
        memory: Memory,
        devices: Devices,
        opcodes: Mapping[tuple[int, int], Translate],
        dialect: Dialect,
    ) -> None:
        self.program, self.memory, self.devices = program, memory, devices
        self.data = Data(memory, devices)
        self.dialect = dialect
        self._opcodes = {key: value for key, value in opcodes.items() if key[0] not in dialect.missing}
        self._timing = dialect.timing
        self.semaphores, self.sending = [0, 0], False
        self._steps: list[Step | None] = [None] * (len(program.code) + 1)
        self.tasks = [Task(i, clump.start, clump.fire_count) for i, clump in enumerate(program.clumps)]
        self.queue = deque(task for task in self.tasks if not task.missing)
        self._sleeping: list[Task] = []
        self.now_ms = self.asked_time = 0
        self._stopped = False
        if self.queue:
            self.task = self.queue[0]

    def run(self, now_ms: int) -> Outcome | None:
        """Run one pass; returns the outcome, or None while the program runs."""
        if self._all_spin:
            self.queue.rotate(-self._turns_per_pass * (now_ms - self.now_ms - 1))
        self.now_ms = now_ms
        self.memory.begin_pass()
        self._wake()
        try:
            self._run_turns()
        except (ProgramError, OutOfMemory, struct.error, LookupError, ArithmeticError, ValueError, RecursionError):
            return Outcome.ERROR
        return Outcome.OK if self._stopped or not (self.queue or self._sleeping) else None

    def _run_turns(self) -> None:
        instructions, turns, queue = self._timing.instructions, self._timing.turns, self.queue
        while instructions > 0 and turns > 0 and queue and not self._stopped:
            self.task = queue[0]
            self.asked_time = 0
            done, ended = self._turn(min(instructions, TURN))
            instructions -= done
            turns -= 1 + self.asked_time
            if not ended:
                queue.rotate(-1)

    def _turn(self, most: int) -> tuple[int, bool]:
        """Run one turn of the current clump; returns the number of instructions, and whether the last one ended it."""
        task, steps = self.task, self._steps
        end = self.program.clumps[task.number].end
        pc = task.pc
        for done in range(most):
            if pc >= end:
                raise ProgramError(ERR_INSTR, "a clump ran past its end")
            step = steps[pc] or self._translate(pc)
            pc = step()
            if pc < 0:
                return done, True
        task.pc = pc
        return most, False

    def _wake(self) -> None:
        if self._sleeping:
            for task in [task for task in self._sleeping if task.wake_ms <= self.now_ms]:
                self._sleeping.remove(task)
                self.queue.append(task)

    @property
    def due_ms(self) -> int:
        """The next pass in which a clump continues."""
        if self.queue and not self._all_spin:
            return self.now_ms + 1
        return max(self.now_ms + 1, min((task.wake_ms for task in self._sleeping), default=NEVER))

    @property
    def _all_spin(self) -> bool:
        """Whether each clump that does not sleep is in an empty endless loop."""
        code = self.program.code
        return all(code[task.pc : task.pc + 2] == _JUMP_TO_ITSELF for task in self.queue)

    @property
    def _turns_per_pass(self) -> int:
        return min(self._timing.turns, -(-self._timing.instructions // TURN))

    def _translate(self, pc: int) -> Step:
        instruction = self._decode(pc)
        size = self.program.code[pc] >> 12
        count = len(instruction.arguments) if self.program.code[pc] & _SHORT << 8 else min(size // _WORD - 1, MANY)
        translate = self._opcodes.get((instruction.opcode, count))
        if translate is None:
            raise ProgramError(ERR_INSTR, f"instruction 0x{self.program.code[pc]:04x} is not known")
        step = translate(self, instruction)
        self._steps[pc] = step
        return step

    def _decode(self, pc: int) -> Instruction:
        code = self.program.code
        word = code[pc]
        size, flags, opcode = word >> 12, word >> 8 & 0x7, word & 0xFF
        if size == _VARIABLE_SIZE:
            size = code[pc + 1]
        following = pc + size // _WORD
        arguments = tuple(code[pc + 1 : following])
        if word >> 8 & _SHORT:
            if flags >= _SHORT_FORMS:
                raise ProgramError(ERR_INSTR, "a short form that does not exist")
            arguments = (opcode,) if size == _WORD else (s8(opcode) + arguments[0] & 0xFFFF, *arguments)
            opcode, flags = _SHORT_OPCODES[flags], 0
        return Instruction(opcode, flags, arguments, pc, following)

    def sized_arguments(self, instruction: Instruction) -> tuple[int, ...]:
        """Arguments of an instruction that has any number of them; its first word is its size in bytes."""
        code, at = self.program.code, instruction.at
        return code[at + 2 : at + code[at + 1] // _WORD]

    def finished(self, step: Callable[[], None], instruction: Instruction) -> Step:
        """A step that always continues with the following instruction."""
        following = instruction.following

        def run() -> int:
            step()
            return following

        return run

    def suspend(self, following: int) -> int:
        """Take the current clump out of the queue; it will continue at `following`."""
        self.task.pc = following
        self.queue.remove(self.task)
        return END_TURN

    def sleep(self, duration_ms: int, following: int) -> int:
        """Let the current clump sleep; one that sleeps no time only goes to the end of the queue."""
        if not duration_ms:
            self.suspend(following)
            self.queue.append(self.task)
            return END_TURN
        self.task.wake_ms = self.now_ms + duration_ms
        self._sleeping.append(self.task)
        return self.suspend(following)

    def fire(self, number: int) -> None:
        """Count the end of a clump that this one waits for."""
        task = self.clump(number)
        if task is None:
            return
        task.missing = task.missing - 1 & 0xFF
        if not task.missing:
            self.restart(task)

    def restart(self, task: Task) -> None:
        """Start a clump from its beginning."""
        task.pc = self.program.clumps[task.number].start
        self.queue.append(task)

    def wait_for(self, mutex: int, task: Task) -> None:
        """Append a clump to those that wait for the mutex at an offset."""
        pool, at = self.memory.pool, self.memory.base + mutex
        if pool[at + 1] == _NO_CLUMP:
            pool[at + 1] = task.number
        else:
            last = self.clump(pool[at + 2])
            if last is not None:
                last.link = task.number
        pool[at + 2], task.link = task.number, _NO_CLUMP

    def hand_over(self, mutex: int) -> None:
        """Give the mutex at an offset to the first clump that waits for it."""
        pool, at = self.memory.pool, self.memory.base + mutex
        pool[at] = first = pool[at + 1]
        if first != _NO_CLUMP:
            task = self.clump(first)
            if task is None:
                return
            pool[at + 1] = task.link
            if task.link == _NO_CLUMP:
                pool[at + 2] = _NO_CLUMP
            self.queue.append(task)

    def clump(self, number: int) -> Task | None:
        """A clump by its number, of which eight bits count; None if there is none, and the firmware does nothing."""
        return self.tasks[number & 0xFF] if number & 0xFF < len(self.tasks) else None

    def stop(self) -> None:
        """End the program."""
        self._stopped = True


MANY = 4
"""Number of arguments from which on the firmware does not distinguish."""
