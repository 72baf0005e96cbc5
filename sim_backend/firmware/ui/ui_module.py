"""The user interface module: it takes keys and requests, and runs each part of the user interface in a pass.

Source: docs/firmware.md sections 1, 5.2 (Ui map) and 8.
"""

from __future__ import annotations

from collections.abc import Sequence

from firmware_protocol.iomap import DisplayFlag, UiFlag
from sim_backend.firmware.button import ENTER_BUTTON, EXIT_BUTTON, Button, ButtonState
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.files.names import pack_name
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.motors.output import OutputModule
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sensors.input import InputModule
from sim_backend.firmware.sensors.low_speed import LowSpeedModule
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import states
from sim_backend.firmware.ui.battery import Battery
from sim_backend.firmware.ui.battery_warning import BatteryWarning
from sim_backend.firmware.ui.boot import Boot
from sim_backend.firmware.ui.data_log import DataLog
from sim_backend.firmware.ui.file_runner import FileRunner
from sim_backend.firmware.ui.i2c_reader import I2CReader
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.log_menu import LogMenu
from sim_backend.firmware.ui.menu import Menu
from sim_backend.firmware.ui.menu_keys import MenuKeys
from sim_backend.firmware.ui.menu_settings import MenuSettings
from sim_backend.firmware.ui.off_states import OffStates
from sim_backend.firmware.ui.power_off import PowerOff
from sim_backend.firmware.ui.program_steps import ProgramSteps
from sim_backend.firmware.ui.program_watch import ProgramWatch
from sim_backend.firmware.ui.radio_dialog import RadioDialog
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sensor_view import SensorView
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import Programs, UiState
from sim_backend.firmware.ui.status_bar import StatusBar
from sim_backend.firmware.ui.stored_settings import StoredSettings
from sim_backend.firmware.versions import Version

_EXIT_MASK, _ENTER_MASK = 1 << EXIT_BUTTON, 1 << ENTER_BUTTON


