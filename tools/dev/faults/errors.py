"""Errors by the hundred thousand in one process: none may leak memory."""

from __future__ import annotations

import gc
import logging
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from behaviors.mission import MissionError, load_mission
from firmware_protocol.errors import (
    AddressError,
    BrickError,
    ConfigError,
    LinkLost,
    LinkTimeout,
    LocalProtocolError,
)
from firmware_protocol.system import OpenRead
from nxtdrive.brick import Brick
from nxtdrive.transports import open_transport
from sim_backend.simulation import Simulation
from sim_backend.world.loading import load_world

from .campaign import Campaign, Tally, Violation
from .memory import least_growth
from .wire import USB, Wire
from .wire_transports import plug_in

COUNT = 100_000
WARM = 500
GROWTH_BLOCKS = 5000
"""Growth of the number of Python's objects, roughly; half a megabyte."""
TRACED, LEFT_BYTES = 1000, 10_000
"""For two rows of errors at the end all allocations are traced, which takes five times as long, and what both leave
is limited: to a megabyte in 100,000."""
TIMEOUT_MS = 30

Provoke = Callable[[Brick, Wire, Path], object]


def _silent(brick: Brick, wire: Wire, _folder: Path) -> None:
    wire.silence(TIMEOUT_MS)
    brick.request(OpenRead("missing.txt"), TIMEOUT_MS / 1000)


def _lost(brick: Brick, wire: Wire, _folder: Path) -> None:
    wire.pull("pulled for 0.3 s")
    try:
        brick.request(OpenRead("missing.txt"))
    finally:
        wire.simulation.advance(301)
        brick.link.reconnect()


def _lost_in_motion(brick: Brick, wire: Wire, _folder: Path) -> None:
    motion = brick.motor("A").run_angle(300, 90, wait=False)
    wire.pull("pulled for 0.3 s")
    try:
        motion.join()
    finally:
        wire.simulation.advance(301)
        brick.link.reconnect()


PROVOKED: dict[str, tuple[Provoke, type[Exception]]] = {
    "refusal": (lambda brick, *_: brick.request(OpenRead("missing.txt")), BrickError),
    "missing sensor": (lambda brick, *_: brick.i2c(2).read(0, 8), BrickError),
    "no program": (lambda brick, *_: brick.programs.write_message(1, "hello"), BrickError),
    "value out of range": (lambda brick, *_: brick.motor("A").dc(1000), LocalProtocolError),
    "timeout": (_silent, LinkTimeout),
    "lost link": (_lost, LinkLost),
    "lost link in a motion": (_lost_in_motion, LinkLost),
    "bad address": (lambda *_: open_transport("sim://open?latency_ms=fast"), AddressError),
    "bad mission": (lambda _brick, _wire, folder: load_mission(folder / "mission.toml", [folder]), MissionError),
    "bad world": (lambda _brick, _wire, folder: load_world(folder / "world.toml"), ConfigError),
}
"""Errors by name: what provokes each, and its class."""


def trials(_seed: int, numbers: range) -> Tally:
    """Provoke these errors, one kind after the other, in one process."""
    logging.getLogger("nxtdrive").setLevel(logging.ERROR)  # each lost link is a warning
    tally = Tally()
    wire = Wire(Simulation("open", seed=1), USB, None)
    with tempfile.TemporaryDirectory() as name, Brick(plug_in(wire)) as brick:
        folder = Path(name)
        for file in ("mission.toml", "world.toml"):
            (folder / file).write_text("[mission]\nname = 7\n[floor]\nsize_mm = 'large'\n", encoding="utf-8")
        warm, most, rest = numbers[:WARM], numbers[WARM : -2 * TRACED - WARM], numbers[-2 * TRACED - WARM :]
        _provoke(brick, wire, folder, warm, tally)
        blocks = _blocks()
        _provoke(brick, wire, folder, most, tally)
        if (grown := _blocks() - blocks) > GROWTH_BLOCKS:
            tally.violations.append(Violation(numbers[-1], f"{len(most)} errors left {grown} objects behind"))
        rows = (rest[:WARM], rest[WARM:-TRACED], rest[-TRACED:])
        if (left := least_growth(partial(_provoke, brick, wire, folder, row, tally) for row in rows)) > LEFT_BYTES:
            tally.violations.append(Violation(numbers[-1], f"{TRACED} errors left {left} bytes behind"))
    return tally


def _blocks() -> int:
    gc.collect()
    return sys.getallocatedblocks()


def _provoke(brick: Brick, wire: Wire, folder: Path, numbers: range, tally: Tally) -> None:
    names = list(PROVOKED)
    for number in numbers:
        kind = names[number % len(names)]
        provoke, expected = PROVOKED[kind]
        wire.exchanges.clear()
        try:
            provoke(brick, wire, folder)
        except expected:
            tally.outcomes[kind] += 1
        except Exception as error:  # noqa: BLE001 - whatever else it is violates the guarantee
            tally.violations.append(Violation(number, f"{kind}: {error!r}"))
        else:
            tally.violations.append(Violation(number, f"{kind}: no error"))


CAMPAIGN = Campaign(
    "After 100,000 errors in one process, less than a megabyte is left behind.",
    "errors",
    count=COUNT,
    batch=COUNT,
    run=trials,
)
