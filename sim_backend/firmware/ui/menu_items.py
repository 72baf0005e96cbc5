"""The items of the menus: where each one is, what it does, and where it leads. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum, IntEnum, IntFlag, auto
from typing import NamedTuple

from sim_backend.firmware.ui.data_log import MOTOR_PORTS, SENSOR_PORTS
from sim_backend.firmware.ui.data_log import VALUES as LOGGED
from sim_backend.firmware.ui.sensor_view import shown_values

Place = tuple[int, ...]
"""A menu, or an item of one: the numbers, from 1 on, of the items that lead there."""


class Function(Enum):
    """What an item calls; each is a handler with a step of its own."""

    OFF = auto()
    LIST = auto()
    RUN = auto()
    DELETE = auto()
    SEND = auto()
    PROGRAM = auto()
    LOG = auto()
    VIEW = auto()
    VOLUME = auto()
    SLEEP = auto()
    VERSION = auto()
    ERASE = auto()
    SWITCH = auto()
    VISIBILITY = auto()
    SEARCH = auto()
    DEVICES = auto()
    CONNECTIONS = auto()


class Call(IntEnum):
    """What a function is called for, besides numbers of its own."""

    OPEN = 0
    OPEN_KNOWN = 1
    LEFT = 0x100
    RIGHT = 0x101
    ENTER = 0x102
    EXIT = 0x103
    SELECT = 0x104
    RUN = 0x105
    SEND = 0x106
    SAVE = 0x107
    DELETE = 0x108
    TEXT = 0x109
    ON = 0x10A
    OFF = 0x10B
    CONNECT = 0x10C
    DISCONNECT = 0x10D
    UPDATE = 0x10E


class On(IntFlag):
    """What is special about an item.

    When it is drawn, it can call its function to open (`OPENS`, `OPENS_KNOWN`), enter itself (`ENTERS`), or leave the
    background (`KEEPS`). Left and right can call its function (`KEYS_CALL`). Enter can act as exit
    (`ENTER_EXITS`), lead to the menu before (`ENTER_LEAVES`), or, the first time, only call (`ENTER_ONLY_CALLS`). Exit
    can call its function as enter does (`EXIT_ENTERS`) or for exit (`EXIT_CALLS`), lead to the menu before
    (`EXIT_LEAVES`), further up (`TWICE`, `THRICE`), down as enter does (`EXIT_GOES_ON`), or nowhere (`NO_EXIT`).
    The item can need the radio (`RADIO`) or the data log (`LOG`).
    """

    OPENS = auto()
    OPENS_KNOWN = auto()
    ENTERS = auto()
    KEEPS = auto()
    KEYS_CALL = auto()
    ENTER_EXITS = auto()
    ENTER_LEAVES = auto()
    ENTER_ONLY_CALLS = auto()
    EXIT_CALLS = auto()
    EXIT_LEAVES = auto()
    TWICE = auto()
    THRICE = auto()
    EXIT_GOES_ON = auto()
    NO_EXIT = auto()
    RADIO = auto()
    LOG = auto()


class Item(NamedTuple):
    """An item of the menus.

    Attributes:
        path: Its place.
        on: What is special about it.
        function: What it calls.
        argument: For what.
        first: The item of the level below that is shown first, from 1 on; 0 if there is no such level.
        menu: Another menu that it leads to instead, by its number; 0 for none.
        common: The item of its level whose level below it shares; 0 if it has one of its own.
        leads_to: The item of the level above that exit leads to; 0 for the one that was left.
    """

    path: Place
    on: On = On(0)
    function: Function | None = None
    argument: int = Call.OPEN
    first: int = 0
    menu: int = 0
    common: int = 0
    leads_to: int = 0


NOWHERE = Item(())
"""What a level without items has."""

MAIN, FILES, PROGRAM, LOG, VIEW, SETTINGS, TRY_ME, RADIO = range(8)
"""Numbers of the menus."""

SOUND_FILE, PROGRAM_FILE, ON_BRICK_FILE, TRY_FILE, LOG_FILE = range(1, 6)
"""Kinds of files as the menus number them."""

PORTS = 0x20
"""Added to a port; the motors' follow those of the sensors."""

