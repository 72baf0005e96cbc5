"""The user interface module as far as telegrams see it: battery, sleep timer, starting of programs, busy state.

Source: docs/firmware.md section 1, 5.2 (Ui map) and section 8.
"""

from __future__ import annotations

from collections.abc import Sequence

from firmware_protocol.iomap import ProgramStatus, UiFlag
from sim_backend.firmware import screen_marks as marks
from sim_backend.firmware import ui_states as states
from sim_backend.firmware import ui_times as times
from sim_backend.firmware.button import Button, ButtonState
from sim_backend.firmware.file_runner import FileRunner
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.keys import ENTER, EXIT, KEYS, Key, Keys
from sim_backend.firmware.loader import Loader
from sim_backend.firmware.menu import Menu
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.names import pack_name
from sim_backend.firmware.program_steps import ProgramSteps
from sim_backend.firmware.radio_answers import RadioState
from sim_backend.firmware.screen_marks import Marks
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sensor_view import SensorView
from sim_backend.firmware.sound import ATTENTION, CLICK, SoundModule
from sim_backend.firmware.stored_settings import StoredSettings
from sim_backend.firmware.ui_states import Run, UiState
from sim_backend.firmware.versions import Version

_EXIT_MASK, _ENTER_MASK = 1 << EXIT, 1 << ENTER


