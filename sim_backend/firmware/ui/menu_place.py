"""The place in the menus: for each menu on the way, the item of each level. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from sim_backend.firmware.ui.menu_items import MAIN, NOWHERE, Call, Item, On

_MENUS, _LEVELS = 3, 10
"""How many menus can be on the way, and how many levels of each."""


class Level:
    """A level of a menu.

    Attributes:
        item: The item that was loaded last.
        number: The number of the chosen item, from 1 on.
        items: How many items there were.
    """

    def __init__(self) -> None:
        self.item, self.number, self.items = NOWHERE, 0, 0

    def move(self, call: Call) -> None:
        """Choose the item to the left or right."""
        self.number = neighbour(self.number, call, self.items)


class _Menu:
    """A menu on the way: which one, and its present level."""

    def __init__(self) -> None:
        self.menu, self.level = MAIN, 0
        self.levels = [Level() for _ in range(_LEVELS)]


class MenuPlace:
    """The place, and whether its item has called its function to open.

    Args:
        menus: The items of each menu.
        has: Returns whether the brick has what the item needs.

    Attributes:
        level: The level whose item was loaded last.
        opened: Whether the item that was loaded last has called its function to open.
        only_calls: Whether the next enter only calls.
    """

    level: Level

    def __init__(self, menus: Sequence[Sequence[Item]], has: Callable[[On], bool]) -> None:
        self._menus, self._has = menus, has
        self._way, self._depth, self._item = [_Menu() for _ in range(_MENUS)], 0, NOWHERE
        self.opened = self.only_calls = False
        self.restart()

    def restart(self) -> None:
        """Go to the first item of the main menu."""
        self._depth = 0
        self._go_to(0, 1)
        self.go_home()
        self.only_calls = False

    def go_home(self) -> None:
        """Go to the first item of the main menu; the next enter acts as it would have acted before."""
        self._depth = 0
        self._go_to(1, 1)

    def _go_to(self, level: int, number: int) -> None:
        way = self._way[self._depth]
        way.level, way.levels[level].number = level, number
        self.load()

    def load(self) -> None:
        """Load the item of the place."""
        way = self._way[self._depth]
        self._present, self.level = way, way.levels[way.level]
        items = self._items()
        self.level.items = len(items)
        if items:
            item = items[min(self.level.number, len(items)) - 1]
            self.opened = self.opened and item is self._item
            self.level.item = self._item = item

    def _items(self) -> Sequence[Item]:
        """Return the items of the present level."""
        way, above = self._present, NOWHERE.path
        if way.level:
            item = way.levels[way.level - 1].item
            above = (*item.path[:-1], item.common) if item.common else item.path
        size = way.level + 1
        items = (item for item in self._menus[way.menu] if len(item.path) == size and item.path[:-1] == above)
        return [item for item in items if self._has(item.on)]

    def go_down(self) -> None:
        """Go to the menu, or to the level below, of the item that was loaded last."""
        item, way = self.level.item, self._present
        if item.menu:
            if self._depth < _MENUS - 1:
                self._depth += 1
                below = self._way[self._depth]
                below.menu, below.level, below.levels[0].number = item.menu, 0, item.first
        elif item.first and way.level < _LEVELS - 1:
            way.level += 1
            way.levels[way.level].number = item.first

    def go_up(self) -> None:
        """Go to the level above."""
        self._present.level = max(self._present.level - 1, 0)

    def leave(self) -> None:
        """Go to the menu before."""
        self._depth = max(self._depth - 1, 0)

    def exit(self) -> None:
        """Follow exit from the item that was loaded last."""
        item, way = self.level.item, self._present
        on = item.on
        if on & On.EXIT_GOES_ON:
            self.only_calls = False
            self.go_down()
        elif not way.level or on & On.EXIT_LEAVES:
            self.leave()
            return
        else:
            self.go_up()
            if on & (On.TWICE | On.THRICE):
                self.opened = False
                for _ in range(2 if on & On.THRICE else 1):
                    self.go_up()
        if item.leads_to:
            way.levels[way.level].number = item.leads_to


def neighbour(number: int, call: int, items: int) -> int:
    """Return the number of the item to the left of one, for `Call.LEFT`, else right: more than two items are a ring."""
    if call == Call.LEFT:
        return number - 1 if number > 1 else items if items > 2 else number
    return number + 1 if number < items else 1 if items > 2 else number
