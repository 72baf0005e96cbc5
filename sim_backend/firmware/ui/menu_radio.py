"""The pages of the radio's menu, and of sending a file. No device is in reach. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from sim_backend.firmware.radio import Radio
from sim_backend.firmware.radio_answers import Change, after_ends, disconnected, removed, search, visibility
from sim_backend.firmware.radio_tables import CONNECTIONS, FREE
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import message
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu_items import Call, Function
from sim_backend.firmware.ui.menu_place import neighbour
from sim_backend.firmware.ui.message import Message
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import UiState

_CONNECTS_MS, _SENDS_MS = 30_002, 30_003
"""How long the radio tries to reach a device, and to send a file."""

_FAILED = 99
"""Step that shows the message that something has failed, or that a search has found nothing."""


class MenuRadio:
    """The functions SWITCH, VISIBILITY, SEARCH, DEVICES, CONNECTIONS and SEND."""

    def __init__(
        self, registers: UiRegisters, keys: KeyInput, screen: ScreenRefresh, radio: Radio, shown: Message
    ) -> None:
        self._registers, self._keys, self._screen, self._radio = registers, keys, screen, radio
        self._message, self._slots, self._slot = shown, 0, 0
        self._devices = self._device = self._selected = 0
        self._lists_known = False

    @property
    def functions(self) -> Mapping[Function, Callable[[int], bool]]:
        """The functions of items."""
        return {
            Function.SWITCH: self.switch,
            Function.VISIBILITY: self.show,
            Function.SEARCH: self.search,
            Function.DEVICES: self.devices,
            Function.CONNECTIONS: self.connections,
            Function.SEND: self.send,
        }

    def switch(self, argument: int) -> bool:
        """Switch the radio on or off, and show a message until that is done."""
        registers, radio, on = self._registers, self._radio, argument == Call.ON
        match registers.step:
            case 0:
                done = on != radio.shows_off or radio.switch(on, lead_ms=1)
                registers.step = 1 if done else _FAILED
            case 1 if self._message.show(10 if on else 11):
                registers.step = 2
            case 2 if not radio.seems_busy:
                registers.end(UiState.EXIT)
            case 1 | 2:
                pass
            case _:
                self._fail()
        return bool(registers.step)

    def _fail(self) -> None:
        """Show that something has failed."""
        if self._message.show(7, passes=message.LONG):
            self._registers.end(UiState.EXIT)

    def show(self, argument: int) -> bool:
        """Make the radio visible to others, or not."""
        registers, radio = self._registers, self._radio
        if not registers.step and self._begin(3, *visibility(argument == Call.ON)):
            registers.step = 1
        elif not (registers.step and radio.seems_busy):
            registers.end(UiState.EXIT)
        return bool(registers.step)

    def search(self, argument: int) -> bool:
        """Search for devices, and list those of the table; exit aborts that."""
        registers, radio = self._registers, self._radio
        match registers.step:
            case _ if argument != Call.OPEN:
                pass
            case 0:
                self._screen.mark(marks.ICONS)
                registers.step = 1
            case 1 if self._message.show(9):
                found = self._begin(5, *search(radio.tables.begin_search), ending_ms=2)
                if found:
                    self._screen.mark(marks.FOUND)
                registers.step = 2 if found else _FAILED
            case 2:
                if not radio.seems_busy:
                    registers.step = 3 if radio.tables.devices(known=False) else _FAILED
                if self._keys.read_silently() == Key.EXIT:
                    registers.step = 4
            case 4 if self._message.show(8, passes=message.SHORT):
                registers.step = 5
            case 5:
                registers.step = 6 if radio.tables.devices(known=False) else _FAILED
            case 3 | 6:
                registers.end(UiState.ENTER)
            case 1 | 4:
                pass
            case _:
                self._fail()
        return bool(registers.step)

    def _begin(self, duration_ms: int, *changes: Change, ending_ms: int = 1) -> bool:
        """Begin a command to the radio, after the end of a connection from another brick; return whether it can begin.

        Args:
            duration_ms: How long it takes.
            changes: What it changes.
            ending_ms: How much longer it takes with such a connection.
        """
        tables = self._radio.tables
        handles = [tables.handle(0)] if tables.connected(0) else []
        later = after_ends(changes, handles, 2, tables.end, each_ms=1)
        return self._radio.begin(duration_ms + ending_ms * len(handles), *later)

    def devices(self, argument: int) -> bool:
        """List the devices of the table, choose one, or remove the chosen one, as the radio does not know it."""
        registers = self._registers
        match argument:
            case Call.OPEN | Call.OPEN_KNOWN | Call.LEFT | Call.RIGHT:
                self._list_devices(argument)
            case Call.SELECT:
                self._selected = self._device
                registers.go_to(UiState.MENU)
            case Call.DELETE if registers.step:
                self._await()
            case Call.DELETE if self._device_number is not None:
                remove = partial(self._radio.tables.remove, self._device_number)
                registers.step = 1 if self._begin(3, *removed(remove)) else _FAILED
                self._selected = 0
            case Call.DELETE:
                registers.end(UiState.EXIT)
        return bool(registers.step)

    def _list_devices(self, argument: int) -> None:
        registers = self._registers
        if argument in (Call.OPEN, Call.OPEN_KNOWN):
            self._selected, self._device, self._lists_known = 0, 1, argument == Call.OPEN_KNOWN
            self._devices = len(self._radio.tables.devices(known=self._lists_known))
            if not self._devices:
                registers.end(UiState.EXIT)
                return
            self._screen.mark(marks.TAKEN)
        else:
            self._device = neighbour(self._device, argument, self._devices)
        self._screen.mark(marks.listed(self._devices, self._device))
        registers.go_to(UiState.WAITING)

    @property
    def _device_number(self) -> int | None:
        """The number of the chosen device in the table, if one was chosen that is still there."""
        devices = self._radio.tables.devices(known=self._lists_known)
        return devices[self._selected - 1] if 0 < self._selected <= len(devices) else None

    def _await(self) -> None:
        """Wait for the end of a command, or show that it has failed."""
        if self._registers.step != 1:
            self._fail()
        elif not self._radio.seems_busy:
            self._registers.end(UiState.EXIT)

    def connections(self, argument: int) -> bool:
        """List the connections, look whether the chosen one exists, or end it."""
        registers = self._registers
        match argument:
            case Call.OPEN | Call.LEFT | Call.RIGHT:
                self._list(argument, CONNECTIONS, 2)
            case Call.UPDATE:
                if not self._radio.tables.connected(self._slot - 1):
                    registers.end(UiState.EXIT)
            case _ if registers.step:
                self._await()
            case _:
                self._disconnect(self._slot - 1)
        return bool(registers.step)

    def _disconnect(self, number: int) -> None:
        tables = self._radio.tables
        handle = tables.handle(number)
        changes = () if handle == FREE else disconnected(2, handle, partial(tables.end, handle))
        self._registers.step = 1 if self._radio.begin(2 if changes else 1, *changes) else _FAILED

    def send(self, argument: int) -> bool:
        """List the connections to send a file to, or for a new one; show that there is none, or make one."""
        registers = self._registers
        if argument in (Call.OPEN, Call.LEFT, Call.RIGHT):
            self._list(argument, CONNECTIONS - 1, 1)
        elif argument == Call.CONNECT:
            self._connect()
        else:
            self._send()
        return bool(registers.step)

    def _connect(self) -> None:
        registers = self._registers
        match registers.step:
            case 0 if self._selected:
                registers.step = 1
            case 0:
                registers.end(UiState.EXIT)
            case 1 if self._message.show(10):
                found = self._device_number is not None
                registers.step = 2 if found and self._begin(_CONNECTS_MS) else _FAILED
            case 2 if not self._radio.seems_busy:
                registers.step = 6  # the line is busy
            case 6 if self._message.show(12, passes=message.LONG):
                registers.end(UiState.EXIT)
            case 1 | 2 | 6:
                pass
            case _:
                self._fail()

    def _send(self) -> None:
        registers = self._registers
        match registers.step:
            case 0:
                connected = registers.selected and self._radio.tables.connected(self._slot)
                registers.step = 2 if connected else 1
            case 1 if self._message.show(11, passes=message.LONG):
                registers.end(UiState.EXIT)
            case 2 if self._message.show(12):
                registers.step = 3 if self._radio.begin(_SENDS_MS) else 4
            case 3 if not self._radio.seems_busy:
                registers.step = 4
            case 4:
                self._fail()

    def _list(self, argument: int, slots: int, first: int) -> None:
        if argument == Call.OPEN:
            self._slots, self._slot = slots, first
        else:
            self._slot = neighbour(self._slot, argument, self._slots)
        shown = (
            neighbour(self._slot, Call.LEFT, self._slots),
            self._slot,
            neighbour(self._slot, Call.RIGHT, self._slots),
        )
        ahead = self._slots == CONNECTIONS  # the first one is that of the brick that has connected to this one
        connected = [self._radio.tables.connected(slot - ahead) for slot in shown]
        self._screen.mark(marks.connections(connected))
        self._registers.go_to(UiState.WAITING)
