"""The user interface module: it runs the state of its map in each pass, and what follows every state.

Source: docs/firmware.md sections 1, 5.2 (Ui map) and 8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from firmware_protocol.iomap import ProgramStatus, UiFlag
from sim_backend.firmware.button import ENTER_BUTTON, EXIT_BUTTON, ButtonState
from sim_backend.firmware.files.names import pack_name, unpack_name
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.ui.battery import Battery
from sim_backend.firmware.ui.battery_warning import BatteryWarning
from sim_backend.firmware.ui.boot import Boot
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.menu_items import Call, Function
from sim_backend.firmware.ui.pages import Modules, Pages
from sim_backend.firmware.ui.program_watch import ProgramWatch
from sim_backend.firmware.ui.radio_dialog import RadioDialog
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import UiState
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
        program_steps: The program that is made on the brick.
    """

    def __init__(self, clock: Clock, version: Version, modules: Modules) -> None:
        self._clock, self._buttons, self._programs = clock, modules.buttons, modules.programs
        self._radio, self._io_control, self._screen = modules.radio, modules.io_control, modules.screen
        self._enter_keeps_program = version.enter_keeps_program
        screen, sound, radio = modules.screen, modules.sound, modules.radio
        self.registers = registers = UiRegisters(clock)
        self.battery, self.sleep_timer = battery, sleep_timer = Battery(), SleepTimer(clock)
        self._stored = stored = StoredSettings(modules.loader, version.settings)
        self._load_settings()
        sound.volume = registers.volume
        self._keys = keys = KeyInput(clock, registers, modules.buttons, sound, sleep_timer)
        self._pages = pages = Pages(clock, registers, keys, sleep_timer, stored, modules, modern=version.data_log)
        self.program_steps = pages.steps
        self._warning = BatteryWarning(clock, registers, battery, keys, screen)
        self.status_bar = StatusBar(clock, registers, battery, radio, screen)
        self._boot = Boot(registers, battery, self._warning, screen, sound, self._restart)
        self._dialog = RadioDialog(registers, screen, sound, radio, pages.message, pages.text, pages.place.go_home)
        self._watch = ProgramWatch(registers, modules.programs, sound, screen, restores=version.end_restores_screen)
        self._handlers = self._handlers_of_states()
        self.due_ms, self._event_ms = 0, NEVER

    def _handlers_of_states(self) -> Mapping[int, Callable[[], None]]:
        """Return what each state does in a pass, whatever has set it."""
        boot = self._boot
        return {
            UiState.START: boot.start,
            UiState.EMPTY: boot.show_empty,
            UiState.LOGO: boot.show_logo,
            UiState.MELODY: boot.wait,
            **self._pages.menu.handlers,
            UiState.QUESTION: self._dialog.ask,
            UiState.OPENING: self._open_file,
            UiState.RUNNING: self._pages.runner.state,
            UiState.LOW_BATTERY: self._warning.wait,
            UiState.REPORT: self._dialog.report,
        }

    def _open_file(self) -> None:
        """Give the screen to the requested file; whatever was shown begins anew after it."""
        registers = self.registers
        self._pages.menu.go_to_file()
        registers.step = registers.picture = 0
        self._pages.forget_steps()
        registers.selected = unpack_name(registers.program_name)
        self._pages.files.open_programs()
        self._pages.runner.run(Call.OPEN)
        registers.go_to(UiState.RUNNING)

    def _accept_file(self) -> None:
        """Accept a request, if there is one; another one in the next pass can still replace the file."""
        registers = self.registers
        if registers.requested:
            registers.set(UiFlag.BUSY)
            registers.go_to(UiState.OPENING)
            self._io_control.stays_on = False
            self.sleep_timer.restart(self._clock.now_ms)

    def _load_settings(self) -> None:
        self._stored.load()
        self.registers.volume, self.sleep_timer.limit_minutes = self._stored.volume, self._stored.sleep_minutes

    def _restart(self) -> None:
        """Start again after the brick was switched off: as at power-on, but the other modules continue."""
        registers = self.registers
        self._load_settings()
        self._warning.given = registers.error = 0
        registers.run_state = 1
        self.battery.restart(self._clock.now_ms - 1)
        self.status_bar.restart()
        self._screen.on = True
        self._pages.forget_steps()

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
        registers.rest(1)
        for counter in self._pages.counters:
            counter.settle()
        self._io_control.send()
        self._watch.follow()
        if self._radio.follow(now_ms - 1):
            registers.set(UiFlag.REDRAW_STATUS)
        self.sleep_timer.follow_request(now_ms, resets=bool(registers.flags & UiFlag.RESET_SLEEP_TIMER))
        self._handlers.get(registers.state, registers.rest)()
        self._warning.follow()
        self._dialog.follow()
        self._accept_file()
        registers.put(UiFlag.RESET_SLEEP_TIMER, not self.sleep_timer.limit_minutes)
        self._follow_battery(now_ms)
        self._follow_exit()
        self._pages.power_off.follow(partial(self._pages.menu.call, Function.OFF, Call.OPEN))
        self.status_bar.follow()
        if self._radio.redraws(now_ms):
            registers.set(UiFlag.REDRAW_STATUS)
        self._schedule(now_ms)

    def _follow_battery(self, now_ms: int) -> None:
        """Take a sample of the battery when it is time."""
        if self.battery.since_sample_ms(now_ms) == 0:
            self.battery.sample()
            self.registers.set(UiFlag.UPDATE)

    def _follow_exit(self) -> None:
        """Switch the brick off while exit's state says that it was held, but not in a start, or between two steps."""
        registers = self.registers
        held = self._buttons[EXIT_BUTTON].state & ButtonState.LONG_PRESS
        if held and not (registers.starting or registers.step or self._programs.status == ProgramStatus.RUNNING):
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
            or self._boot.due
            or self._watch.due
            or (registers.flags & UiFlag.RESET_SLEEP_TIMER and not self.sleep_timer.rests)
        ):
            due = now_ms + 1
        self._event_ms = due = max(due, now_ms + 1)
        self.due_ms = min(due, self.battery.next_sample_ms(now_ms))

    def skip_samples(self, until_ms: int) -> None:
        """Skip samples of the battery that change nothing."""
        self.due_ms = self.battery.skipped(self.due_ms, min(until_ms, self._event_ms))
