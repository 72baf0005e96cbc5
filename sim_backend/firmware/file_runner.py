"""How the user interface runs a file: a program or a sound, and the message about its end.

Source: docs/firmware.md section 8.
"""

from __future__ import annotations

from firmware_protocol.iomap import ProgramStatus, UiFlag
from sim_backend.firmware import screen_marks as marks
from sim_backend.firmware import ui_states as states
from sim_backend.firmware import ui_times as times
from sim_backend.firmware.boot import Boot
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.keys import ENTER, Key
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.names import NAME_SIZE, extension, pack_name, unpack_name
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import CLICK, MAX_VOLUME, SoundModule
from sim_backend.firmware.ui_states import Run, UiState


class FileRunner(Boot):
    """Opens, runs and ends a file that a telegram, the map or the menu has requested.

    Attributes:
        due_ms: See `Module`.
        program_name: The file to start, 20 bytes.
        button: A button pressed through the map, 0 for none.
        volume: Volume of the menu, which SetProperty changes along with the sound module's.
    """

    def __init__(self, clock: Clock, io_control: IoControl, screen: ScreenRefresh, sound: SoundModule) -> None:
        super().__init__(clock, io_control, screen)
        self._sound, self.volume, self.button = sound, MAX_VOLUME, 0
        self.program_name = self._file = bytes(NAME_SIZE)
        self._run = Run.TONE
        self._opened_ms = self._message_ends_ms = 0
        self.due_ms, self._event_ms = 0, NEVER

    def wake(self) -> None:
        """Run in this module's next turn."""
        self.due_ms = self._event_ms = self._clock.now_ms

    def wake_later(self) -> None:
        """Run in the next pass."""
        self.due_ms = self._event_ms = min(self.due_ms, self._clock.now_ms + 1)

    @property
    def runs_file(self) -> bool:
        """Whether a file has the screen: a program, a sound, or the message about its end."""
        return self.state == UiState.RUNNING or self._from_menu

    @property
    def shows_program(self) -> bool:
        """Whether the picture of a program that runs is below the status bar."""
        runs = self.state == UiState.RUNNING and self._run is Run.PROGRAM
        return runs and self._clock.now_ms > self._opened_ms

    @property
    def _runs_program(self) -> bool:
        return self.runs_file and self._run is Run.PROGRAM

    @property
    def _opens_program(self) -> bool:
        return extension(self._file) in states.PROGRAMS

    @property
    def _shows_message(self) -> bool:
        """Whether the end of a file is shown."""
        return self.runs_file and self._run is Run.MESSAGE

    def program_ended(self) -> None:
        """Show the end of a program from the next pass on."""
        if self._runs_program:
            self._run, self._next_step_ms = Run.ENDED, self._clock.now_ms + 1
            self.wake_later()

    def _begin(self, now_ms: int) -> None:
        """Accept a request; one in the next pass can still replace the file."""
        self.flags |= int(UiFlag.BUSY)
        self.state = int(UiState.OPENING)
        self._io_control.stays_on = False
        self._menu.interrupt()
        self.sleep_timer.restart(now_ms)
        self._next_step_ms = now_ms + 1

    def _run_from_menu(self) -> None:
        """Run a file from its page; the state stays as it is."""
        self.flags |= int(UiFlag.BUSY)
        self._from_menu, self._run = True, Run.TONE
        self._file, self._next_step_ms = pack_name(self._menu.runs), self._clock.now_ms + 1

    def _continue(self, now_ms: int) -> None:
        """Continue with a file: open it, wait for its end, show a message, go back to the menu."""
        match self._run:
            case Run.TONE if self._sound.state:
                self._next_step_ms = now_ms + 1
            case Run.TONE:
                self.flags |= int(UiFlag.BUSY)
                self._run, self._next_step_ms = Run.DRAWING, now_ms + 1
                if self._from_menu:
                    self._screen.mark(marks.OPENING)
                self._mark_framed(marks.RUNNING)
            case Run.DRAWING if self._screen.drawing:
                self._next_step_ms = now_ms + 1
            case Run.DRAWING if extension(self._file) in states.KNOWN:
                self._run, self._next_step_ms = Run.TO_OPEN, now_ms + 1
            case Run.DRAWING:  # an unknown file leaves the user interface busy forever, as on a real brick
                self._lose_request()
                self._show_menu()
            case Run.TO_OPEN if self._opens_program and (self.buttons[ENTER].state or self._screen.erase_mask):
                self._next_step_ms = now_ms + 1
            case Run.TO_OPEN:
                self._open(now_ms)
            case Run.PROGRAM if self.programs.active:
                if now_ms == self._opened_ms + 1:
                    self.flags |= states.RUNNING_FLAGS
                self._next_step_ms = now_ms + times.PLAYING_MS - self._show_running(now_ms)
            case Run.SOUND if self._sound.playing:
                self._next_step_ms = now_ms + 1
                self._show_running(now_ms)
                if self._key(now_ms) == Key.EXIT:
                    self._sound.break_off()
                    self._run = Run.ENDED
            case Run.SOUND:
                self._run, self._next_step_ms = Run.ENDED, now_ms + 1
            case Run.MESSAGE if now_ms < self._message_ends_ms:
                self._next_step_ms = self._message_ends_ms
            case Run.MESSAGE:
                self._open_menu()
            case _:
                self.flags = self.flags & ~states.RUNNING_FLAGS | int(UiFlag.ENABLE_STATUS)
                self._run = Run.MESSAGE
                self._screen.mark(marks.MESSAGE)
                self.flags |= int(UiFlag.UPDATE)
                self._next_step_ms, self._message_ends_ms = now_ms + 1, now_ms + times.MESSAGE_MS

    def _open(self, now_ms: int) -> None:
        """Start a file by its extension."""
        kind, self._next_step_ms = extension(self._file), now_ms + 1
        if kind in states.PROGRAMS:
            if self.programs.status == ProgramStatus.IDLE:
                self._run, self._opened_ms = Run.PROGRAM, now_ms
                self.programs.start(self._file)
        elif kind == states.SOUND:
            self._run, self._opened_ms = Run.SOUND, now_ms
            self._sound.play_own(self._file[: self._file.index(0) + 1])
        else:
            self._run = Run.ENDED

    def _show_running(self, now_ms: int) -> int:
        """Change the picture of a running file from time to time; return the passes since the change was planned."""
        passed_ms = (now_ms - self._opened_ms) % times.PLAYING_MS
        if not passed_ms and self.flags & UiFlag.ENABLE_STATUS:
            self._screen.mark(marks.PLAYING)
        return passed_ms

    def _open_menu(self) -> None:
        """Accept buttons and requests again; a request made meanwhile is lost."""
        self.flags &= ~int(UiFlag.BUSY)
        self.programs.reset()
        self._screen.mark(marks.CLOSING)
        if self._from_menu and self.flags & UiFlag.EXECUTE_FILE:
            self._from_menu = False
            self._begin(self._clock.now_ms)
        else:
            self._lose_request()
            self._show_menu()

    def _lose_request(self) -> None:
        if not self._from_menu:
            self.flags &= ~int(UiFlag.EXECUTE_FILE)

    def _show_menu(self) -> None:
        """Show the page of the file: again where it was started there, else by drawing the menus."""
        now_ms, self._off_ms = self._clock.now_ms, NEVER
        self._next_step_ms = now_ms + 1
        if self._from_menu:
            self._from_menu = False
            self._menu.show_page()
            return
        self.state = int(UiState.MENU)
        self._menu.show_file(unpack_name(self._file))
        self._menu.redraw()

    def _key(self, now_ms: int) -> int:
        """Return the key that counts: a button, or the map's while none that is enabled is held; it clicks."""
        key: int | None = self._keys.read(self.buttons, now_ms)
        held = self._keys.held(self.buttons)
        if held is None or self._disabled(held):
            key, self.button = self.button, 0
        if not key:
            return 0
        self._sound.play_own(CLICK, self.volume)
        self.sleep_timer.restart(now_ms)
        return key