_ACTIONS = (0x23, 0x22, 0x29, 0x28, 0x2F, 0x27, 0x2B, 0x2C, 0x24, 0x2A, 0x25, 0x26, 0x21, 0x2D, 0x2E)
_EVENTS = (0x41, 0x46, 0x47, 0x48, 0x43, 0x44, 0x42, 0x49, 0x45)
_ENDS = (0xFB, 0xFC)
STEPS = (_ACTIONS, _EVENTS, _ACTIONS, _EVENTS, _ENDS)
"""The items of each step of a program made on the brick, as its file has them."""

_KEEPS_AND_CALLS = On.KEEPS | On.EXIT_CALLS
_LISTS = On.OPENS | On.KEYS_CALL

_MAIN = (
    Item((1,), On.ENTER_ONLY_CALLS | On.EXIT_GOES_ON, Function.OFF, first=1, common=1),
    Item((2,), On.EXIT_GOES_ON, first=1, common=1),
    Item((1, 1), menu=FILES, first=1, leads_to=1),
    Item((1, 2), menu=PROGRAM, first=1, leads_to=1),
    Item((1, 3), On.LOG, Function.LOG, menu=LOG, first=1, leads_to=1),
    Item((1, 4), menu=VIEW, first=1, leads_to=1),
    Item((1, 5), menu=RADIO, first=2, leads_to=1),
    Item((1, 6), menu=SETTINGS, first=1, leads_to=1),
    Item((1, 7), menu=TRY_ME, first=1, leads_to=1),
)
_FILES = (
    Item((1,), On(0), Function.LIST, PROGRAM_FILE, first=1, common=1),
    Item((2,), On(0), Function.LIST, ON_BRICK_FILE, first=1, common=1),
    Item((3,), On(0), Function.LIST, SOUND_FILE, first=1, common=1),
    Item((4,), On.LOG, Function.LIST, LOG_FILE, first=2),
    *(Item((kind, 1), _LISTS, Function.LIST, Call.SELECT, first=1) for kind in (1, 4)),
    Item((1, 1, 1), On.OPENS | On.KEEPS, Function.RUN, Call.RUN),
    Item((1, 1, 2), On.RADIO, first=1),
    Item((1, 1, 3), first=2),
    Item((4, 1, 1), first=2),
    Item((4, 1, 2), On.RADIO, first=1),
    *(Item((*sends, 1), _LISTS, Function.SEND, Call.SEND) for sends in ((1, 1, 2), (4, 1, 2))),
    *(Item((*deletes, 1), On.TWICE, Function.DELETE) for deletes in ((1, 1, 3), (4, 1, 1))),
    *(Item((*deletes, 2), On.ENTER_EXITS) for deletes in ((1, 1, 3), (4, 1, 1))),
)
_PROGRAM = (
    Item((1,), _LISTS, Function.PROGRAM, Call.TEXT, first=1),
    *(
        Item((*[1] * level, number), _KEEPS_AND_CALLS, Function.PROGRAM, code, first=1, common=1)
        for level, codes in enumerate(STEPS, 1)
        for number, code in enumerate(codes, 1)
    ),
    Item((*[1] * 6, 1), _KEEPS_AND_CALLS, Function.PROGRAM, Call.RUN),
    Item((*[1] * 6, 2), _KEEPS_AND_CALLS | On.ENTER_LEAVES),
    Item((*[1] * 6, 4), _KEEPS_AND_CALLS, Function.PROGRAM, Call.SAVE, first=2),
)


def _values(motors: Sequence[bool], function: Function, on: On, *, slow: int = 0, ports: int = 0) -> list[Item]:
    """Return the items of values of sensors and motors, and of their ports.

    Args:
        motors: For each value, whether it is one of motors.
        function: What they call.
        on: What is special about ports.
        slow: The item, if any, that calls the function to open.
        ports: Whether there is a level below the ports, and so the item of it that is shown first.
    """
    items = []
    for number, motor in enumerate(motors, 1):
        opens = On.OPENS if number == slow else On(0)
        items.append(Item((number,), On.KEEPS | opens, function, number, first=1, common=0 if motor else 1))
    with_ports = [(1, SENSOR_PORTS, PORTS)]
    with_ports += [(n, MOTOR_PORTS, PORTS + SENSOR_PORTS) for n, motor in enumerate(motors, 1) if motor]
    for value, count, first in with_ports:
        items += [Item((value, n + 1), on, function, first + n, first=ports, common=ports) for n in range(count)]
        if ports:
            chosen = On.ENTERS | On.THRICE
            items.append(Item((value, 1, 1), chosen, function, Call.SELECT, leads_to=len(motors) + 1))
    return items