class UiModule(FileRunner):
    """Battery supervision, sleep timer, and the starting of files.

    Attributes:
        buttons: The buttons; set by the brick.
        has_cable: Whether the USB cable is in.
    """

    def __init__(
        self,
        clock: Clock,
        io_control: IoControl,
        sound: SoundModule,
        screen: ScreenRefresh,
        loader: Loader,
        version: Version,
    ) -> None:
        super().__init__(clock, io_control, screen, sound)
        self._stored = StoredSettings(loader)
        self._on_restart = self._load_settings
        self._load_settings()
        sound.volume = self.volume
        self.error = self.pointer = 0
        self.run_state, self.has_cable = 1, True
        self._starting = self._answered = False
        self.buttons: Sequence[Button] = ()
        self._menu = Menu(self, self._stored, loader, screen, data_log=version.data_log)
        self._enter_keeps_program = version.enter_keeps_program
        self._keys = Keys()

    def _load_settings(self) -> None:
        self._stored.load()
        self.volume, self.sleep_timer.limit_minutes = self._stored.volume, self._stored.sleep_minutes

    @property
    def usb_state(self) -> int:
        """2 while the USB cable is in, else 0."""
        return 2 * self.has_cable

    @property
    def sensor_view(self) -> SensorView:
        """The value of a sensor or motor that is shown."""
        return self._menu.view

    @property
    def program_steps(self) -> ProgramSteps:
        """The program that is made on the brick."""
        return self._menu.program

    @property
    def map_state(self) -> int:
        """The state in the map; a written state takes effect in the same pass, but not while a file has the screen."""
        return self.state

    @map_state.setter
    def map_state(self, state: int) -> None:
        ran, before, self.state = self.runs_file, self.state, state
        if before == state or self._off_ms != NEVER:
            return
        if ran and state == UiState.DRAWING:
            self._from_menu = True
        elif ran and state == UiState.MENU:
            self._show_menu()
        elif state in states.MENU_STATES or (not ran and state in states.GONE_ON_FROM):
            self._continue_from(state)
        elif not ran and state == UiState.REPORT:
            self.begin_report()
        elif not ran and state == UiState.QUESTION:
            self._question.begin()
            self._next_step_ms = self._clock.now_ms
        elif ran:
            self._next_step_ms = NEVER

    def _continue_from(self, state: int) -> None:
        """Continue from a state that was written to the map."""
        self._next_step_ms, self._from_menu = self._clock.now_ms + 2 * (state == UiState.RUNNING), False
        self._starting, self._run, self._file = state == UiState.START, Run.TONE, self.program_name
        self.flags |= int(UiFlag.BUSY) if state == UiState.RUNNING else 0
        if state in states.MENU_STATES:
            self._menu.go_on_from(state)
        elif state == UiState.LOGO:
            self._next_step_ms = self._screen.next_pause(self._clock.now_ms + 2)

    def set_battery(self, raw: int) -> None:
        """Change the battery: a 10-bit converter value, plus `battery.RECHARGEABLE`."""
        self.battery.raw = raw
        self.due_ms = min(self.due_ms, self.battery.next_sample_ms(self._clock.now_ms))

    def stay_awake(self) -> None:
        """Restart the sleep timer."""
        self.sleep_timer.restart(self._clock.now_ms)
        self.wake_later()

    def set_sleep_minutes(self, minutes: int) -> None:
        """Change the time until power-off to the low 8 bits, 0 for never. The timer keeps running."""
        self.sleep_timer.limit_minutes = minutes & 0xFF
        self.wake()

    def execute(self, name: str) -> None:
        """Request the start of a file; the request is lost if the user interface is still busy."""
        self.program_name = pack_name(name)
        self.flags |= int(UiFlag.EXECUTE_FILE)
        self.wake()

    def press(self, buttons: int) -> None:
        """Handle a change of the buttons; those newly pressed are given as bits of the button module."""
        if buttons:
            self.sleep_timer.restart(self._clock.now_ms)
            kept = self._enter_keeps_program and buttons & _ENTER_MASK
            if buttons & _EXIT_MASK and not kept and self.programs.status == ProgramStatus.RUNNING:
                self.programs.stop()
                self.buttons[EXIT].state &= ~int(ButtonState.NEW_PRESS)
        if not self._in_menu and self._off_ms == NEVER:
            if not (self.runs_file or self.state == UiState.OPENING or self._asks):
                self._keys.read(self.buttons, self._clock.now_ms)
            for number, key in KEYS[::-1]:
                if buttons >> number & 1:
                    self._answered |= self.state == UiState.LOW_BATTERY and not self._disabled(key)
                    if self._clicks(key):
                        self._sound.play_own(CLICK, self.volume)
        self.wake()

    def _clicks(self, key: int) -> bool:
        """Return whether a press clicks at once: before a question is shown, and in the warning of a low battery."""
        clicks = self.state == UiState.LOW_BATTERY or (self.state == UiState.QUESTION and not self._asks)
        return clicks and not self._disabled(key)

    @property
    def _asks(self) -> bool:
        """Whether a question of the radio waits for an answer."""
        return self.state == UiState.QUESTION and self._question.waits

    def _follow_exit(self, now_ms: int) -> None:
        """Switch the brick off while exit's state says that it was held, but not in a start, nor once a file runs."""
        begins = self._run is Run.TONE and self._next_step_ms == now_ms + times.FADE_MS
        counts = not (self._starting or (self.runs_file and not begins) or self._off_ms != NEVER)
        if counts and self.buttons[EXIT].state & ButtonState.LONG_PRESS:
            self.force_off = 1

    def show_status(self, shown: bool) -> None:
        """Show the status bar and the firmware's own screen, or leave the screen to a program."""
        self.flags = self.flags & ~int(UiFlag.ENABLE_STATUS) | shown * int(UiFlag.ENABLE_STATUS)
        self.wake()

    def run(self, now_ms: int) -> None:
        """Run one pass: battery, keys, files, supply."""
        self.on_pass()
        self._follow_radio(now_ms - 1)
        if self.battery.since_sample_ms(now_ms) == 0:
            self.battery.sample()
            self.flags |= int(UiFlag.UPDATE)
        again = self.sleep_timer.follow_request(now_ms, resets=bool(self.flags & UiFlag.RESET_SLEEP_TIMER))
        self.flags = self.flags & ~int(UiFlag.RESET_SLEEP_TIMER) | again * int(UiFlag.RESET_SLEEP_TIMER)
        self.end_start()
        if self._in_menu or (self._off_ms != NEVER and not (self.runs_file or self._takes_keys)):
            self._read_keys(now_ms)
        elif self._ends_message(now_ms):
            self._sound.play_own(CLICK, self.volume)
            self.sleep_timer.restart(now_ms)
            self._next_step_ms = self._message_ends_ms = now_ms
        elif self._answers(now_ms):
            self._take_key()
        elif self._takes_keys and self.button and not self._deaf(now_ms):
            self.button = 0
            self._take_key()
        self.watch_radio()
        self._step(now_ms)
        self._follow_status()
        self.watch_start(now_ms)
        self._follow_exit(now_ms)
        self.watch_supply()
        self._follow_radio(now_ms)
        self._schedule()

    def _follow_radio(self, until_ms: int) -> None:
        """Redraw the status bar after a command to the radio, and in the pass after some of its answers."""
        if self.radio.follow(until_ms):
            self.flags |= int(UiFlag.REDRAW_STATUS)

    def _follow_status(self) -> None:
        """Draw the status bar on request; without the bar, drop all requests for it."""
        if not self.flags & UiFlag.ENABLE_STATUS:
            if self._screen.update_mask & marks.STATUS.update:
                self._screen.mark(Marks(drop=marks.STATUS.update))
        elif self.flags & states.STATUS_WORK:
            self.draw_status(everything=bool(self.flags & UiFlag.REDRAW_STATUS))
            self.flags &= ~states.STATUS_WORK

    def _ends_message(self, now_ms: int) -> bool:
        """Return whether a button ends the message about a file's end, which reads none in its last pass."""
        unread = self._shows_message and now_ms < self._message_ends_ms
        return unread and self._keys.read(self.buttons, now_ms) is not None

    @property
    def _in_menu(self) -> bool:
        """Whether keys are for the menus."""
        return self._off_ms == NEVER and not self._from_menu and (self.state in states.IN_MENU or self._menu.shows_key)

    @property
    def _reads_keys(self) -> bool:
        """Whether keys count: the menu is drawn, or the brick has been off for a while."""
        if self._off_ms == NEVER:
            return self.state == UiState.WAITING or self._menu.shows_value
        return self._clock.now_ms >= self._down_ms + times.DEAF_MS

    def _read_keys(self, now_ms: int) -> None:
        """Follow a key when the menu is drawn."""
        key = self._key(now_ms) if self._reads_keys else 0
        if self._menu.shows_value:
            if key == Key.EXIT:
                self._menu.leave_view()
                self._next_step_ms = now_ms + 1
        elif key and self._off_ms == NEVER:
            self._menu.press(key)
            self._show_key()
        elif key == Key.ENTER:
            self._next_step_ms, self._starting, self._io_control.stays_on = now_ms + 1, True, False

    @property
    def _takes_keys(self) -> bool:
        """Whether a key of the map counts outside of the menus, a disabled one too: a message is shown."""
        return self.state == UiState.LOW_BATTERY or self._shows_message

    def _deaf(self, now_ms: int) -> bool:
        """Return whether a key of the map waits: a button is held, or the warning is new."""
        return self._warning_is_new(now_ms) or self._keys.held(self.buttons) is not None

    def _take_key(self) -> None:
        if not self._answered:
            self._sound.play_own(CLICK, self.volume)
        self._answered = False
        self.sleep_timer.restart(self._clock.now_ms)
        if self._shows_message:
            self._next_step_ms = self._message_ends_ms = self._clock.now_ms
        else:
            self.flags &= ~int(UiFlag.BUSY)
            self.map_state = self._warned_in
            self._screen.rest(self._clock.now_ms)
            self._next_step_ms = self._clock.now_ms + 1 if self._off_ms == NEVER else NEVER

    def _show_key(self) -> None:
        """Show the next state of a key; after the last one wait for another key, or switch off."""
        state = self._menu.next_state()
        if state is not None:
            self.state, self._next_step_ms = int(state), self._clock.now_ms + 1
            if self._menu.view.shown:
                self.flags &= ~int(UiFlag.BUSY)
                self._menu.view.end()
            return
        if self._menu.runs:
            self._run_from_menu()
            return
        if self._menu.view.chosen:
            self._begin_view()
            return
        self.state, self.force_off = int(UiState.WAITING), self.force_off or int(self._menu.switches_off)
        self._menu.switches_off = False

    def _begin_view(self) -> None:
        """Show the value of a sensor or motor; the state stays as it is."""
        view = self._menu.view
        self.flags |= int(UiFlag.BUSY | UiFlag.UPDATE)
        self._screen.mark(marks.VALUE)
        view.shown = True
        if view.delays:
            self._next_step_ms = self._clock.now_ms + 1
        else:
            view.set_sensor()

    def _step(self, now_ms: int) -> None:
        """Continue to start or end a file."""
        waits = self.flags & UiFlag.BUSY or self._starting or self._menu.begins_file
        if self.flags & UiFlag.EXECUTE_FILE and not waits:
            self._begin(now_ms)
        elif now_ms >= self._next_step_ms:
            self._advance(now_ms)

    def _advance(self, now_ms: int) -> None:
        self._next_step_ms = NEVER
        if self._starting:
            self.start(now_ms)
        elif self._menu.shows_key:
            self._show_key()
        elif self._menu.view.chosen:
            self._menu.view.set_sensor()
        elif self.state == UiState.OPENING:
            self.state, self._run = int(UiState.RUNNING), Run.TONE
            self._screen.mark(marks.OPENING)
            self._file, self._next_step_ms = self.program_name, now_ms + times.FADE_MS
        elif self.runs_file:
            self._continue(now_ms)
        elif self.state == UiState.LOGO:
            self.state = int(UiState.MELODY)
            self._menu.go_on_from(self.state)
            self._next_step_ms = now_ms + 1
        elif self.state == UiState.DRAWING:
            self.state = int(UiState.WAITING)
        elif self.state == UiState.QUESTION:
            self._follow_question(now_ms)

    def _follow_question(self, now_ms: int) -> None:
        """Show a question of the radio until it is answered."""
        question = self._question
        if not question.sounded:
            question.sounded = True
            self._sound.play_own(ATTENTION, self.volume)
        elif question.waits:
            question.press(self._key(now_ms))
        elif question.go_on():
            self.end_report(RadioState.ASKING)
            return
        self._next_step_ms = now_ms + 1

    def _schedule(self) -> None:
        now_ms, due = self._clock.now_ms, self._next_step_ms
        if self.radio.next_redraw_ms < due:
            due = int(self.radio.next_redraw_ms)
        if self.sleep_timer.limit_minutes and self._off_ms == NEVER:
            due = min(due, self.sleep_timer.expires_ms)
        if self._keys.repeat_ms != NEVER and self._keys.held(self.buttons):
            due = min(due, self._keys.repeat_ms)
        if self._off_ms != NEVER and now_ms <= self._down_ms:
            due = min(due, now_ms + 1)
        elif self._off_ms != NEVER and now_ms < self._down_ms + times.DEAF_MS:
            due = min(due, self._down_ms + times.DEAF_MS)
        undrawn = self.flags & UiFlag.ENABLE_STATUS and self.flags & states.STATUS_WORK
        unread = (
            undrawn
            or self._warns
            or self._finds_empty
            or self.button
            or self._answered
            or (self.flags & UiFlag.RESET_SLEEP_TIMER and not self.sleep_timer.rests)
            or (self._reads_keys and self._keys.changed(self.buttons))
        )
        due = now_ms + 1 if unread or (self.programs.active and not self.runs_file) else max(due, now_ms + 1)
        self._event_ms, self.due_ms = due, min(due, self.battery.next_sample_ms(now_ms))

    def skip_samples(self, until_ms: int) -> None:
        """Skip samples of the battery that change nothing."""
        self.due_ms = self.battery.skipped(self.due_ms, min(until_ms, self._event_ms))
