"""How the user interface runs a file: a program or a sound, and the message about its end.

Source: docs/firmware.md section 8.
"""

from __future__ import annotations

from firmware_protocol.iomap import ProgramStatus, UiFlag
from sim_backend.firmware.files.names import extension, pack_name, unpack_name
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import states, times
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu import Menu
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import Marks
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import Programs, Run, UiState

_BEFORE_LOG = 3
"""Passes that a log counts before those since state 14 began."""


class FileRunner:
    """Opens, runs and ends a file that a telegram, the map or the menu has requested.

    Attributes:
        paused: Whether a state that was written has interrupted state RUNNING, which can continue.
        count: The passes after which a state 3 continues; None stands for those of the message that is shown.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        menu: Menu,
        screen: ScreenRefresh,
        sound: SoundModule,
        programs: Programs,
        io_control: IoControl,
        sleep_timer: SleepTimer,
        *,
        data_log: bool,
    ) -> None:
        self._clock, self._registers, self._keys, self._menu, self._screen = clock, registers, keys, menu, screen
        self._sound, self._programs, self._io_control, self._sleep_timer = sound, programs, io_control, sleep_timer
        self._known = (*states.KNOWN, states.LOG if data_log else states.OLD_LOG)
        self._file, self._run, self._has_page = registers.program_name, Run.TONE, False
        self._begun_ms = self._opened_ms = self._message_ends_ms = self._log_count = self._odd = 0
        self._hidden_ms: int | None = None
        self.count: int | None = times.MELODY_PASSES
        self._steps, self._parts, self.paused = b"", list[Marks](), False

    @property
    def shows_program(self) -> bool:
        """Whether the picture of a program that runs is below the status bar."""
        runs = self._registers.state == UiState.RUNNING and self._run is Run.PROGRAM
        return runs and self._clock.now_ms > self._opened_ms

    @property
    def shows_message(self) -> bool:
        """Whether the end of a file is shown."""
        return self._registers.runs_file and self._run is Run.MESSAGE

    @property
    def has_begun(self) -> bool:
        """Whether a file has the screen, and not only since this pass."""
        return (self._registers.runs_file or self.paused) and self._run is not Run.BEGUN

    @property
    def melody_ms(self) -> int:
        """How long a state 3 written now lasts: it continues the count of what was shown last."""
        return max(times.MELODY_PASSES - self._passes, 0)

    @property
    def _passes(self) -> int:
        """The count of the message that is shown, or as the last one has left it."""
        return self.count if self.count is not None else self._message_count

    @property
    def _message_count(self) -> int:
        return times.MESSAGE_PASSES - 2 * (self._message_ends_ms - self._clock.now_ms) + self._odd

    def program_ended(self) -> None:
        """Show the end of a program from the next pass on."""
        if self._registers.runs_file and self._run is Run.PROGRAM:
            self._run, self._registers.next_step_ms = Run.ENDED, self._clock.now_ms + 1

    def check_program(self) -> None:
        """Check in this module's next turn whether the program still runs: its status may have been written."""
        if self._registers.runs_file and self._run is Run.PROGRAM:
            self._registers.next_step_ms = self._clock.now_ms

    def choose(self, name: bytes, *, opened: bool = True) -> None:
        """Set the next file to run; its page follows only if the user interface has `opened` it."""
        self._file, self._run, self._has_page, self._begun_ms = name, Run.TONE, opened, self._clock.now_ms
        self.count = times.MELODY_PASSES

    def begin(self) -> None:
        """Accept a request; one in the next pass can still replace the file."""
        registers, now_ms = self._registers, self._clock.now_ms
        if self.shows_message:
            self.count = self._message_count - 1  # this pass does not count
        elif registers.runs_file:
            self.count = self._passes + now_ms - self._begun_ms
        registers.set(UiFlag.BUSY)
        registers.state, registers.from_menu = int(UiState.OPENING), False
        registers.next_step_ms, self._has_page = now_ms + 1, True
        self._io_control.stays_on = False
        self._menu.interrupt()
        self._sleep_timer.restart(now_ms)

    def enter(self) -> None:
        """Give the screen to the requested file."""
        registers = self._registers
        registers.state, registers.next_step_ms = int(UiState.RUNNING), self._clock.now_ms + 1
        self._screen.mark(marks.OPENING)
        self._file, self._run, self._begun_ms = registers.program_name, Run.BEGUN, self._clock.now_ms
        self._menu.show_file(unpack_name(self._file))

    def begin_from_menu(self, name: str) -> None:
        """Run a file from its page; the state stays as it is."""
        registers = self._registers
        registers.set(UiFlag.BUSY)
        registers.from_menu, registers.next_step_ms = True, self._clock.now_ms + 1
        self.choose(pack_name(name))

    def begin_page(self) -> None:
        """Begin to draw the page of the file; neither the page, beyond the name, nor the file continues."""
        self._run, self._parts = Run.PAGE, [marks.PAGE]
        self._registers.from_menu, self._registers.next_step_ms = True, self._clock.now_ms

    def go_on(self) -> None:
        """Continue with a file: open it, wait for its end, show a message, go back to the menu."""
        registers, now_ms = self._registers, self._clock.now_ms
        match self._run:
            case Run.BEGUN:
                registers.set(UiFlag.BUSY)
                self._run, registers.next_step_ms = Run.TONE, now_ms + 1
            case Run.TONE if self._sound.state:
                registers.next_step_ms = now_ms + 1
            case Run.TONE:
                self._run, registers.next_step_ms = Run.DRAWING, now_ms + 1
                self._show_beginning()
            case Run.DRAWING if self._screen.drawing:
                registers.next_step_ms = now_ms + 1
            case Run.DRAWING if extension(self._file) in self._known:
                self._run, registers.next_step_ms = Run.TO_OPEN, now_ms + 1
            case Run.DRAWING:  # an unknown file leaves the user interface busy forever, as on a real brick
                self._lose_request()
                self.show_menu()
            case Run.TO_OPEN if self._waits_to_open:
                registers.next_step_ms = now_ms + 1
            case Run.TO_OPEN:
                self._open(now_ms)
            case Run.PROGRAM if self._programs.status == ProgramStatus.RUNNING:
                registers.next_step_ms = now_ms + times.PLAYING_MS - self._show_running(now_ms)
            case Run.SOUND if self._keys.read() == Key.EXIT:
                self._sound.cancel()
                self._run, registers.next_step_ms = Run.ENDED, now_ms + 1
            case Run.SOUND if self._sound.state:
                registers.next_step_ms = now_ms + 1
                self._show_running(now_ms)
            case Run.STEPS:
                self._draw_steps()
                self._run, registers.next_step_ms = Run.STEPS if self._parts else Run.ENDED, now_ms + 1
            case Run.PROGRAM | Run.SOUND:
                self._run, registers.next_step_ms = Run.ENDED, now_ms + 1
            case Run.MESSAGE if now_ms < self._message_ends_ms:
                registers.next_step_ms = self._message_ends_ms
            case Run.MESSAGE:
                self._open_menu()
            case Run.PAGE:
                self._draw_page()
                registers.next_step_ms = now_ms + 1
            case Run.LOG:
                self._begin_message(now_ms)
                if now_ms >= self._message_ends_ms:
                    self._open_menu()
            case _:
                self._screen.mark(marks.MESSAGE)
                self._begin_message(now_ms)

    def follow_status(self, now_ms: int) -> None:
        """Exclude passes without the status bar from the time of the file's picture."""
        if not self._registers.flags & UiFlag.ENABLE_STATUS:
            self._hidden_ms = now_ms if self._hidden_ms is None else self._hidden_ms
        elif self._hidden_ms is not None:
            self._opened_ms += max(now_ms - max(self._hidden_ms, self._opened_ms), 0)
            self._hidden_ms = None
            if self._registers.runs_file and self._run is Run.PROGRAM:
                self._registers.next_step_ms = now_ms

    def delay(self, passed_ms: int) -> None:
        """Exclude an interruption from the file's time: for its pictures, and the message about its end."""
        self._opened_ms += passed_ms
        self._message_ends_ms += passed_ms
        if self._hidden_ms is not None:
            self._hidden_ms += passed_ms
        if self._registers.runs_file and self._run is Run.PROGRAM:  # it may have ended
            self._registers.next_step_ms = self._clock.now_ms + 1

    def takes_button(self) -> bool:
        """Return whether a button ends the message about a file's end, which reads none in its last pass.

        That of a data log, which shows nothing, reads one also in the pass in which it begins.
        """
        if self._registers.runs_file and self._run is Run.LOG:
            unread = bool(self._keys.read_silently())
            if unread:
                self._begin_message(self._clock.now_ms)
            return unread
        unread = self.shows_message and self._clock.now_ms < self._message_ends_ms
        return unread and self._keys.read_button() is not None

    def end_message(self) -> None:
        """End the message about the end of a file in this pass, by a key."""
        self._keys.click()
        self.count = self._message_count
        self._registers.next_step_ms = self._message_ends_ms = self._clock.now_ms

    def show_menu(self) -> None:
        """Show the page of the file, with the brick on: again where it was started there, else by drawing the menus.

        A file that no request has begun, but a written state, has no page: the menus continue where they are.
        """
        registers = self._registers
        registers.off_ms, registers.next_step_ms = NEVER, self._clock.now_ms + 1
        if registers.from_menu:
            registers.from_menu = False
            self._menu.show_page()
            return
        registers.state = int(UiState.MENU)
        if not self._has_page:
            self._menu.go_on_from(registers.state)
            return
        self._has_page = False
        self._menu.redraw()

    @property
    def _waits_to_open(self) -> bool:
        """Whether a program waits: the screen is not erased, or enter, which may have started it, still acts."""
        waits = self._keys.enter_acts or bool(self._screen.erase_mask)
        return waits and extension(self._file) in states.PROGRAMS

    def _open(self, now_ms: int) -> None:
        """Start a file by its extension."""
        kind, self._registers.next_step_ms = extension(self._file), now_ms + 1
        if kind in states.PROGRAMS:
            if self._programs.status == ProgramStatus.IDLE:
                self._run, self._opened_ms = Run.PROGRAM, now_ms
                self._programs.start(self._file)
        elif kind == states.SOUND:
            self._run, self._opened_ms = Run.SOUND, now_ms
            self._sound.play_own(self._file[: self._file.index(0) + 1], self._registers.volume)
        elif kind == states.ON_BRICK:
            self._steps, self._run = self._menu.program.open(unpack_name(self._file)), Run.ENDED
            if self._steps:
                self._screen.mark(marks.OPENS_STEPS)
                self._parts, self._run = [*self._menu.program.drawn_file], Run.STEPS
        else:
            self._run, key = Run.LOG, self._keys.read_silently()
            self._log_count = self._passes + now_ms - self._begun_ms + _BEFORE_LOG
            if key:
                self._keys.click()
            if key or self._log_count > times.MESSAGE_PASSES + 1:  # this pass has counted once
                self._begin_message(now_ms)
                self.count = self._log_count - 2
                self._open_menu()

    def _draw_page(self) -> None:
        """Draw the page of the file that has the screen, with the status bar, and only its name from then on."""
        if self._parts:
            self._registers.set(UiFlag.ENABLE_STATUS)
        self._screen.mark(self._parts.pop() if self._parts else marks.FILE_NAME)

    def _draw_steps(self) -> None:
        """Draw the next part of a program made on the brick, for which a file is missing."""
        program = self._menu.program
        drawn = len(program.drawn_file) - len(self._parts)
        if drawn in program.holds and program.holds[drawn]():
            return
        program.icons = self._steps
        self._screen.mark(self._parts.pop(0))
        if drawn in program.actions:
            program.actions[drawn]()

    def _show_beginning(self) -> None:
        """Draw the picture of a file that is about to be opened."""
        if self._registers.from_menu:
            self._screen.mark(marks.OPENING)
        self._screen.mark(marks.RUNNING)

    def _show_running(self, now_ms: int) -> int:
        """Change the picture of a running file from time to time; return the passes since the change was planned."""
        passed_ms = (now_ms - self._opened_ms) % times.PLAYING_MS
        if not passed_ms and self._registers.flags & UiFlag.ENABLE_STATUS:
            self._screen.mark(marks.PLAYING)
        return passed_ms

    def _begin_message(self, now_ms: int) -> None:
        registers = self._registers
        count = self._log_count
        if self._run is not Run.LOG:
            count = 0
            registers.set(UiFlag.ENABLE_STATUS | UiFlag.UPDATE)
        self._run, self.count, registers.next_step_ms = Run.MESSAGE, None, now_ms + 1
        self._message_ends_ms, self._odd = now_ms + (times.MESSAGE_PASSES + 1 - count) // 2, count % 2

    def _open_menu(self) -> None:
        """Accept buttons and requests again; a request made meanwhile is lost."""
        registers = self._registers
        registers.clear(UiFlag.BUSY)
        self._programs.reset()
        self._screen.mark(marks.CLOSING)
        if registers.from_menu and registers.flags & UiFlag.EXECUTE_FILE:
            self.begin()
        else:
            self._lose_request()
            self.show_menu()

    def _lose_request(self) -> None:
        if not self._registers.from_menu:
            self._registers.clear(UiFlag.EXECUTE_FILE)
