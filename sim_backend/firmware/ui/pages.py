"""The functions of the menus' items, and what they share with the states. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sim_backend.firmware.button import ENTER_BUTTON, Button
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.module import Clock
from sim_backend.firmware.motors.output import OutputModule
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sensors.input import InputModule
from sim_backend.firmware.sensors.low_speed import LowSpeedModule
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui.data_log import DataLog
from sim_backend.firmware.ui.file_list import FileList, FileSearch
from sim_backend.firmware.ui.file_runner import FileRunner
from sim_backend.firmware.ui.i2c_reader import I2CReader
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.log_menu import LogMenu
from sim_backend.firmware.ui.menu import Menu
from sim_backend.firmware.ui.menu_items import Function, On, menus
from sim_backend.firmware.ui.menu_place import MenuPlace
from sim_backend.firmware.ui.menu_radio import MenuRadio
from sim_backend.firmware.ui.menu_settings import MenuSettings
from sim_backend.firmware.ui.message import Message
from sim_backend.firmware.ui.power_off import PowerOff
from sim_backend.firmware.ui.program_steps import ProgramSteps
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.running_sign import RunningSign
from sim_backend.firmware.ui.sensor_view import SensorView
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import FILE_TYPES, Programs
from sim_backend.firmware.ui.stored_settings import StoredSettings
from sim_backend.firmware.ui.text_entry import TextEntry
from sim_backend.firmware.ui.view_page import ViewPage


class Modules(NamedTuple):
    """The other modules that the user interface uses."""

    buttons: Sequence[Button]
    screen: ScreenRefresh
    sound: SoundModule
    loader: Loader
    inputs: InputModule
    outputs: OutputModule
    low_speed: LowSpeedModule
    programs: Programs
    radio: Radio
    io_control: IoControl


class Pages:
    """What the menus show, step by step.

    Args:
        modern: Whether the firmware has the data log, whose files are .log (else .rdt), and the newer sensors.

    Attributes:
        place: The place in the menus.
        message: The message that is shown.
        text: The text that is entered.
        files: The lists of files.
        steps: The program that is made on the brick.
        runner: Runs files.
        power_off: Switches the brick off.
        menu: The states of the menus.
        counters: The counts of passes.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        sleep_timer: SleepTimer,
        stored: StoredSettings,
        modules: Modules,
        *,
        modern: bool,
    ) -> None:
        buttons, screen, sound, loader, inputs, outputs, low_speed, programs, radio, io_control = modules
        self._radio, self._stored, types = radio, stored, (*FILE_TYPES, ".log" if modern else ".rdt")
        self.place = place = MenuPlace(menus(modern=modern), self._has)
        self.message = message = Message(clock, registers, screen)
        self.text = text = TextEntry(registers, keys, screen, buttons[ENTER_BUTTON])
        self._search, running = FileSearch(loader), RunningSign(clock, registers, screen)
        i2c = I2CReader(low_speed, modern=modern)
        view = ViewPage(clock, registers, keys, screen, SensorView(inputs, outputs, i2c, modern=modern))
        log = DataLog(clock, loader, inputs, outputs, i2c, programs, screen)
        logs = LogMenu(clock, registers, keys, loader, screen, sleep_timer, place, message, log, stored)
        self.steps = ProgramSteps(clock, registers, loader, programs, screen, sound, place, message, text, running)
        self.files = FileList(registers, loader, screen, sound, message, self._search, types)
        self.runner = FileRunner(registers, keys, screen, sound, programs, self.steps, text, running, types)
        self.power_off = PowerOff(registers, keys, screen, programs, radio, io_control, sleep_timer)
        settings = MenuSettings(clock, registers, keys, screen, sound, sleep_timer, stored)
        functions = {
            Function.OFF: self.power_off.run,
            Function.RUN: self.runner.run,
            Function.PROGRAM: self.steps.run,
            Function.LOG: logs.run,
            Function.VIEW: view.run,
            **self.files.functions,
            **settings.functions,
            **MenuRadio(registers, keys, screen, radio, message).functions,
        }
        self.menu = Menu(registers, keys, screen, place, functions)
        self.counters = {registers.timer, running.shown, message.timer, settings.shown, view.drawn, view.checked}

    def _has(self, on: On) -> bool:
        """Return whether the menus have an item, which can need the radio or the data log."""
        return not (on & On.RADIO and self._radio.shows_off) and not (on & On.LOG and not self._stored.has_log)

    def forget_steps(self) -> None:
        """Have messages, entries of a text and searches for files begin anew."""
        self._search.step = self.message.step = self.text.step = 0
