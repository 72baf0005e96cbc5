"""The interpreter: clumps take turns of twenty instructions, as many as fit into a pass of one millisecond.

Instructions are compiled in blocks, see `blocks`. A clump that runs alone needs no turns.

Source: LEGO's executable file specification; order and length of turns in docs/firmware.md section 8.3.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from enum import IntEnum
from functools import partial

from sim_backend.firmware.module import NEVER
from sim_backend.firmware.vm.blocks import FAILURES, Block, Compiler
from sim_backend.firmware.vm.data import ERR_ARG, ERR_INSTR, ERR_MEM, FIRST_FIELD, NO_FIELDS, Data, ProgramError
from sim_backend.firmware.vm.devices import Devices
from sim_backend.firmware.vm.dialect import Dialect
from sim_backend.firmware.vm.instructions import END_TURN, Instruction, Ports, Translation, decode
from sim_backend.firmware.vm.memory import Memory, OutOfMemory
from sim_backend.firmware.vm.operands import Operands
from sim_backend.firmware.vm.rxe import Clump, Program

TURN = 20
"""Most instructions of a turn, unless the program changes it."""

QUEUE_GREW = -2
"""Largest next word of an instruction that appended a clump to the queue: -2 minus the word."""

_NO_CLUMP = 0xFF
NOWHERE = _NO_CLUMP, 0
"""Place in the program while no clump runs."""

_BOTH = int(Ports.BOTH)
_JUMP_TO_ITSELF = (0x4025, 0)


class Outcome(IntEnum):
    """How a program ends."""

    OK = 1
    ERROR = 3


Translate = Callable[["Machine", Instruction], Translation]
"""Translates an instruction, see `Translation`."""


class Task:
    """A running clump.

    Attributes:
        number: Number of the clump.
        pc: Index of the next word of code.
        end: The word from which on there is no instruction.
        missing: Number of clumps that must end before it starts.
        wake_ms: Pass in which a sleeping one continues.
        link: Number of the clump behind it that waits for the same mutex.
        turn: Most instructions of its turn.
        blocks: Compiled code by its first word.
    """

    __slots__ = ("blocks", "end", "link", "missing", "number", "pc", "turn", "wake_ms")

    def __init__(self, number: int, start: int, end: int, missing: int) -> None:
        self.number, self.pc, self.end, self.missing = number, start, end, missing
        self.wake_ms, self.link, self.turn = 0, _NO_CLUMP, TURN
        self.blocks: dict[int, Block] = {}


NO_TASK = Task(_NO_CLUMP, 0, 0, 0)
"""Stands in the queue for a clump that does not exist: when it is its turn, no clump runs any more."""


class Machine:
    """A running program.

    Attributes:
        program: The program.
        data: Its variables.
        operands: Expressions of them.
        memory: The pool that holds them.
        devices: The brick's modules.
        task: The clump that runs now.
        now_ms: The current pass.
        sending: Whether it sent something over Bluetooth; to nowhere, since nothing is connected.
        random_state: The last random number of firmware 1.32.
        semaphores: Two bytes of the firmware for programs.
        asked_time: Number of instructions of this turn that asked for the time.
        free: Number of instructions just run that take no time.
        error: Code of the error that ended the program, a negative number of eight bits.
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
        self.data = Data(memory, devices, FIRST_FIELD if dialect.has_fields else NO_FIELDS)
        self.dialect = dialect
        self.operands = Operands(self.data)
        self.operands.function("without_repeats", self._without_repeats)
        self._opcodes = {key: value for key, value in opcodes.items() if key[0] not in dialect.missing}
        self._timing = dialect.timing
        decoder = partial(decode, checks_short_forms=dialect.checks_short_forms)
        self._compiler = Compiler(program.code, decoder, self._translate, self.operands)
        self._spins = frozenset(at for at in range(len(program.code)) if program.code[at : at + 2] == _JUMP_TO_ITSELF)
        self.semaphores, self.sending, self.random_state = [0, 0], False, 1
        self.tasks = [
            Task(i, clump.start, self._end(clump), clump.fire_count) for i, clump in enumerate(program.clumps)
        ]
        self.queue = deque(task for task in self.tasks if not task.missing)
        self._sleeping: list[Task] = []
        self.now_ms = self.asked_time = self._turns_left = self.free = self.error = 0
        self._stopped = False
        if self.queue:
            self.task = self.queue[0]

    @property
    def _runs(self) -> bool:
        """Whether it is the turn of a clump."""
        return bool(self.queue) and self.queue[0] is not NO_TASK

    @property
    def place(self) -> tuple[int, int]:
        """Number of the clump that is next, and its next word, counted from its beginning."""
        if not self._runs:
            return NOWHERE
        task = self.queue[0]
        return task.number, task.pc - self.program.clumps[task.number].start

    def run(self, now_ms: int, most: int | None = None) -> Outcome | None:
        """Run one pass, or at most some instructions; returns the outcome, or None while the program runs."""
        if self._spins and self._all_spin:
            self.queue.rotate(-self._turns_per_pass * (now_ms - self.now_ms - 1))
        self.now_ms = now_ms
        self.memory.begin_pass()
        self._wake()
        try:
            self._run_turns(self._timing.instructions if most is None else most)
        except FAILURES as failure:
            self.error = _error_code(failure)
            return Outcome.ERROR
        return Outcome.OK if self._stopped or not (self._runs or self._sleeping) else None

    def _run_turns(self, instructions: int) -> None:
        turns, queue = self._timing.turns, self.queue
        while instructions > 0 and turns > 0 and queue and not self._stopped and self.memory.work_left > 0:
            self.task = task = queue[0]
            if task is NO_TASK:
                return
            self.asked_time, self._turns_left = 0, turns
            most, several = min(instructions, task.turn), False
            if len(queue) == 1 and turns > 2 * instructions:
                most = instructions
            elif len(queue) == 1 and task.turn == TURN:
                most, several = min(instructions, turns * TURN), True
            done, ended = self._turn(most, several=several)
            instructions -= done
            turns -= max(1, -(-done // TURN)) + self.asked_time
            if not ended:
                queue.rotate(-1)

    def _turn(self, most: int, *, several: bool) -> tuple[int, bool]:
        """Run a turn of the current clump, or `several`; the last one is that in which it does more than calculate.

        Returns:
            The number of instructions, and whether the last one suspended the clump or stopped the program.
        """
        task, left = self.task, most
        pc, blocks = task.pc, task.blocks
        while left > 0 and self.memory.work_left > 0:
            block = blocks.get(pc) or self._block(pc)
            if several and not block.plain:
                turns, done = divmod(most - left, TURN)
                self._turns_left -= turns
                excess = max(0, left - (TURN - done))
                left, most, several = left - excess, most - excess, False
            pc, left = block.quick(left) if left >= block.longest else block.exact(left)
            if pc < 0:
                if pc == END_TURN:
                    self._check_suspended(task)
                    return most - left - 1, True
                pc = QUEUE_GREW - pc
                left, self.free = left + self.free, 0
                excess = max(0, left - (left - most) % task.turn)
                left, most = left - excess, most - excess
        if pc >= task.end:
            raise ProgramError(ERR_INSTR, "a clump ran past its end")
        task.pc = pc
        return most - left, False

    def _block(self, pc: int) -> Block:
        task = self.task
        if pc >= task.end:  # the first instruction after a start or a wait runs wherever it is
            return self._compiler.block(pc, pc + (pc == task.pc))
        block = task.blocks[pc] = self._compiler.block(pc, task.end)
        return block

    def _check_suspended(self, task: Task) -> None:
        """Check the end of a clump that was just suspended, or stopped the program."""
        older = self.dialect.runs_past_end
        others = self._runs and not self._stopped
        if task.pc >= task.end if older else others and task.pc > task.end:
            raise ProgramError(ERR_INSTR, "a clump was suspended past its end")

    def _end(self, clump: Clump) -> int:
        """The word from which on there is no instruction of a clump."""
        if not self.dialect.runs_past_end:
            return clump.end
        return clump.end + 1 if clump.end >= clump.start else len(self.program.code)

    def _without_repeats(self, left: int, size: int, asked: int) -> int:
        """The number of instructions left after the repeats of a loop that changes nothing but asks for the time.

        Args:
            left: Number of instructions left.
            size: Number of instructions in the loop.
            asked: Number of those that ask for the time.
        """
        repeats, rest = divmod(left, size)
        if self.asked_time + repeats * asked >= self._turns_left:
            return left  # meanwhile the time changes
        self.asked_time += repeats * asked
        return rest

    def _wake(self) -> None:
        if self._sleeping:
            for task in [task for task in self._sleeping if task.wake_ms <= self.now_ms]:
                self._sleeping.remove(task)
                self.queue.append(task)

    @property
    def due_ms(self) -> int:
        """The next pass in which a clump continues."""
        if self.queue and not (self._spins and self._all_spin):
            return self.now_ms + 1
        return max(self.now_ms + 1, min((task.wake_ms for task in self._sleeping), default=NEVER))

    @property
    def _all_spin(self) -> bool:
        """Whether each clump that does not sleep is in an empty endless loop."""
        return all(task.pc in self._spins for task in self.queue)

    @property
    def _turns_per_pass(self) -> int:
        return min(self._timing.turns, -(-self._timing.instructions // TURN))

    def _translate(self, instruction: Instruction) -> Translation:
        translate = self._opcodes.get((instruction.opcode, instruction.form))
        if translate is None:
            raise ProgramError(ERR_INSTR, f"instruction 0x{self.program.code[instruction.at]:04x} is not known")
        return translate(self, instruction)

    @property
    def tick(self) -> int:
        """Milliseconds since power-on; the current pass counts only when it is over."""
        return self.now_ms - 1

    def ask_time(self) -> int:
        """The time for a program; it counts as a turn, and with the last turn of a pass the next millisecond begins."""
        self.asked_time += 1
        return self.tick + (self.asked_time >= self._turns_left)

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
            self._fire_none(number & 0xFF)
            return
        task.missing = task.missing - 1 & 0xFF
        if not task.missing:
            self.restart(task)

    def _fire_none(self, number: int) -> None:
        """Count down in the pool where the record of a clump would be that does not exist."""
        layout = self.memory.layout
        at = number * layout.clump + layout.fire_count
        self.memory.pool[at] = self.memory.pool[at] - 1 & 0xFF

    def start(self, number: int) -> None:
        """Start a clump that does not run."""
        task = self.clump(number)
        if task is not None and task not in self.queue and task not in self._sleeping:
            self.restart(task)

    def halt(self, number: int, following: int) -> int:
        """End a clump; the next word of code is `following`, unless it is the current one."""
        task = self.clump(number)
        if task is self.task:
            return self.suspend(following)
        if task is not None:
            for tasks in (self.queue, self._sleeping):
                if task in tasks:
                    tasks.remove(task)
        return following

    def set_turn(self, number: int, instructions: int) -> None:
        """Set how many instructions a turn of a clump has, at least one."""
        task = self.clump(number)
        if task is not None:
            task.turn, self._spins = max(instructions & 0xFF, 1), frozenset()

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


def _error_code(failure: Exception) -> int:
    if isinstance(failure, ProgramError):
        return failure.code
    return ERR_MEM if isinstance(failure, OutOfMemory) else ERR_ARG
