"""How the user interface runs a file: a program or a sound, and the message about its end.

Source: docs/firmware.md section 8.
"""

from __future__ import annotations

from firmware_protocol.iomap import ProgramStatus, UiFlag
from sim_backend.firmware.files.names import extension, pack_name, unpack_name
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import states, times
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu import Menu
from sim_backend.firmware.ui.page import CurrentPage, Page
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import Marks
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import Programs, Step, UiState


class FileRunner:
    """Opens, runs and ends a file that a telegram, the map or the menu has requested.

    The states OPENING and RUNNING, and the page of a file that was run from the menus.

    Attributes:
        page: That page.
        playing: Count of the passes that have shown the picture of the running file.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        menu: Menu,
        current: CurrentPage,
        screen: ScreenRefresh,
        sound: SoundModule,
        programs: Programs,
        io_control: IoControl,
        sleep_timer: SleepTimer,
        *,
        data_log: bool,
    ) -> None:
        self._clock, self._registers, self._keys = clock, registers, keys
        self._menu, self._current = menu, current
        self._screen, self._sound, self._programs = screen, sound, programs
        self._io_control, self._sleep_timer = io_control, sleep_timer
        self._known = (*states.KNOWN, states.LOG if data_log else states.OLD_LOG)
        self._file, self._steps, self._parts = registers.program_name, b"", list[Marks]()
        self.page, self.playing = Page(self._begin_page, self.run, stays=True), PassCounter(clock)
        menu.run_page = self.page

    @property
    def _from_menu(self) -> bool:
        """Whether it was run from its page; the state is still that of the page."""
        return self._registers.state == UiState.DRAWING and self._current.shows(self.page)

    @property
    def shows_program(self) -> bool:
        """Whether the picture of a program that runs is below the status bar."""
        registers = self._registers
        return registers.state == UiState.RUNNING and registers.step == Step.PROGRAM and self.playing.value > 0

    def accept(self) -> None:
        """Accept a request, if there is one; another one in the next pass can still replace the file."""
        registers = self._registers
        if not registers.requested:
            return
        registers.set(UiFlag.BUSY)
        registers.go_to(UiState.OPENING)
        self._io_control.stays_on = False
        self._current.interrupt()
        self._sleep_timer.restart(self._clock.now_ms)

    def open(self) -> None:
        """Give the screen to the requested file."""
        registers = self._registers
        self._screen.mark(marks.OPENING)
        self._file = registers.program_name
        self._menu.show_file(unpack_name(self._file))
        registers.step, registers.picture, registers.may_switch_off = Step.BEGUN, 1, False
        registers.go_to(UiState.RUNNING)

    def _begin_page(self) -> None:
        """Run a file from its page."""
        self._registers.set(UiFlag.BUSY)
        self._registers.wake_in(1)
        self._registers.may_switch_off = False
        self._file, self._registers.step = pack_name(self._menu.files.chosen), Step.TONE

    def run(self) -> None:
        """Continue with a file: open it, wait for its end, show a message, go back to the menu."""
        registers, screen = self._registers, self._screen
        registers.timer.count()
        match registers.step:
            case Step.PROGRAM if self._programs.status == ProgramStatus.RUNNING:
                registers.wake_in(self._show_playing())
                return
            case Step.MESSAGE:
                self._go_on_with_message()
                return
            case Step.BEGUN:
                registers.set(UiFlag.BUSY)
                if unpack_name(self._file) != self._menu.files.chosen:  # no request has begun it
                    self._file = pack_name(self._menu.files.chosen)
                registers.step = Step.TONE
            case Step.TONE if not self._sound.state:
                if self._from_menu:
                    screen.mark(marks.OPENING)
                screen.mark(marks.RUNNING)
                registers.step = Step.DRAWING
            case Step.DRAWING if screen.drawing:
                pass
            case Step.DRAWING if extension(self._file) in self._known:
                registers.step = Step.TO_OPEN
            case Step.DRAWING:  # an unknown file leaves the user interface busy forever, as on a real brick
                self._show_menu()
            case Step.TO_OPEN if not self._waits_to_open:
                self._open()
            case Step.SOUND if self._keys.read() == Key.EXIT:
                self._sound.cancel()
                registers.step = Step.ENDED
            case Step.SOUND if self._sound.state:
                self._show_playing()
            case Step.STEPS:
                self._draw_steps()
            case Step.PROGRAM | Step.SOUND:
                registers.step = Step.ENDED
            case Step.ENDED:
                screen.mark(marks.MESSAGE)
                registers.set(UiFlag.ENABLE_STATUS | UiFlag.UPDATE)
                registers.step, registers.timer.value = Step.MESSAGE, 0
        registers.wake_in(1)

    @property
    def _waits_to_open(self) -> bool:
        """Whether a program waits: the screen is not erased, or enter, which may have started it, still acts."""
        waits = self._keys.enter_acts or bool(self._screen.erase_mask)
        return waits and extension(self._file) in states.PROGRAMS

    def _open(self) -> None:
        """Start a file by its extension."""
        registers, kind = self._registers, extension(self._file)
        self.playing.value = 0
        if kind in states.PROGRAMS:
            if self._programs.status == ProgramStatus.IDLE:
                registers.step = Step.PROGRAM
                self._programs.start(self._file)
        elif kind == states.SOUND:
            registers.step = Step.SOUND
            self._sound.play_own(self._file[: self._file.index(0) + 1], registers.volume)
        elif kind == states.ON_BRICK:
            self._steps = self._menu.program.open(unpack_name(self._file))
            registers.step = Step.STEPS if self._steps else Step.ENDED
            if self._steps:
                self._screen.mark(marks.OPENS_STEPS)
                self._parts = [*self._menu.program.drawn_file]
        else:  # the message about a log shows nothing, and continues the count
            registers.step = Step.MESSAGE
            self._go_on_with_message()

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
        if not self._parts:
            self._registers.step = Step.ENDED

    def _show_playing(self) -> int:
        """Change the picture of a running file from time to time; return the passes until the next change."""
        if not self._registers.flags & UiFlag.ENABLE_STATUS:
            return times.PLAYING_PASSES
        passed = self.playing.count() % times.PLAYING_PASSES
        if not passed:
            self._screen.mark(marks.PLAYING)
        return times.PLAYING_PASSES - passed

    def _go_on_with_message(self) -> None:
        """End the message when its time is over, or by a key; then accept requests again."""
        registers = self._registers
        left = times.MESSAGE_PASSES - registers.timer.count()
        if left > 0 and not self._keys.read():
            registers.wake_in((left + 1) // 2)  # each pass counts twice
            return
        registers.clear(UiFlag.BUSY)
        registers.may_switch_off = True
        self._programs.reset()
        self._screen.mark(marks.CLOSING)
        self._show_menu()

    def _show_menu(self) -> None:
        """Show the page of the file: again where it was started there, else by drawing the menus.

        A request made meanwhile is lost, but not where it was started there.
        """
        registers = self._registers
        registers.step = Step.BEGUN
        registers.wake_in(1)
        if self._from_menu:
            self._menu.show_page()
        else:
            registers.clear(UiFlag.EXECUTE_FILE)
            registers.go_to(UiState.MENU)