_DONE = len(LOGGED) + 1
_LOG = (
    *_values([value.is_motor for value in LOGGED], Function.LOG, On.KEEPS, ports=1),
    Item((_DONE,), On.KEEPS, Function.LOG, Call.UPDATE, first=1),
    Item((_DONE, 1), On.ENTERS, Function.LOG, Call.TEXT, first=1),
    Item((_DONE, 1, 1), On.KEEPS | On.EXIT_CALLS | On.TWICE, Function.LOG, Call.RUN, first=2),
    Item((_DONE, 1, 1, 1), On.ENTER_LEAVES | On.NO_EXIT, Function.LOG, Call.DELETE),
    Item((_DONE, 1, 1, 2), On.NO_EXIT, Function.LOG, Call.SAVE, first=2),
)
_SETTINGS = (
    *(Item((number,), first=1) for number in (1, 2)),
    Item((3,), On(0), Function.VERSION),
    Item((4,), first=1),
    Item((1, 1), On.OPENS | On.KEYS_CALL | On.EXIT_CALLS | On.KEEPS, Function.VOLUME, Call.ENTER),
    Item((2, 1), On.OPENS | On.KEYS_CALL | On.KEEPS, Function.SLEEP, Call.ENTER),
    *(Item((page, number)) for page in (1, 2) for number in (2, 3)),
    *(
        Item((4, number), On.LOG if kind == LOG_FILE else On(0), Function.ERASE, kind, first=2, common=1)
        for number, kind in enumerate((PROGRAM_FILE, ON_BRICK_FILE, SOUND_FILE, LOG_FILE, TRY_FILE), 1)
    ),
    Item((4, 1, 1), On.OPENS | On.TWICE, Function.ERASE, Call.DELETE),
    Item((4, 1, 2), On.OPENS | On.ENTER_EXITS, Function.ERASE),
)
_TRY_ME = (
    Item((1,), On.ENTERS, Function.LIST, TRY_FILE, first=1),
    Item((1, 1), _LISTS | On.EXIT_LEAVES, Function.LIST, Call.SELECT, first=2),
    Item((1, 1, 1), first=2),
    Item((1, 1, 2), On.OPENS | On.KEEPS, Function.RUN, Call.RUN),
    Item((1, 1, 1, 1), On.TWICE, Function.DELETE),
    Item((1, 1, 1, 2), On.ENTER_EXITS),
)
_RADIO = (
    *(Item((number,), On.RADIO, first=1) for number in range(1, 5)),
    Item((5,), first=1),
    Item((1, 1), _LISTS, Function.SEARCH, Call.EXIT, first=1),
    Item((2, 1), On.ENTERS, first=1),
    Item((3, 1), _LISTS, Function.CONNECTIONS, Call.UPDATE, first=1),
    Item((4, 1), On(0), Function.VISIBILITY, Call.ON),
    Item((4, 2), On(0), Function.VISIBILITY, Call.OFF),
    Item((5, 1), On.EXIT_LEAVES, Function.SWITCH, Call.ON),
    Item((5, 2), On.RADIO | On.EXIT_LEAVES, Function.SWITCH, Call.OFF),
    Item((1, 1, 1), _LISTS | On.TWICE, Function.DEVICES, Call.SELECT, first=1),
    Item((2, 1, 1), On.OPENS_KNOWN | On.KEYS_CALL | On.TWICE, Function.DEVICES, Call.SELECT, first=2),
    Item((3, 1, 1), On(0), Function.CONNECTIONS, Call.DISCONNECT),
    Item((1, 1, 1, 1), _LISTS, Function.SEND, Call.CONNECT),
    Item((2, 1, 1, 1), On(0), Function.DEVICES, Call.DELETE),
    Item((2, 1, 1, 2), first=1),
    Item((2, 1, 1, 2, 1), _LISTS | On.TWICE, Function.SEND, Call.CONNECT),
)


def menus(*, modern: bool) -> Sequence[Sequence[Item]]:
    """Return the items of each menu, in their order, for firmware that shows the newer sensors or the older ones."""
    motors = [value is None for value in shown_values(modern=modern)]
    view = _values(motors, Function.VIEW, On.KEEPS, slow=5 if modern else 1)
    opens = Function.VIEW if modern else None
    main = [item._replace(function=opens) if item.menu == VIEW else item for item in _MAIN]
    return main, _FILES, _PROGRAM, _LOG, view, _SETTINGS, _TRY_ME, _RADIO
