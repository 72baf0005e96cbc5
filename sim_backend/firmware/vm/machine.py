"""The interpreter: clumps take turns of twenty instructions, as many as fit into a pass of one millisecond.

Instructions are compiled in blocks, see `blocks`. A clump that runs alone needs no turns.

Source: LEGO's executable file specification; order and length of turns in docs/firmware.md section 8.3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from enum import IntEnum
from functools import partial

from sim_backend.firmware.module import NEVER
from sim_backend.firmware.vm.blocks import FAILURES, Block, Compiler, error_code
from sim_backend.firmware.vm.clump_queue import NO_CLUMP, ClumpQueue
from sim_backend.firmware.vm.data import ERR_INSTR, FIRST_FIELD, NO_FIELDS, Data, ProgramError
from sim_backend.firmware.vm.devices import Devices
from sim_backend.firmware.vm.dialect import Dialect
from sim_backend.firmware.vm.instructions import END_TURN, Instruction, Translation, decode
from sim_backend.firmware.vm.memory import Memory
from sim_backend.firmware.vm.operands import Operands
from sim_backend.firmware.vm.rxe import Program
from sim_backend.firmware.vm.task import AWAKE, TURN, Task, compares_aggregates, end_of

QUEUE_CHANGED = -2
"""Largest next word of an instruction that changed the queue but not whose turn it is: -2 minus the word."""

NOWHERE = NO_CLUMP, 0
"""Place in the program while no clump runs."""

_JUMP_TO_ITSELF = (0x4025, 0)


class Outcome(IntEnum):
    """How a program ends."""

    OK = 1
    ERROR = 3


Translate = Callable[["Machine", Instruction], Translation]
"""Translates an instruction, see `Translation`."""


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
        lag: Passes by which the Tick of the Command map, which clumps wake up by, is behind.
        random_state, random_seed: The last random number of firmware 1.32, and where they began.
        semaphores: Two bytes of the firmware for programs.
        full: Whether the last instruction, which may have suspended its clump, filled the pass.
        calculates: Whether the last instructions of the last turn only calculated, so that it may be able to run ahead.
        turn_start: The word at which this turn began.
        clock_reads: Number of instructions of this turn that read the time.
        handles: Names of the files that the program has opened, and whether to write, by handle.
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
        first_field = FIRST_FIELD if dialect.has_fields else NO_FIELDS
        self.data = Data(memory, devices, first_field, dialect.wide)
        self.dialect = dialect
        self.operands = Operands(self.data)
        self.operands.function("without_repeats", self._without_repeats)
        self._opcodes = {key: value for key, value in opcodes.items() if key[0] not in dialect.missing}
        self._timing = dialect.timing
        self._set_code(program.code)
        self.handles = dict[int, tuple[str, bool]]()
        self.semaphores, self.random_state, self.random_seed = [0, 0], 1, 1
        self.tasks = [
            Task(i, clump.start, end_of(clump, program, past_end=dialect.runs_past_end))
            for i, clump in enumerate(program.clumps)
        ]
        self.queue, self._sleeping = self.queue_at(), self.queue_at()
        scans, comparisons = dialect.records.compares is not None, dict[int, int]()
        for task in self.tasks:
            task.compares = scans and compares_aggregates(task, program.code, self.data, comparisons)
            task.misses = dialect.misses_jumps and task.compares
            self.reset(task)
            if not program.clumps[task.number].fire_count:
                self.queue.append(task.number)
        self.now_ms = self.lag = self.clock_reads = self._turns_left = self.error = self.turn_start = 0
        self._stopped, self.calculates, self.full, self._done_ahead = False, False, False, 0
        if self.runs:
            self.task = self.tasks[self.queue.first]

    def _set_code(self, code: tuple[int, ...]) -> None:
        decoder = partial(decode, checks_short_forms=self.dialect.checks_short_forms)
        self._compilers = [Compiler(code, decoder, self._translate, self.operands) for _ in range(2)]  # see Task.misses
        self.spins = frozenset(at for at in range(len(code)) if code[at : at + 2] == _JUMP_TO_ITSELF)

    def change_code(self, content: bytes) -> None:
        """Continue with the code that is now in the place of the program's file."""
        self.program = self.program.with_content(content)
        self._set_code(self.program.code)
        for task in self.tasks:
            task.blocks.clear()

    @property
    def runs(self) -> bool:
        """Whether it is the turn of a clump that exists."""
        return self.queue.ends[0] < len(self.tasks)

    @property
    def place(self) -> tuple[int, int]:
        """Number of the clump that is next, and its next word, counted from its beginning."""
        if not self.runs:
            return NOWHERE
        task = self.tasks[self.queue.first]
        return task.number, task.pc - self.program.clumps[task.number].start

    def close_files(self) -> None:
        """Close the files that the program left open; data files end after what was written, but not in 1.05."""
        loader = self.devices.loader
        for handle in sorted(self.handles):
            (loader.crop if self.dialect.crops_files else loader.close)(handle)

    def run(self, now_ms: int, *, step: bool = False) -> Outcome | None:
        """Run one pass, or one instruction; return the outcome, or None while the program runs."""
        if self.spins:
            self._skip_spinning(now_ms)
        self.now_ms, self.full = now_ms, False
        self.memory.begin_pass()
        if self._sleeping.ends[0] != NO_CLUMP:
            self._wake()
        try:
            self._run_turns(step=step)
        except FAILURES as failure:
            self.error = error_code(failure)
            if self.dialect.runs_past_end and self._compilers[0].failed_at is not None:
                self.task.pc = self._compilers[0].failed_at  # others show where the turn began
            return Outcome.ERROR
        return Outcome.OK if self._stopped or not (self.runs or self._exists(self._sleeping.first)) else None

    def _skip_spinning(self, now_ms: int) -> None:
        """Account for the turns of empty endless loops in the passes since the last one."""
        if self._all_spin:
            turns = min(self._turns, -(-self._timing.instructions // TURN))
            for _ in range(turns * (now_ms - self.now_ms - 1) % len(list(self.queue))):
                self.queue.rotate()

    def run_ahead(self, until_ms: int) -> int:
        """Run the next passes as far as they only calculate, which nothing else on the brick sees before they end.

        `run` executes the rest of the pass in which the program does more.

        Args:
            until_ms: The last one of these passes.

        Returns:
            The last pass that is complete.
        """
        task, ends = self.task, self.queue.ends
        block = task.blocks.get(task.pc)
        if not (block and block.calculates and ends[0] == ends[1] == task.number and self._may_run_ahead):
            return self.now_ms
        size = min(self._timing.instructions, self._timing.turns * TURN)
        left = total = size * (until_ms - self.now_ms)
        while left > 0 and block and block.calculates:
            task.pc, left = block.quick(left) if left >= block.longest else block.exact(left)
            block = task.blocks.get(task.pc)
        passes, self._done_ahead = divmod(total - left, size)
        self.now_ms += passes
        return self.now_ms

    @property
    def _may_run_ahead(self) -> bool:
        """Whether a clump that is alone in the queue can have whole passes for itself."""
        waits = self._sleeping.ends[0] != NO_CLUMP or self.memory.work_left < 0
        return not (waits or self.task.misses or self.task.turn != TURN)

    def _run_turns(self, *, step: bool) -> None:
        instructions = 1 if step else self._timing.instructions
        turns, queue, ends, tasks, memory = self._turns, self.queue, self.queue.ends, self.tasks, self.memory
        while instructions > 0 and turns > 0 and not self._stopped and memory.work_left > 0:
            number = ends[0]
            if number >= len(tasks):
                return
            self.task = task = tasks[number]
            self.clock_reads, self._turns_left, self.turn_start = 0, turns, task.pc
            most, several = task.turn, False
            if number == ends[1] and not task.misses:  # it is alone and needs no turns
                if turns > 2 * instructions:
                    most = instructions
                elif most == TURN:
                    most, several = turns * TURN, True
            done, ended = self._turn(most if most < instructions else instructions, several=several)
            instructions -= done
            self.full = instructions <= ended
            turns -= (-(-done // TURN) or 1) + self.clock_reads
            if self.lag:
                turns = min(turns, self._turns - 1)
            if not ended and ends[0] != ends[1]:
                queue.rotate()
            if step:  # one that suspends its clump counts, too
                return

    def _turn(self, most: int, *, several: bool) -> tuple[int, bool]:
        """Run a turn of the current clump, or `several`; the last one is that in which it does more than calculate.

        Returns:
            The number of instructions, and whether the last one suspended the clump or stopped the program.
        """
        task, left, self._done_ahead = self.task, most - self._done_ahead, 0
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
                pc = QUEUE_CHANGED - pc
                excess = max(0, left - (left - most) % task.turn)
                left, most = left - excess, most - excess
        task.pc, self.calculates = pc, block.calculates
        if pc >= task.end:
            raise ProgramError(ERR_INSTR, "a clump ran past its end")
        return most - left, False

    def _block(self, pc: int) -> Block:
        task = self.task
        if pc >= task.end:  # the first instruction after a start or a wait runs wherever it is
            return self._compilers[task.misses].block(pc, pc + (pc == task.pc))
        task.blocks[pc] = self._compilers[task.misses].block(pc, task.end)
        return task.blocks[pc]

    def _check_suspended(self, task: Task) -> None:
        """Check the end of a clump that was just suspended, or stopped the program."""
        older = self.dialect.runs_past_end
        others = self.runs and not self._stopped
        ended = task.pc == self.program.clumps[task.number].start  # a clump that has ended will begin again
        if task.pc >= task.end if older else others and not ended and task.pc > task.end:
            raise ProgramError(ERR_INSTR, "a clump was suspended past its end")

    def _without_repeats(self, left: int, size: int, clock_reads: int) -> int:
        """Return the number of instructions left after the repeats of a loop that changes nothing but reads the time.

        Args:
            left: Number of instructions left.
            size: Number of instructions in the loop.
            clock_reads: Number of those that read the time.
        """
        repeats, rest = divmod(left, size)
        if self.clock_reads + repeats * clock_reads >= self._turns_left:
            return left  # meanwhile the time changes
        self.clock_reads += repeats * clock_reads
        return rest

    def _wake(self) -> None:
        for number in self._sleeping:
            if self._wake_ms(number) <= self.now_ms - self.lag:
                self._sleeping.remove(number)
                self.tasks[number].wake_ms = AWAKE
                self.queue.append(number)

    def _wake_ms(self, number: int) -> int:
        return self.tasks[number].wake_ms if self._exists(number) else NEVER

    @property
    def due_ms(self) -> int:
        """The next pass in which a clump continues."""
        following = self.now_ms + 1
        if self.runs and not (self.spins and self._all_spin):
            return following
        return max(following, min(map(self._wake_ms, self._sleeping), default=NEVER) + self.lag)

    @property
    def _all_spin(self) -> bool:
        """Whether each clump that does not sleep is in an empty endless loop, and none is lost from the queue."""
        numbers = list(self.queue)
        return numbers[-1:] == [self.queue.last] and all(
            self._exists(number) and self.tasks[number].pc in self.spins for number in numbers
        )

    @property
    def _turns(self) -> int:
        """The most turns of a pass."""
        return 1 if self.lag and self.dialect.late_tick_ends_pass else self._timing.turns

    def _translate(self, instruction: Instruction) -> Translation:
        translate = self._opcodes.get((instruction.opcode, instruction.form))
        if translate is None:
            raise ProgramError(ERR_INSTR, f"instruction 0x{self.program.code[instruction.at]:04x} is not known")
        return translate(self, instruction)

    @property
    def tick(self) -> int:
        """Milliseconds since power-on; the current pass counts only when it is over."""
        return self.now_ms - 1

    def read_clock(self) -> int:
        """Return the time for a program; reading it counts as a turn, and a pass's last turn begins a millisecond."""
        self.clock_reads += 1
        return self.tick + (self.clock_reads >= self._turns_left)

    def suspend(self, following: int) -> int:
        """Take the first clump out of the queue, which is the current one unless it ended itself before.

        The current one will continue at `following`.
        """
        self.task.pc = following
        self.queue.remove(self.queue.first)
        return END_TURN

    def note_call(self, caller: int, called: int) -> None:
        """Note in the record of a clump which one it has called, where records have that."""
        layout = self.memory.layout
        if layout.called:
            self.memory.pool[caller * layout.clump + layout.called] = called

    def forget_calls(self) -> None:
        """Note at the end of the program that no clump has called another."""
        for task in self.tasks:
            self.note_call(task.number, NO_CLUMP)

    def sleep(self, duration_ms: int, following: int) -> int:
        """Put the first clump of the queue to sleep; with no time to sleep it only goes to the end."""
        number = self.queue.first
        self.suspend(following)
        if duration_ms and self._exists(number):
            self.tasks[number].wake_ms = self.now_ms - self.lag + duration_ms & 0xFFFF_FFFF
        (self._sleeping if duration_ms else self.queue).append(number)
        return END_TURN

    def fire(self, number: int) -> None:
        """Count the end of a clump that this one waits for, in the place where its record is, or would be."""
        layout, pool = self.memory.layout, self.memory.pool
        at = (number & 0xFF) * layout.clump + layout.fire_count
        pool[at] = pool[at] - 1 & 0xFF
        if not pool[at]:
            self.queue.append(number & 0xFF)

    def reset(self, task: Task) -> None:
        """Let a clump wait for the ends of others, as at the start of the program."""
        clump, layout = self.program.clumps[task.number], self.memory.layout
        self.memory.pool[task.number * layout.clump + layout.fire_count] = clump.fire_count
        task.pc = clump.start

    def start(self, number: int, following: int) -> int:
        """Start a clump, unless it runs or sleeps; then the turn of the current one begins again."""
        if number in self.queue or number in self._sleeping:
            return following
        self.queue.append(number)
        self.task.pc = following
        return END_TURN

    def halt(self, number: int, waiting: Iterable[ClumpQueue]) -> None:
        """End a clump that runs, sleeps, waits in one of some queues, or for the return of another one."""
        found = next((queue for queue in (self.queue, self._sleeping, *waiting) if number in queue), None)
        if found:
            found.remove(number)
        if self._exists(number):
            self.reset(self.tasks[number])
            self.tasks[number].wake_ms = AWAKE

    def set_turn(self, number: int, instructions: int) -> None:
        """Set how many instructions a turn of a clump has, at least one."""
        number, layout = number & 0xFF, self.memory.layout
        if self._exists(number):
            self.memory.pool[number * layout.clump + layout.fire_count + 2] = turn = instructions & 0xFF
            self.tasks[number].turn = max(turn, 1)
            self.spins = frozenset()

    def queue_at(self, ends: bytearray | None = None, at: int = 0) -> ClumpQueue:
        """Return a queue of clumps, whose first and last one are in two bytes, new ones by default."""
        layout = self.memory.layout
        return ClumpQueue(self.memory.pool, layout.clump, layout.fire_count + 1, ends, at)

    def _exists(self, number: int) -> bool:
        return number < len(self.tasks)

    def stop(self) -> None:
        """End the program."""
        self._stopped = True
