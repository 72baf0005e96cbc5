"""The command module: runs programs, keeps their mailboxes, and holds the brick's clock.

Source: docs/firmware.md sections 1, 4, 5.2 (Command map) and 8.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from enum import Enum, auto

from firmware_protocol.enums import InterpreterState
from firmware_protocol.iomap import ProgramStatus
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.files.names import NAME_SIZE, unpack_name
from sim_backend.firmware.mailboxes import Mailboxes
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.program_offsets import ProgramOffsets
from sim_backend.firmware.program_tick import ProgramTick
from sim_backend.firmware.vm.calibrations import Calibrations
from sim_backend.firmware.vm.clump_records import ClumpRecords
from sim_backend.firmware.vm.devices import Devices
from sim_backend.firmware.vm.dialect import Dialect
from sim_backend.firmware.vm.machine import NOWHERE, Machine, Outcome
from sim_backend.firmware.vm.memory import Memory, OutOfMemory
from sim_backend.firmware.vm.opcodes import OPCODES
from sim_backend.firmware.vm.pool_layout import POOL_SIZE, Layout, fresh_pool
from sim_backend.firmware.vm.rxe import BadProgram, Fault, parse

_CALIBRATIONS = "*.cal"
"""Files that the firmware looks for at the start of a program."""

_NO_PAUSE = b"\xff\xff\xff\0"
"""The property `pause` at the start of a program."""


class _Phase(Enum):
    IDLE = auto()
    RUNNING = auto()
    ENDED = auto()
    """The program still counts as active but no longer runs."""
    WAITING = auto()
    """Nothing is started until ProgStatus is RESET."""


_IN_PROGRAM, _RUNNING = _Phase.RUNNING, int(InterpreterState.RUNNING)
"""Constants that each pass uses; the members of an enumeration take longer to find."""


class CommandModule:
    """State of the program interpreter.

    Attributes:
        due_ms: See `Module`.
        calculates: Whether `run_ahead` may be able to run passes.
        status: See `firmware_protocol.iomap.ProgramStatus`.
        activate: 1 to start the program `file_name` in the next pass.
        deactivate: 1 to stop the program; without a program it stays set and stops the next one.
        file_name: 20 bytes, as commanded.
        program_name: Name that the last program was started by.
        mailboxes: The program's mailboxes, or None without a program.
        after_pool: The bytes that repeat in the memory after the pool of programs to be started.
        has_breakpoints: Whether this firmware has breakpoints, and the property `pause`.
        pause: Clump, offset in words, and whether to pause programs there, which is not simulated.
        offsets: Where the last program's variables are in the IO map.
        sync_time: Time set for the data log.
        sync_tick: The brick's time at that moment.
    """

    def __init__(
        self,
        clock: Clock,
        loader: Loader,
        layout: Layout,
        dialect: Dialect,
        *,
        equip: Callable[[Mailboxes, Calibrations], Devices],
        on_end: Callable[[], None],
        reset_devices: Callable[[], None],
    ) -> None:
        """Make the module.

        Args:
            clock: The brick's time.
            loader: The file system that holds programs.
            layout: How this firmware uses the memory pool.
            dialect: How its interpreter differs from others.
            equip: Returns the modules that a program can use.
            on_end: Called in the pass in which a program ends.
            reset_devices: Resets inputs and outputs to their state at power-on.
        """
        self._clock, self._loader, self._layout, self._dialect = clock, loader, layout, dialect
        self._equip, self._on_end, self._reset_devices = equip, on_end, reset_devices
        loader.flash.memory.on_write = self._read_code
        self._phase = _Phase.IDLE
        self._machine: Machine | None = None
        self._records: ClumpRecords | None = None
        self._handle: int | None = None
        self._state = int(InterpreterState.IDLE)
        self.after_pool = b"\0"
        self._pool = fresh_pool()
        self.offsets = ProgramOffsets(keeps=dialect.keeps_offsets)
        self._tick = ProgramTick(clock, stops=dialect.abort_stops_tick)
        self.due_ms, self.calculates, self._missed_ms = NEVER, False, NEVER
        self.status = int(ProgramStatus.IDLE)
        self.activate = self.deactivate = 0
        self.file_name, self.program_name = bytes(NAME_SIZE), ""
        self.mailboxes: Mailboxes | None = None
        self.sync_time = self.sync_tick = 0
        self.has_breakpoints, self.pause = dialect.records.points is not None, bytes(len(_NO_PAUSE))

    @property
    def active(self) -> bool:
        """Whether a program is active; it still is in the pass after its end."""
        return self._phase in (_Phase.RUNNING, _Phase.ENDED)

    @property
    def running(self) -> bool:
        """Whether a program runs, whatever ProgStatus is: the map can change it."""
        return self._phase is _Phase.RUNNING

    @property
    def busy(self) -> bool:
        """Whether a program is active, or one without a file was to start in this pass."""
        return self.active or self._clock.now_ms == self._missed_ms

    @property
    def state(self) -> int:
        """State of the interpreter, see `InterpreterState`."""
        if self._phase is _Phase.RUNNING:
            return self._state
        if self._phase is _Phase.ENDED or self._clock.now_ms == self._missed_ms:
            return InterpreterState.STOPPING
        return InterpreterState.IDLE if self._phase is _Phase.IDLE else InterpreterState.ENDED

    @property
    def place(self) -> tuple[int, int]:
        """Number of the clump that is next, and its next word, counted from its beginning."""
        return self._machine.place if self._machine else NOWHERE

    def set_state(self, state: int) -> None:
        """Set the state of the interpreter while a program runs or is paused."""
        if InterpreterState.IDLE < self.state < InterpreterState.STOPPING and self._machine:
            if self._state == InterpreterState.PAUSED:
                self._machine.now_ms = self._clock.now_ms
            self._state = state
            self.enable_pause()
            self.wake()

    def enable_pause(self) -> None:
        """Set the last byte of `pause`, as the firmware does when a state is set or a breakpoint is stored."""
        self.pause = self.pause[:-1] + b"\1"

    @property
    def tick(self) -> int:
        """Milliseconds since power-on, 32 bits; see `ProgramTick`."""
        return self._tick.read()

    @tick.setter
    def tick(self, tick: int) -> None:
        if self._tick.write(tick):
            if self._tick.in_program and self._machine:
                self._machine.lag = self._tick.clump_lag
            self.wake()

    @property
    def pool(self) -> bytes:
        """The memory pool; it keeps its content after a program."""
        self._show_clumps()
        return bytes(self._pool[:POOL_SIZE])

    @pool.setter
    def pool(self, content: bytes) -> None:
        self._pool[:POOL_SIZE] = content

    def start(self, name: bytes) -> None:
        """Start a program in the next pass; after the end of its name the old one stays in the field."""
        text = name.split(b"\0")[0] + b"\0"
        self.file_name, self.activate = (text + self.file_name[len(text) :])[:NAME_SIZE], 1
        self.wake()

    def stop(self) -> None:
        """Stop the program in the next pass; without a program, the next one."""
        self.deactivate = 1
        self.wake()

    def reset(self) -> None:
        """Forget how the last program ended, and reset inputs and outputs, in the next pass."""
        if self.status != ProgramStatus.IDLE:
            self.status = int(ProgramStatus.RESET)
            self.wake()

    def wake(self) -> None:
        """Check the flags in this module's next turn."""
        self.due_ms = self._clock.now_ms

    def set_times(self, sync_time: int) -> None:
        """Store the given time and the brick's, which unlike the Tick of the map is never behind."""
        self.sync_time, self.sync_tick = sync_time, self._clock.now_ms & 0xFFFF_FFFF

    def run(self, now_ms: int) -> None:
        """Start, run, stop or remove a program."""
        self.due_ms = NEVER
        if self._phase is _IN_PROGRAM:
            if self._state == _RUNNING and not self.deactivate:
                self._execute(now_ms)
            else:
                self._advance(now_ms)
        elif self._phase is _Phase.ENDED:
            self._clear_away()
        elif self._phase is _Phase.WAITING:
            if now_ms == self._missed_ms + 1:
                self.due_ms = now_ms + 1
            elif self.status == ProgramStatus.RESET:
                self._phase, self.status = _Phase.IDLE, int(ProgramStatus.IDLE)
                self._reset_devices()
                self.due_ms = now_ms + 1 if self.activate else NEVER
        elif self.activate == 1:
            self.activate = 0
            self._activate(now_ms)
        self._tick.end_pass()

    def run_ahead(self, now_ms: int, until_ms: int) -> int:
        """Run the passes after the present one in which the program only calculates; return the last one.

        Args:
            now_ms: The present pass, in which the program ran.
            until_ms: The last pass before one in which something else happens.
        """
        machine = self._machine
        if machine is None or until_ms <= now_ms or self.due_ms != now_ms + 1 or self._tick.lag or self.deactivate:
            return now_ms
        last_ms = machine.run_ahead(until_ms)
        self.due_ms = last_ms + 1
        return last_ms

    def _advance(self, now_ms: int) -> None:
        match self._state:
            case InterpreterState.RUNNING | InterpreterState.STEP if self.deactivate == 1:
                self.deactivate = 0
                self._tick.abort()
                self._end(ProgramStatus.ABORTED)
            case InterpreterState.RUNNING:
                self._execute(now_ms)
            case InterpreterState.STEP if self._execute(now_ms, step=True):
                self._state, self.due_ms = InterpreterState.PAUSED, NEVER
            case InterpreterState.STOPPING:
                self._end(ProgramStatus.ABORTED)
                self._clear_away()
            case InterpreterState.IDLE if self.activate:
                self.activate = 0
                self._activate(now_ms)
            case unknown if unknown > InterpreterState.ENDED:
                self._tick.lag = 1

    def _activate(self, now_ms: int) -> None:
        """Load the program into a fresh pool; it runs from the next pass on. Without its file the pool stays."""
        self.program_name = unpack_name(self.file_name)
        status, handle, file = self._loader.open_block(self.program_name)
        opened = None if status else file
        self._handle = handle if opened else None
        if opened:
            self._pool = fresh_pool(self.after_pool)
        try:
            program = parse(opened.block if opened else b"", self._layout.types, opened.start if opened else 0)
            self._records = ClumpRecords(self._pool, self._layout, self._dialect.records, program)
            memory = Memory(program, self._layout, self._pool)
            self.offsets.load(memory)
            memory.fill()
        except (BadProgram, OutOfMemory) as error:
            self._refuse(error.fault if isinstance(error, BadProgram) else Fault.OUT_OF_MEMORY)
            if self._handle is None:
                self._phase, self._missed_ms = _Phase.WAITING, now_ms
            return
        self.mailboxes = Mailboxes(memory)
        calibrations = Calibrations(memory)
        self._machine = Machine(program, memory, self._equip(self.mailboxes, calibrations), OPCODES, self._dialect)
        self.offsets.start()
        self._phase, self.status, self._state = _Phase.RUNNING, int(ProgramStatus.RUNNING), InterpreterState.RUNNING
        self.pause = _NO_PAUSE
        if self._dialect.searches_calibrations and (file := self._loader.list_all(_CALIBRATIONS)):
            with suppress(OutOfMemory):
                name = file.name.split(".")[0].encode("latin-1")
                calibrations.load(name, file.content)
        self._reset_devices()
        self.due_ms = now_ms + 1

    def _read_code(self) -> None:
        """Give a running program the code that is in the flash now: the firmware reads it from there."""
        if self._machine:
            program = self._machine.program
            content = self._loader.flash.memory.read(program.address, len(program.content))
            if content != program.content:
                self._machine.change_code(content)
                self.wake()

    def records_with(self, clump: int) -> ClumpRecords | None:
        """Return the records of the program's clumps, which hold breakpoints, if the clump exists."""
        return self._records if self._machine and clump < len(self._machine.tasks) else None

    def _show_clumps(self) -> None:
        """Write the places of the program's clumps into the pool."""
        if self._machine and self._records:
            self._records.show(self._machine.tasks)

    def _refuse(self, fault: Fault) -> None:
        self._end(fault if self._dialect.shows_faults else ProgramStatus.ERROR)

    def _execute(self, now_ms: int, *, step: bool = False) -> bool:
        """Run one pass of the program, or one instruction; return whether it continues."""
        machine = self._machine
        if machine is None:
            return False
        if self._tick.lag:
            machine.lag = self._tick.clump_lag
        self._tick.in_program = True
        outcome = machine.run(now_ms, step=step)
        self._tick.in_program = False
        if self._tick.lag:
            if outcome is None and (machine.runs or machine.full) and not step:
                self._tick.catch_up()
            machine.lag = self._tick.lag
        if outcome is None:
            self.calculates = machine.calculates
            self.due_ms = now_ms + 1 if self.deactivate == 1 else machine.due_ms  # the program itself can set the flag
            return True
        numbered = outcome is Outcome.ERROR and self._dialect.shows_faults
        self._end(machine.error & 0xFF if numbered else ProgramStatus(outcome))
        return False

    def _end(self, status: int) -> None:
        self.status, self._phase = int(status), _Phase.ENDED
        self._on_end()
        self.wake()

    def _clear_away(self) -> None:
        """Close the files and drop the memory; a request to start or stop waits for the next pass.

        Inputs and outputs are reset now only if the program was stopped, else when its end is no longer shown.
        """
        if self.status == ProgramStatus.ABORTED:
            self._reset_devices()
        if self._handle is not None:
            self._loader.close(self._handle)  # a file that the program has opened by the same number, too
        if self._machine is not None:
            self._machine.close_files()
        self._show_clumps()
        if self._machine is not None:
            self._machine.forget_calls()
        self._handle = self._machine = self.mailboxes = None
        self.offsets.end()
        self._phase = _Phase.WAITING
        if self.activate or self.status == ProgramStatus.RESET:
            self.wake()
