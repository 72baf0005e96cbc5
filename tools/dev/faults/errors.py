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


def _refused(brick: Brick, _wire: Wire, _folder: Path) -> None:
    brick.request(OpenRead("missing.txt"))


def _sensor_missing(brick: Brick, _wire: Wire, _folder: Path) -> None:
    brick.i2c(2).read(0, 8)


def _no_program(brick: Brick, _wire: Wire, _folder: Path) -> None:
    brick.programs.write_message(1, "hello")


def _out_of_range(brick: Brick, _wire: Wire, _folder: Path) -> None:
    brick.motor("A").dc(1000)


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


def _bad_address(_brick: Brick, _wire: Wire, _folder: Path) -> None:
    open_transport("sim://open?latency_ms=fast")


def _bad_mission(_brick: Brick, _wire: Wire, folder: Path) -> None:
    load_mission(folder / "mission.toml", [folder])


def _bad_world(_brick: Brick, _wire: Wire, folder: Path) -> None:
    load_world(folder / "world.toml")


PROVOKED: dict[str, tuple[Provoke, tuple[type[Exception], ...]]] = {
    "refusal": (_refused, (BrickError,)),
    "missing sensor": (_sensor_missing, (BrickError,)),
    "no program": (_no_program, (BrickError,)),
    "value out of range": (_out_of_range, (LocalProtocolError,)),
    "timeout": (_silent, (LinkTimeout,)),
    "lost link": (_lost, (LinkLost,)),
    "lost link in a motion": (_lost_in_motion, (LinkLost,)),
    "bad address": (_bad_address, (AddressError,)),
    "bad mission": (_bad_mission, (MissionError,)),
    "bad world": (_bad_world, (ConfigError,)),
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
