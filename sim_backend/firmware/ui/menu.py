"""The states of the menus, 4 to 11: they draw items, read a key, and follow it; functions of items draw the pages.

Pictures and texts are LEGO's and are not drawn. Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu_items import Call, Function, On
from sim_backend.firmware.ui.menu_place import MenuPlace
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import KEY_STATES, UiState

Handler = Callable[[int], bool]
"""A function of the menus: a pass of it, for what it is called; returns whether it goes on."""


class Menu:
    """The states ENTRY to EXIT.

    Args:
        registers: Those of the user interface.
        keys: The keys.
        screen: Draws the menus.
        place: The place in the menus.
        functions: The functions of the items.
    """

    def __init__(
        self,
        registers: UiRegisters,
        keys: KeyInput,
        screen: ScreenRefresh,
        place: MenuPlace,
        functions: Mapping[Function, Handler],
    ) -> None:
        self._registers, self._keys, self._screen, self._place = registers, keys, screen, place
        self._functions = functions
        self._function: Function | None = None
        self._argument = 0

    @property
    def handlers(self) -> Mapping[int, Callable[[], None]]:
        """What each of these states does in a pass."""
        return {
            UiState.ENTRY: self._restart,
            UiState.MENU: self._prepare,
            UiState.DRAWING: self._draw,
            UiState.WAITING: self._wait,
            UiState.LEFT: partial(self._move, Call.LEFT),
            UiState.RIGHT: partial(self._move, Call.RIGHT),
            UiState.ENTER: self._enter,
            UiState.EXIT: self._exit,
        }

    def call(self, function: Function | None, argument: int) -> None:
        """Have state DRAWING run a function, if there is one, in place of the present one."""
        if function:
            self._function, self._argument = function, argument

    def go_to_file(self) -> None:
        """Go to the page of a program: enter the first item three times."""
        self._place.go_home()
        for _ in range(3):
            self._enter()
            self._place.load()
        self._function = None

    def _restart(self) -> None:
        """Go to the first item of the main menu, without a function."""
        self._function = None
        self._place.restart()
        self._registers.go_to(UiState.MENU)

    def _prepare(self) -> None:
        """Load the item; a function begins with its step 0."""
        self._registers.step = 0
        self._place.load()
        if self._place.level.item.on & On.ENTER_ONLY_CALLS:
            self._place.only_calls = True
        self._registers.go_to(UiState.DRAWING)

    def _draw(self) -> None:
        """Run the function if there is one, else draw the item, which can call its function to open."""
        if self._function:
            if not self._functions[self._function](self._argument):
                self._function = None
            return
        place, item = self._place, self._place.level.item
        self._screen.mark(marks.PAGE if item.on & On.KEEPS else marks.MENU)
        self._registers.set(UiFlag.ENABLE_STATUS | UiFlag.UPDATE | UiFlag.REDRAW_STATUS)
        if item.on & (On.OPENS | On.OPENS_KNOWN) and not place.opened:
            place.opened = True
            self.call(item.function, Call.OPEN if item.on & On.OPENS else Call.OPEN_KNOWN)
        else:
            self._registers.go_to(UiState.ENTER if item.on & On.ENTERS else UiState.WAITING)

    def _wait(self) -> None:
        """Wait for a key; this is also the end of a start."""
        registers = self._registers
        registers.rest()
        if registers.starting:
            registers.clear(UiFlag.BUSY)
            registers.starting = False
        key = self._keys.read()
        if key in KEY_STATES and not (key == Key.EXIT and self._place.level.item.on & On.NO_EXIT):
            registers.go_to(KEY_STATES[key])

    def _move(self, call: Call) -> None:
        """Follow left or right."""
        place, item = self._place, self._place.level.item
        if item.on & On.KEYS_CALL:
            self.call(item.function, call)
        else:
            place.opened = place.only_calls = False
            place.level.move(call)
        self._registers.go_to(UiState.MENU)

    def _enter(self) -> None:
        place, item = self._place, self._place.level.item
        if item.on & On.ENTER_EXITS:
            self._exit()
            return
        self.call(item.function, item.argument)
        if place.only_calls:
            place.only_calls = False
            self._registers.go_to(UiState.DRAWING)
            return
        if item.on & On.ENTER_LEAVES:
            place.leave()
        else:
            place.go_down()
        self._registers.go_to(UiState.MENU)

    def _exit(self) -> None:
        item = self._place.level.item
        if item.on & On.EXIT_CALLS:
            self.call(item.function, Call.EXIT)
        self._place.exit()
        self._registers.go_to(UiState.MENU)
