"""Campaign: a user at the keys of the simulated brick while a program writes to its menus."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

from firmware_protocol.direct import StartProgram, StopProgram
from firmware_protocol.iomap import UI
from firmware_protocol.system import Delete, DeleteUserFlash, SetBrickName
from firmware_protocol.telegram import Command
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import FIRMWARES

from .assembler import sample_program, store
from .campaign import Campaign, Tally, Violation
from .programs import wrong_reply

BATCH = 80
"""Actions at one brick."""

ENTER, LEFT, RIGHT, EXIT = 8, 4, 2, 1
"""The buttons, as bits of the Button module's states."""
KEYS = (ENTER, ENTER, ENTER, LEFT, RIGHT, EXIT)
PATHS: tuple[tuple[int, ...], ...] = (
    (),
    (ENTER, ENTER, ENTER),  # a file of My Files
    (RIGHT, *[ENTER] * 7),  # a program made on the brick
    (RIGHT, RIGHT, ENTER, ENTER, ENTER),  # Datalog, and next View
    (RIGHT, RIGHT, RIGHT, ENTER, ENTER, ENTER),
    (LEFT, ENTER),  # Bluetooth and Settings
    (LEFT, LEFT, ENTER, ENTER, ENTER),
    (LEFT, LEFT, LEFT, ENTER),
)
"""Clicks that lead from the main menu to pages with states of their own."""

CLICK_MS = 1, 4, 6
"""How long a button is held; the firmware takes a sample every two passes."""
PAUSES_MS = (0, 1, 3, 5, 10, 30, 30, 300)
LONG_PAUSES_MS = (700, 2700)
"""Between two actions, and the long pauses in which messages and searches of the menus end."""
LONG_PAUSES = 0.02
"""Share of the pauses that are long."""

STEPS = b"\x08\0\0\5\5\0\0\0\x23\x46\x29\x47\xfb"
"""A program made on the brick, as it stores one."""
FILES = {
    "a.rxe": sample_program(),
    "b.rpg": STEPS,
    "Untitled.rpg": STEPS,
    "Program.tmp": STEPS,
    "c.rso": bytes(60),
    "d.log": bytes(20),
    "e.rtm": bytes(9),
    "RPGReader.sys": sample_program(),
}
STARTED = ("a.rxe", "b.rpg", "c.rso", "d.log", "gone.rxe")

STATES = 19
"""States from this one on have no meaning."""

_Action = tuple[str, Callable[[SimBrick], object], int]
"""What is done, in words; what does it; and for how long the brick runs then, in ms."""


def run(seed: int, numbers: range) -> Tally:
    """Do these actions, each batch at a brick of its own; the first ones lead to some page."""
    tally = Tally()
    rng = Random(f"{seed} {numbers.start // BATCH}")  # noqa: S311 - repeatable
    brick, path = _begin(rng)
    for number in numbers:
        name, act, pause_ms = _step(path.pop(0)) if path else _action(rng)
        try:
            act(brick)
            brick.tick(pause_ms)
            broken = wrong_reply(brick)
        except Exception as error:  # noqa: BLE001 - that is what the campaign looks for
            broken = repr(error)
        if broken:
            tally.violations.append(Violation(number, f"{name}, firmware {brick.firmware}: {broken}"))
            brick, path = _begin(rng)
        else:
            tally.outcomes[name] += 1
    return tally


def _begin(rng: Random) -> tuple[SimBrick, list[int]]:
    """Return a brick with some files, and the clicks that lead to some page."""
    brick = SimBrick(firmware=rng.choice(FIRMWARES))
    for name in rng.sample(sorted(FILES), rng.randint(0, len(FILES))):
        store(brick, name, FILES[name])
    return brick, [*rng.choice(PATHS)]


def _step(key: int) -> _Action:
    """Return a click that the menus cannot miss."""
    return "a click", lambda brick: _click(brick, key, max(CLICK_MS)), max(CLICK_MS) * 5


def _action(rng: Random) -> _Action:
    """Draw what is done next."""
    pause_ms = rng.choice(LONG_PAUSES_MS if rng.random() < LONG_PAUSES else PAUSES_MS)
    match rng.choices(("click", "state", "button", "flags", "telegram"), (60, 15, 5, 5, 15))[0]:
        case "click":
            key, held_ms = rng.choice(KEYS), rng.choice(CLICK_MS)
            return "a click", lambda brick: _click(brick, key, held_ms), pause_ms
        case "telegram":
            return "a telegram", _sender(_telegram(rng)), pause_ms
        case field:
            most = {"state": STATES, "button": 6, "flags": 256}[field]
            return f"a written {field}", _sender(UI.field(field.capitalize()).write(rng.randrange(most))), pause_ms


def _telegram(rng: Random) -> Command[Any]:
    commands: tuple[Callable[[], Command[Any]], ...] = (
        lambda: StartProgram(rng.choice(STARTED)),
        StopProgram,
        lambda: Delete(rng.choice(sorted(FILES))),
        DeleteUserFlash,
        lambda: SetBrickName("x"),
    )
    return rng.choice(commands)()


def _sender(command: Command[Any]) -> Callable[[SimBrick], object]:
    return lambda brick: brick.receive(command.encode())


def _click(brick: SimBrick, key: int, held_ms: int) -> None:
    brick.button.hold(key)
    brick.tick(held_ms)
    brick.button.hold(0)


CAMPAIGN = Campaign(
    guarantee="No key, and nothing that is written to the menus meanwhile, makes the simulated brick fail.",
    unit="actions",
    count=500_000,
    batch=BATCH,
    run=run,
)
