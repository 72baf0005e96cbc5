"""A day of virtual time on one link: polling, missions, lost links, idling."""

from __future__ import annotations

import gc
import logging
import math
import sys
from contextlib import suppress

from behaviors.executive import Ending, Executive
from behaviors.ports import Ports
from firmware_protocol.direct import KeepAlive
from firmware_protocol.errors import Interrupted, NXTError
from firmware_protocol.iomap import COMMAND, UI
from nxtdrive.brick import Brick
from nxtdrive.link.core import LinkState
from nxtdrive.link.link import LONGEST_SILENCE_S
from nxtdrive.link.reconnect import PROBE_S
from nxtdrive.mission.body import MissionClock, build_body
from nxtdrive.mission.vision import geometric_vision
from sim_backend.simulation import Simulation

from .campaign import Campaign, Tally, Violation
from .link_missions import PROFILES, mission_of
from .memory import traced
from .wire import USB, Wire
from .wire_transports import plug_in

HOUR_S = 3600.0
HOURS = 24
POLLS, POLL_S = 600, 1.0
WRAP_MS = 1 << 32
BEFORE_WRAP_MS = 90 * 60 * 1000
"""The brick's counter of milliseconds, 32 bits, wraps in the second hour."""
SLEEP_MIN = 10
WARM_HOURS = 2
GROWTH_BLOCKS = 1000
"""Growth of the number of Python's objects, roughly, after the second hour; a leak of one per poll would exceed it."""
TRACED_EVERY, LEFT_BYTES = 6, 50_000
"""One hour out of this number traces all allocations, which takes five times as long, and limits what it leaves."""
SPARE_TELEGRAMS = 12
"""Tolerance of an hour's number of keep-alive telegrams: lost links, a mission and reconnections change it."""
KEEP_ALIVE = KeepAlive.opcode


def trials(_seed: int, numbers: range) -> Tally:
    """Simulate these hours, one after the other, on one link."""
    logging.getLogger("nxtdrive").setLevel(logging.ERROR)  # each lost link is a warning
    wire = Wire(Simulation("open", seed=1), USB, None)
    _age(wire.simulation)
    tally, warm_blocks = Tally(), math.inf
    with Brick(plug_in(wire)) as brick:
        brick.link.keep_alive()
        brick.link.reconnecting = True
        for number in numbers:
            if number % TRACED_EVERY == TRACED_EVERY - 1:
                with traced() as used:
                    wrong = _hour(brick, wire, number)
                    if used() > LEFT_BYTES:
                        wrong.append(f"an hour left {used()} bytes behind")
            else:
                wrong = _hour(brick, wire, number)
            gc.collect()
            if number == WARM_HOURS - 1:
                warm_blocks = sys.getallocatedblocks()
            elif (grown := sys.getallocatedblocks() - warm_blocks) > GROWTH_BLOCKS:
                wrong.append(f"{grown} more objects than after {WARM_HOURS} hours")
            tally.outcomes["hour without a finding"] += not wrong
            tally.violations += [Violation(number, each) for each in wrong]
        if len(numbers) > WARM_HOURS:
            tally.outcomes["counter of the brick that wrapped"] += _tick_ms(brick) < WRAP_MS - BEFORE_WRAP_MS
    return tally


def _age(simulation: Simulation) -> None:
    """Set the brick's counter as if it had been on for almost 50 days."""
    brick, sleep = simulation.brick, UI.field("SleepTimeout")
    brick.receive(sleep.write(0).encode())
    brick.tick(WRAP_MS - BEFORE_WRAP_MS - brick.now_ms)
    brick.receive(KeepAlive().encode())  # restarts its sleep timer
    brick.receive(sleep.write(SLEEP_MIN).encode())


def _tick_ms(brick: Brick) -> int:
    field = COMMAND.field("Tick")
    value: int = field.decode(brick.request(field.read()).data)
    return value


def _hour(brick: Brick, wire: Wire, number: int) -> list[str]:
    """Simulate an hour; return any violations."""
    begun_s, wrong = brick.now(), []
    for work in (_poll, _lose, pursue, _idle):
        try:
            wrong += work(brick, wire, number, begun_s + HOUR_S)
        except NXTError as error:
            wrong.append(f"{work.__name__} ended with {error!r}")
    if abs(brick.now() - begun_s - HOUR_S) > 0.01:
        wrong.append(f"the hour took {brick.now() - begun_s} s")
    asked = sum(each.request[1:2] == bytes((KEEP_ALIVE,)) for each in wire.exchanges)
    wire.exchanges.clear()  # our own notes
    due = HOUR_S / PROBE_S + HOUR_S / LONGEST_SILENCE_S
    if abs(asked - due) > SPARE_TELEGRAMS:
        wrong.append(f"{asked} keep-alive telegrams in an hour, not {due:.0f}")
    if wire.simulation.motors_turn() or wire.simulation.brick.powered_off:
        wrong.append("motors turn, or the brick is off")
    return wrong


def _poll(brick: Brick, _wire: Wire, _number: int, _end_s: float) -> list[str]:
    sonar, begun_s = brick.ultrasonic(4), brick.now()
    for _ in range(POLLS):
        due_s = brick.now() + POLL_S
        _ = sonar.distance_mm, brick.touch(1).pressed, brick.battery_v, brick.motor("A").angle
        brick.sleep(due_s - brick.now())
    took_s = brick.now() - begun_s
    return [] if abs(took_s - POLLS * POLL_S) < POLLS * 0.002 else [f"{POLLS} s of polling took {took_s:.3f} s"]


def _lose(brick: Brick, wire: Wire, _number: int, _end_s: float) -> list[str]:
    wire.pull("pulled for 2 s")
    end_s = brick.now() + 10
    while brick.now() < end_s:
        with suppress(Interrupted):  # once motors were driven, a loss is reported
            brick.sleep(end_s - brick.now())
    return [] if brick.link.state is LinkState.OPEN else ["the link is not open 10 s after a loss of 2 s"]


def pursue(brick: Brick, wire: Wire, number: int, _end_s: float) -> list[str]:
    """Pursue a mission, then go back to where it began; the link is lost in the middle of every other mission."""
    mission, clock = mission_of(PROFILES[number % 2]), MissionClock(brick)
    body = build_body(brick, mission)
    vision = geometric_vision(brick, mission, wire.simulation.webcam)
    if number % 4 > 1:
        wire.simulation.at(wire.simulation.now_ms + 6000, lambda: wire.pull("pulled for 2 s"))
    brick.link.reconnect_timeout_s = 0.0
    report = Executive(mission, Ports(body, vision, clock)).run()
    brick.link.reconnect_timeout_s = 30.0
    body.straight(-body.pose().x_mm)
    body.turn(-body.pose().heading_deg)
    return [] if report.ending is Ending.ACHIEVED else [f"the mission ended with {report.ending}: {report.error}"]


def _idle(brick: Brick, _wire: Wire, _number: int, end_s: float) -> list[str]:
    brick.sleep(end_s - brick.now())
    return []


CAMPAIGN = Campaign(
    "In a day of polling, missions and lost links on one link, memory does not grow, timers do not drift, the brick "
    "stays awake, and its counter of milliseconds may wrap.",
    "hours",
    count=HOURS,
    batch=HOURS,
    run=trials,
)