class UiModule:
    """Menus, files, radio, battery and power, as the user of a brick sees them.

    Attributes:
        due_ms: See `Module`.
        registers: Values of the Ui map.
        battery: The supply.
        sleep_timer: Decides when to switch off.
        status_bar: The icons at the top of the screen.
    """

    def __init__(
        self,
        clock: Clock,
        version: Version,
        *,
        buttons: Sequence[Button],
        screen: ScreenRefresh,
        sound: SoundModule,
        loader: Loader,
        inputs: InputModule,
        outputs: OutputModule,
        low_speed: LowSpeedModule,
        programs: Programs,
        radio: Radio,
        io_control: IoControl,
    ) -> None:
        self._clock, self._buttons, self._screen, self._programs = clock, buttons, screen, programs
        self._radio, self._io_control, self._enter_keeps_program = radio, io_control, version.enter_keeps_program
        self.registers = registers = UiRegisters()
        self.battery, self.sleep_timer = battery, sleep_timer = Battery(), SleepTimer(clock)
        self._stored = StoredSettings(loader, version.settings)
        self._load_settings()
        sound.volume = registers.volume
        self._keys = keys = KeyInput(clock, registers, buttons, sound, sleep_timer)
        data_log = version.data_log
        settings = MenuSettings(registers, sleep_timer, self._stored)
        i2c = I2CReader(low_speed, modern=data_log)
        view = SensorView(inputs, outputs, i2c, modern=data_log)
        logs = LogMenu(DataLog(clock, loader, inputs, outputs, i2c, programs, screen))
        steps = ProgramSteps(loader, programs, sound)
        self._menu = menu = Menu(registers, keys, settings, loader, screen, view, logs, steps, radio, has_log=data_log)
        self._files = FileRunner(
            clock, registers, keys, menu, screen, sound, programs, io_control, sleep_timer, data_log=data_log
        )
        self.status_bar = StatusBar(clock, registers, battery, self._files, radio, screen)
        self._warning = BatteryWarning(clock, registers, battery, keys, screen, self.status_bar)
        self._boot = Boot(clock, registers, battery, self._warning, screen, self.status_bar, sound)
        self._dialog = RadioDialog(clock, registers, keys, menu, screen, sound, radio)
        self._power_off = PowerOff(clock, registers, screen, programs, radio, io_control, sleep_timer)
        self._off_states = OffStates(clock, registers, screen, self._power_off, self._dialog, self._go_on_from)
        self._menu_keys = MenuKeys(clock, registers, keys, menu, self._files, screen)
        self._watch = ProgramWatch(registers, programs, sound, screen, restores=version.end_restores_screen)
        self.due_ms, self._event_ms = 0, NEVER

    def _load_settings(self) -> None:
        self._stored.load()
        self.registers.volume, self.sleep_timer.limit_minutes = self._stored.volume, self._stored.sleep_minutes

    @property
    def program_steps(self) -> ProgramSteps:
        """The program that is made on the brick."""
        return self._menu.program

    @property
    def map_state(self) -> int:
        """The state in the map. A written state takes effect in the same pass."""
        return self.registers.state

    @map_state.setter
    def map_state(self, state: int) -> None:
        self._warning.forget()
        self._enter(state)

    def _enter(self, state: int) -> None:
        registers = self.registers
        self._menu_keys.keep_count()
        paused, begun, melody_ms = self._files.paused, self._files.has_begun, self._files.melody_ms
        ran, before, registers.state = registers.runs_file or paused, registers.state, state
        if before == state:
            return
        if not registers.is_on:
            self._off_states.enter(state, ran=ran)
            return
        if state not in states.MENU_STATES:
            self._menu_keys.leave_page(before)
            self._menu.drop()
        self._files.paused = state in states.PAUSING and (paused or before == UiState.RUNNING)
        if state in (UiState.DRAWING, UiState.RUNNING) and self._menu_keys.resume_page(paused=paused):
            return
        if begun and state == UiState.DRAWING:
            self._files.begin_page()
        elif ran and state == UiState.OPENING:
            registers.next_step_ms = self._clock.now_ms
        elif ran and state == UiState.MENU and self._menu.runs is None:
            self._files.show_menu()
        elif state == UiState.MELODY and before == UiState.LOGO and registers.starting:
            self._boot.skip_pictures()
        elif state in (UiState.START, *states.MENU_STATES) or (not ran and state in states.GONE_ON_FROM):
            self._go_on_from(state)
            if state == UiState.MELODY:
                registers.next_step_ms += melody_ms
        elif state in states.RADIO_SHOWN:
            registers.leave_start()
            registers.from_menu = False
            self._dialog.begin(state)
        elif ran or self._menu.view.shown:
            registers.next_step_ms, registers.from_menu = NEVER, False

    def _go_on_from(self, state: int) -> None:
        """Continue from a state that was written to the map."""
        registers, now_ms = self.registers, self._clock.now_ms
        registers.next_step_ms, registers.from_menu = now_ms + 2 * (state == UiState.RUNNING), False
        registers.leave_start()
        registers.starting = state == UiState.START
        self._files.choose(pack_name(self._menu.files.chosen), opened=state == UiState.OPENING)
        if state in states.MENU_STATES:
            self._menu.go_on_from(state)
        elif state == UiState.RUNNING:
            registers.set(UiFlag.BUSY)

    def wake(self) -> None:
        """Run in this module's next turn."""
        self.due_ms = self._event_ms = self._clock.now_ms

    def wake_later(self) -> None:
        """Run in the next pass."""
        self.due_ms = self._event_ms = min(self.due_ms, self._clock.now_ms + 1)

    def set_battery(self, raw: int) -> None:
        """Change the battery: a 10-bit converter value, plus `battery.RECHARGEABLE`."""
        self.battery.raw = raw
        self.due_ms = min(self.due_ms, self.battery.next_sample_ms(self._clock.now_ms))

    def stay_awake(self) -> None:
        """Restart the sleep timer."""
        self.sleep_timer.restart(self._clock.now_ms + 1)  # the pass that follows the telegram
        self.wake_later()

    def set_sleep_minutes(self, minutes: int) -> None:
        """Change the time until power-off to the low 8 bits, 0 for never. The timer keeps running."""
        self.sleep_timer.limit_minutes = minutes & 0xFF
        self.wake()

    def execute(self, name: str) -> None:
        """Request the start of a file; the request is lost if the user interface is still busy."""
        self.registers.program_name = pack_name(name)
        self.registers.set(UiFlag.EXECUTE_FILE)
        self.wake()

    def program_ended(self, *, had_screen: bool) -> None:
        """Notice in the next pass that a program, perhaps one that could not start, is over."""
        self._watch.note_end(had_screen=had_screen)
        self._files.program_ended()
        self.wake_later()

    def check_program(self) -> None:
        """Check in this module's next turn whether a program still runs."""
        self._files.check_program()
        self.wake()

    def show_status(self, shown: bool) -> None:
        """Show the status bar and the firmware's own screen, or leave the screen to a program."""
        self.registers.put(UiFlag.ENABLE_STATUS, shown)
        if shown:
            self.registers.set(UiFlag.REDRAW_STATUS)
        self.wake()

    def press(self, pressed: int) -> None:
        """Handle a change of the buttons; those newly pressed are given as bits of the button module."""
        registers, runs = self.registers, self._programs.running
        kept = self._enter_keeps_program and pressed & _ENTER_MASK
        if runs and pressed & _EXIT_MASK and not kept:
            self._programs.stop()
            self._buttons[EXIT_BUTTON].state &= ~int(ButtonState.NEW_PRESS)
        if registers.is_on and not self._menu_keys.active:
            reads = registers.runs_file or self._warning.shown
            if not (reads or registers.starting or registers.state in (UiState.OPENING, *states.RADIO_SHOWN)):
                self._keys.read_button()
        self.wake()

    def run(self, now_ms: int) -> None:
        """Run one pass: battery's sample, keys, the radio's request, the next step, status bar, battery, power."""
        registers, before = self.registers, self.registers.state
        self._watch.follow()
        self._follow_radio(now_ms - 1)
        if self.battery.since_sample_ms(now_ms) == 0:
            self.battery.sample()
            registers.set(UiFlag.UPDATE)
        again = self.sleep_timer.follow_request(now_ms, resets=bool(registers.flags & UiFlag.RESET_SLEEP_TIMER))
        registers.put(UiFlag.RESET_SLEEP_TIMER, again)
        self._boot.end()
        self._follow_keys(now_ms)
        self._dialog.follow_report()
        self._warning.follow()
        self._dialog.follow()
        self._files.follow_status(now_ms)
        self._step(now_ms)
        if self._menu.logs.log.runs:
            self.sleep_timer.rest(now_ms)
        self.status_bar.follow()
        self._boot.follow()
        self._follow_exit()
        self._power_off.follow(before)
        self._follow_radio(now_ms)
        self._schedule()

    def _follow_radio(self, until_ms: int) -> None:
        """Redraw the status bar after a command to the radio, and in the pass after some of its answers."""
        if self._radio.follow(until_ms):
            self.registers.set(UiFlag.REDRAW_STATUS)

    def _follow_keys(self, now_ms: int) -> None:
        """Follow a key of the menus, or one that ends a message or the warning of a low battery."""
        registers, warning, files = self.registers, self._warning, self._files
        if self._menu_keys.active:
            self._menu_keys.follow()
        elif not (registers.is_on or registers.runs_file or warning.shown):
            self._start_by_key(now_ms)
        elif files.takes_button():
            files.end_message()
        elif warning.takes_key():
            self._close_warning(now_ms)
        elif files.shows_message and registers.button and not self._keys.held:
            registers.button = 0  # it counts even if it is disabled
            files.end_message()

    def _start_by_key(self, now_ms: int) -> None:
        """Start the brick again by enter, once it has been off for a while; follow a key if state 7 was written."""
        registers = self.registers
        if registers.state == UiState.WAITING:
            shown = states.KEY_STATES.get(self._keys.read())
            if shown is not None:
                registers.state, registers.next_step_ms = int(shown), now_ms + 1
        elif self._power_off.takes_keys and not registers.starting and self._keys.read() == Key.ENTER:
            registers.next_step_ms, registers.starting, self._io_control.stays_on = now_ms + 1, True, False
            self._keys.ignore()

    def _close_warning(self, now_ms: int) -> None:
        """Continue after the warning of a low battery."""
        registers, warning = self.registers, self._warning
        registers.clear(UiFlag.BUSY)
        if warning.end():
            self._files.delay(warning.lasts_ms)
        else:
            self._enter(warning.returns_to)
            registers.next_step_ms = now_ms + 1 if registers.is_on else NEVER
        self._screen.rest(now_ms)

    def _step(self, now_ms: int) -> None:
        """Take the next step of the state, or begin with a requested file; one that is shown takes its step, too."""
        registers = self.registers
        self._menu_keys.end_page()
        waits = self._menu.begins or (registers.starting and registers.state == UiState.START)
        accepts = registers.requested and not waits
        has_screen = registers.runs_file or registers.state == UiState.OPENING
        if now_ms >= registers.next_step_ms and (has_screen or not accepts):
            registers.next_step_ms = NEVER
            self._advance(now_ms)
        if accepts and registers.requested:
            registers.leave_start()
            self._files.begin()

    def _advance(self, now_ms: int) -> None:
        registers, state = self.registers, self.registers.state
        if registers.starting:
            if state == UiState.START:
                self._restart(now_ms)
            self._boot.go_on()
        elif self._menu.states.shown:
            self._menu_keys.show()
        elif state == UiState.DRAWING and (self._menu.view.chosen or self._menu.view.shown):
            self._menu_keys.show_value()
        elif self._menu.message.shown:
            self._menu_keys.close_message()
        elif self._menu.logs.log.runs:
            self._menu_keys.go_on_with_log()
        elif state == UiState.OPENING:
            self._files.enter()
        elif not registers.is_on and self._off_states.go_on():
            pass
        elif registers.runs_file:
            self._files.go_on()
        elif state == UiState.LOGO and not self._boot.shows_empty:
            self._leave_logo(now_ms)
        elif state == UiState.DRAWING:
            registers.state = int(UiState.WAITING)
        elif state == UiState.QUESTION:
            self._dialog.go_on_with_question()

    def _leave_logo(self, now_ms: int) -> None:
        """Continue from the state of the logo, which was written, when the refresh that runs has ended."""
        registers, screen = self.registers, self._screen
        registers.next_step_ms = now_ms + 1
        if screen.stopped:
            registers.state = int(UiState.MELODY)
            screen.refresh()
            self._menu.go_on_from(registers.state)
        elif screen.flags & DisplayFlag.REFRESH:
            screen.end_refresh()

    def _restart(self, now_ms: int) -> None:
        """Start again after the brick was switched off: as at power-on, but the other modules continue."""
        registers = self.registers
        self._load_settings()
        self._warning.allow()
        registers.run_state, registers.error = 1, 0
        self.battery.restart(now_ms - 1)
        self.status_bar.restart()
        registers.off_ms, self._screen.on = NEVER, True
        self._menu.reset()

    def _follow_exit(self) -> None:
        """Switch the brick off while exit's state says that it was held, but not in a start, nor once a file runs.

        A file that a written state has interrupted still counts in the states of the radio.
        """
        registers = self.registers
        runs = self._files.has_begun and (registers.runs_file or registers.state in states.RADIO_SHOWN)
        held = self._buttons[EXIT_BUTTON].state & ButtonState.LONG_PRESS
        if held and registers.is_on and not (registers.starting or runs):
            registers.force_off = 1

    def _schedule(self) -> None:
        registers, now_ms, keys = self.registers, self._clock.now_ms, self._keys
        due = min(registers.next_step_ms, self._power_off.due_ms)
        if registers.left_start and registers.state == UiState.WAITING:
            due = now_ms + 1
        if self._radio.next_redraw_ms < due:
            due = int(self._radio.next_redraw_ms)
        if self.sleep_timer.limit_minutes:
            due = min(due, self.sleep_timer.expires_ms)
        if keys.repeat_ms != NEVER and keys.held:
            due = min(due, keys.repeat_ms)
        unread = (
            self.status_bar.due
            or self._warning.due
            or self._boot.finds_empty
            or self._watch.due
            or registers.button
            or (self._warning.shown and (self._screen.drawing or keys.changed))
            or (registers.flags & UiFlag.RESET_SLEEP_TIMER and not self.sleep_timer.rests)
            or ((self._menu_keys.awaited or self._power_off.takes_keys) and keys.changed)
        )
        due = now_ms + 1 if unread else max(due, now_ms + 1)
        self._event_ms, self.due_ms = due, min(due, self.battery.next_sample_ms(now_ms))

    def skip_samples(self, until_ms: int) -> None:
        """Skip samples of the battery that change nothing."""
        self.due_ms = self.battery.skipped(self.due_ms, min(until_ms, self._event_ms))
