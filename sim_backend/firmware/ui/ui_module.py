"""The user interface module: it runs the state of its map in each pass, and what follows every state.

Source: docs/firmware.md sections 1, 5.2 (Ui map) and 8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from firmware_protocol.iomap import UiFlag
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
from sim_backend.firmware.ui.battery import Battery
from sim_backend.firmware.ui.battery_warning import BatteryWarning
from sim_backend.firmware.ui.boot import Boot
from sim_backend.firmware.ui.data_log import DataLog
from sim_backend.firmware.ui.file_runner import FileRunner
from sim_backend.firmware.ui.i2c_reader import I2CReader
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.key_states import KeyStates
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.log_menu import LogMenu
from sim_backend.firmware.ui.menu import Menu
from sim_backend.firmware.ui.menu_settings import MenuSettings
from sim_backend.firmware.ui.menu_states import MenuStates
from sim_backend.firmware.ui.page import CurrentPage
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
        self._clock, self._buttons, self._programs, self._radio = clock, buttons, programs, radio
        self._io_control, self._screen, self._enter_keeps_program = io_control, screen, version.enter_keeps_program
        self.registers = registers = UiRegisters(clock)
        self.battery, self.sleep_timer = battery, sleep_timer = Battery(), SleepTimer(clock)
        self._stored = StoredSettings(loader, version.settings)
        self._load_settings()
        sound.volume = registers.volume
        self._keys = keys = KeyInput(clock, registers, buttons, sound, sleep_timer)
        data_log = version.data_log
        settings, steps = MenuSettings(registers, sleep_timer, self._stored), ProgramSteps(loader, programs, sound)
        i2c = I2CReader(low_speed, modern=data_log)
        view = SensorView(inputs, outputs, i2c, modern=data_log)
        logs = LogMenu(DataLog(clock, loader, inputs, outputs, i2c, programs, screen))
        self._current = current = CurrentPage(KeyStates(registers, screen))
        self._menu = menu = Menu(
            clock, registers, keys, current, settings, loader, screen, view, logs, steps, radio, has_log=data_log
        )
        self._warning = BatteryWarning(clock, registers, battery, keys, screen)
        self._files = FileRunner(
            clock, registers, keys, menu, current, screen, sound, programs, io_control, sleep_timer, data_log=data_log
        )
        self.status_bar = StatusBar(clock, registers, battery, self._files, radio, screen)
        self._boot = Boot(registers, battery, self._warning, screen, self.status_bar, sound, self._restart)
        self._dialog = RadioDialog(clock, registers, keys, menu, current, screen, sound, radio)
        self._power_off = PowerOff(registers, keys, current, screen, programs, radio, io_control, sleep_timer)
        self._watch = ProgramWatch(registers, programs, sound, screen, restores=version.end_restores_screen)
        self._menu_states = MenuStates(registers, keys, menu, current)
        self._handlers = self._handlers_of_states()
        self._counters = {registers.timer, self._files.playing, self._dialog.shown, *menu.counters}
        self.due_ms, self._event_ms = 0, NEVER

    def _handlers_of_states(self) -> Mapping[int, Callable[[], None]]:
        """Return what each state does in a pass, whatever has set it."""
        boot, menu, files = self._boot, self._menu_states, self._files
        return {
            UiState.START: boot.start,
            UiState.EMPTY: boot.show_empty,
            UiState.LOGO: boot.show_logo,
            UiState.MELODY: boot.wait,
            UiState.ENTRY: menu.enter,
            UiState.MENU: menu.prepare,
            UiState.DRAWING: menu.draw,
            UiState.WAITING: menu.wait,
            UiState.LEFT: partial(menu.follow, Key.LEFT),
            UiState.RIGHT: partial(menu.follow, Key.RIGHT),
            UiState.ENTER: partial(menu.follow, Key.ENTER),
            UiState.EXIT: partial(menu.follow, Key.EXIT),
            UiState.QUESTION: self._dialog.ask,
            UiState.OPENING: self._open_file,
            UiState.RUNNING: files.run,
            UiState.LOW_BATTERY: self._warning.wait,
            UiState.REPORT: self._dialog.report,
        }

    def _open_file(self) -> None:
        self._dialog.redraw()
        self._files.open()

    def _load_settings(self) -> None:
        self._stored.load()
        self.registers.volume, self.sleep_timer.limit_minutes = self._stored.volume, self._stored.sleep_minutes

    def _restart(self) -> None:
        """Start again after the brick was switched off: as at power-on, but the other modules continue."""
        registers = self.registers
        self._load_settings()
        self._warning.allow()
        registers.run_state, registers.error = 1, 0
        self.battery.restart(self._clock.now_ms - 1)
        self.status_bar.restart()
        self._screen.on = True
        self._dialog.redraw()

    @property
    def program_steps(self) -> ProgramSteps:
        """The program that is made on the brick."""
        return self._menu.program

    @property
    def map_state(self) -> int:
        """The state in the map. A written state takes effect in the same pass, and ends what the old one has begun."""
        return self.registers.state

    @map_state.setter
    def map_state(self, state: int) -> None:
        if state != self.registers.state:
            self.registers.state = state
            self._current.interrupt()

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
        """Notice that a program, perhaps one that could not start, is over."""
        self._watch.note_end(had_screen=had_screen)
        self.wake()

    def show_status(self, shown: bool) -> None:
        """Show the status bar and the firmware's own screen, or leave the screen to a program."""
        self.registers.put(UiFlag.ENABLE_STATUS, shown)
        if shown:
            self.registers.set(UiFlag.REDRAW_STATUS)
        self.wake()

    def press(self, pressed: int) -> None:
        """Handle a change of the buttons; those newly pressed are given as bits of the button module."""
        kept = self._enter_keeps_program and pressed & _ENTER_MASK
        if self._programs.running and pressed & _EXIT_MASK and not kept:
            self._programs.stop()
            self._buttons[EXIT_BUTTON].state &= ~int(ButtonState.NEW_PRESS)
        self.wake()

    def run(self, now_ms: int) -> None:
        """Run one pass: the state, then the warning, requests of the radio and for files, status bar, and power."""
        registers = self.registers
        registers.wake_ms = NEVER
        for counter in self._counters:
            counter.settle()
        self._io_control.send()
        self._watch.follow()
        self._follow_radio(now_ms - 1)
        self._follow_sleep_request(now_ms)
        self._follow_exit()
        if handler := self._handlers.get(registers.state):
            handler()
        if self._menu.logs.log.runs:
            self.sleep_timer.rest(now_ms)
        self._warning.follow()
        self._dialog.follow()
        self._files.accept()
        self._follow_battery(now_ms)
        self.status_bar.follow()
        self._power_off.follow()
        self._follow_radio(now_ms)
        self._schedule(now_ms)

    def _follow_radio(self, until_ms: int) -> None:
        """Redraw the status bar after a command to the radio, and in the pass after some of its answers."""
        if self._radio.follow(until_ms):
            self.registers.set(UiFlag.REDRAW_STATUS)

    def _follow_sleep_request(self, now_ms: int) -> None:
        """Restart the sleep timer on request."""
        registers = self.registers
        again = self.sleep_timer.follow_request(now_ms, resets=bool(registers.flags & UiFlag.RESET_SLEEP_TIMER))
        registers.put(UiFlag.RESET_SLEEP_TIMER, again)

    def _follow_battery(self, now_ms: int) -> None:
        """Take a sample of the battery when it is time."""
        if self.battery.since_sample_ms(now_ms) == 0:
            self.battery.sample()
            self.registers.set(UiFlag.UPDATE)

    def _follow_exit(self) -> None:
        """Switch the brick off while exit's state says that it was held, but not in a start."""
        registers = self.registers
        held = self._buttons[EXIT_BUTTON].state & ButtonState.LONG_PRESS
        may = registers.may_switch_off and not (registers.starting or self._current.shows(self._power_off.page))
        if held and may:
            registers.force_off = 1

    def _schedule(self, now_ms: int) -> None:
        registers, keys = self.registers, self._keys
        due = min(registers.wake_ms, int(min(self._radio.next_redraw_ms, NEVER)))
        if self.sleep_timer.limit_minutes:
            due = min(due, self.sleep_timer.expires_ms)
        if keys.repeat_ms != NEVER and keys.held:
            due = min(due, keys.repeat_ms)
        if (
            self.status_bar.due
            or self._warning.due
            or self._boot.finds_empty
            or self._watch.due
            or (registers.flags & UiFlag.RESET_SLEEP_TIMER and not self.sleep_timer.rests)
        ):
            due = now_ms + 1
        self._event_ms = due = max(due, now_ms + 1)
        self.due_ms = min(due, self.battery.next_sample_ms(now_ms))

    def skip_samples(self, until_ms: int) -> None:
        """Skip samples of the battery that change nothing."""
        self.due_ms = self.battery.skipped(self.due_ms, min(until_ms, self._event_ms))
