"""Campaign: link faults at every telegram of short driver programs and missions, checked against the ground truth."""

from __future__ import annotations

import logging
import math
import traceback
from collections.abc import Sequence
from functools import cache
from itertools import product
from typing import Any

from firmware_protocol.errors import LinkLost, NXTError
from firmware_protocol.telegram import REPLY_HEADER, Command
from nxtdrive.brick import Brick
from nxtdrive.motion.lease import LEASE_DEG, LEASE_S
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S
from sim_backend.firmware.motors.output import Output
from sim_backend.simulation import Simulation

from .assembler import store
from .campaign import Campaign, Tally, Violation
from .link_missions import mission_trial
from .link_programs import PROGRAMS, STORED, WRITTEN, Action, Trial
from .wire import KINDS, TRANSPORTS, Exchange, Fault, Wire
from .wire_transports import plug_in

MISSION_EVERY = 60
"""One trial out of this number is a mission, which takes as long as a hundred others."""
GOLDEN = (math.sqrt(5) - 1) / 2
"""Its multiples, modulo 1, are spread evenly, whatever their number."""
COMBINATIONS = tuple(product(PROGRAMS, TRANSPORTS, KINDS, (False, True)))
"""Program, transport, kind of fault, and whether the link reconnects."""

STILL_MS = 2000
"""A lease is 0.6 s at the commanded speed, and a motor then coasts for half a second (docs/motion.md)."""
WATCHED_MS = 300
UNDER_WAY_MS = 5
"""Telegrams that were in transit when the brick fell silent have arrived by then."""
COAST_S = 0.2
SPARE_DEG = 15.0
"""A motor without power coasts with a time constant of 0.15 s, and the regulator may be some degrees ahead."""
DOUBLED_MS = 1100
"""How old a value may be after a reply that arrived twice (docs/connecting.md)."""
LONGEST_CALL_S = 40.0
"""Longest time of a request: it waits 30 s for a lost link, and then for its reply."""


class ReplyChecker:
    """Compares the reply to each request of a link with the one that the brick sent for this very request.

    Args:
        brick: The brick whose requests are watched.
        wire: What the brick received and sent.
    """

    def __init__(self, brick: Brick, wire: Wire) -> None:
        self.wrong: list[str] = []
        self._wire = wire
        self._ask = brick.link.request
        self._now = brick.now
        vars(brick.link)["request"] = vars(brick)["request"] = self.request

    def request(self, command: Command[Any], timeout_s: float | None = None) -> Any:  # noqa: ANN401 - any reply
        """Make the request."""
        first, begun_s = len(self._wire.exchanges), self._now()
        since_ms = begun_s * 1000 - DOUBLED_MS
        try:
            reply = self._ask(command, timeout_s)
        finally:
            if (took_s := self._now() - begun_s) > LONGEST_CALL_S:
                self.wrong.append(f"{command} took {took_s:.1f} s")
        sent = self._wire.exchanges
        if self._wire.duplicates:  # within this time, the second copy of a reply may pass for that to a like request
            first = min(first, next((i for i, each in enumerate(sent) if each.time_ms >= since_ms), first))
        if not any(_answers(each, command, reply, exact=not self._wire.duplicates) for each in sent[first:]):
            self.wrong.append(f"{reply} is the reply to {command}, which the brick did not send for it")
        return reply


def _answers(exchange: Exchange, command: Command[Any], reply: object, *, exact: bool) -> bool:
    """Return whether the brick sent `reply` for this command, or without `exact` for one of the same kind."""
    compared = None if exact else REPLY_HEADER - 1
    if exchange.reply is None or exchange.request[:compared] != command.encode()[:compared]:
        return False
    try:
        return bool(command.decode_reply(exchange.reply) == reply)
    except NXTError:
        return False


class StandstillMonitor:
    """Records motors that still turn although the brick has been unreachable for longer than a lease.

    Args:
        wire: The wire, whose losses are watched.
    """

    def __init__(self, wire: Wire) -> None:
        self.wrong: list[str] = []
        self._wire, self._simulation = wire, wire.simulation
        wire.on_loss = self._lost

    def _lost(self, until_ms: int) -> None:
        simulation, lost_ms = self._simulation, self._simulation.now_ms
        before = self._limits_deg()

        def begin() -> None:
            begun, limits = self.rotations(), list(map(max, before, self._limits_deg()))
            simulation.at(lost_ms + STILL_MS, lambda: self._watch(begun, limits))

        if until_ms > lost_ms + STILL_MS + WATCHED_MS:
            simulation.at(lost_ms + UNDER_WAY_MS, begin)

    def _limits_deg(self) -> list[float]:
        return [_limit_deg(output) for output in self._simulation.brick.output.outputs]

    def rotations(self) -> list[float]:
        """Return the angle of each motor, independent of the brick's counters."""
        return [output.plant.angle for output in self._simulation.brick.output.outputs]  # type: ignore[union-attr]

    def _watch(self, begun: list[float], limits: list[float]) -> None:
        for motor, now_deg, begun_deg, limit_deg in zip("ABC", self.rotations(), begun, limits, strict=True):
            if abs(now_deg - begun_deg) > limit_deg:
                self.wrong.append(
                    f"motor {motor} turned by {now_deg - begun_deg:.0f} degrees after the loss, at most {limit_deg:.0f}"
                )
        self.watch("the loss of the link")

    def watch(self, since: str) -> None:
        """Check the motors after a moment; they must be at rest."""
        before = self.rotations()

        def compare() -> None:
            for motor, now_deg, before_deg in zip("ABC", self.rotations(), before, strict=True):
                if abs(now_deg - before_deg) > 1.0:
                    self.wrong.append(f"motor {motor} turns {(STILL_MS + WATCHED_MS) / 1000} s after {since}")

        self._simulation.at(self._simulation.now_ms + WATCHED_MS, compare)


def _limit_deg(output: Output) -> float:
    """Return how far a motor may turn without another command: during its lease, and then by its momentum."""
    commanded = abs(output.power) / 100 * FULL_SPEED_DEG_S
    turning: float = abs(output.plant.free_speed)  # type: ignore[union-attr]  # the motors of a `Simulation` have it
    return max(LEASE_DEG, commanded * LEASE_S) + max(commanded, turning) * COAST_S + SPARE_DEG


def new_simulation() -> Simulation:
    """Return a robot in front of a wall, with files on its brick."""
    simulation = Simulation("open", seed=1)
    for name, content in STORED.items():
        store(simulation.brick, name, content)
    return simulation


def run_program(actions: Sequence[Action], wire: Wire, *, reconnecting: bool = False) -> tuple[str, list[str]]:
    """Run a program that continues with its next action after each error; return the outcome and any violations."""
    simulation, still, errors = wire.simulation, StandstillMonitor(wire), set()
    witness: ReplyChecker | None = None
    trial: Trial | None = None
    try:
        with Brick(plug_in(wire), reconnecting=reconnecting) as brick:
            witness = ReplyChecker(brick, wire)
            trial = Trial(simulation, brick, brick.rover())
            for action in actions:
                try:
                    action(trial)
                except NXTError as error:
                    errors.add(type(error).__name__)
                    if isinstance(error, LinkLost) and not reconnecting:
                        raise
    except NXTError as error:
        errors.add(type(error).__name__)
    except Exception:  # noqa: BLE001 - anything else is a defect
        still.wrong.append(traceback.format_exc(limit=-3))
    simulation.advance(STILL_MS)
    still.watch("the end of the program")
    simulation.advance(WATCHED_MS + 1)
    values = [] if witness is None else witness.wrong
    if trial is not None and not wire.undetectable:
        values = values + trial.wrong
    return ", ".join(sorted(errors)) or "no error", still.wrong + values


def _files_wrong(simulation: Simulation) -> list[str]:
    """Return the violations in the brick's files: one that was changed, or a part of one."""
    files = {file.name: bytes(file.content) for file in simulation.brick.loader.flash.files}
    wrong = [f"{name} was changed" for name, content in STORED.items() if files.get(name) != content]
    if files.get("new.txt", WRITTEN) != WRITTEN:
        wrong.append("a part of new.txt was left on the brick")
    return wrong


@cache
def _length(program: str, transport: str) -> int:
    """Return the number of telegrams of a program without faults."""
    wire = Wire(new_simulation(), transport, None)
    run_program(PROGRAMS[program], wire, reconnecting=False)
    return wire.count


def _program_trial(seed: int, number: int) -> tuple[str, list[str]]:
    program, transport, kind, reconnecting = COMBINATIONS[number % len(COMBINATIONS)]
    share = ((number // len(COMBINATIONS) + seed) * GOLDEN + number * GOLDEN**2) % 1
    fault = Fault(kind, int(share * _length(program, transport)), draw=seed)
    wire = Wire(new_simulation(), transport, fault)
    outcome, wrong = run_program(PROGRAMS[program], wire, reconnecting=reconnecting)
    wrong += _files_wrong(wire.simulation)
    what = f"{program} over {transport}, {kind} at telegram {fault.at}, reconnecting: {reconnecting}"
    return f"program: {outcome}", [f"{what}: {each}" for each in wrong]


def trials(seed: int, numbers: range) -> Tally:
    """Run these trials."""
    logging.getLogger("nxtdrive").setLevel(logging.ERROR)  # each lost link is a warning
    tally = Tally()
    for number in numbers:
        if number % MISSION_EVERY == MISSION_EVERY - 1:
            outcome, wrong = mission_trial(seed, number // MISSION_EVERY)
        else:
            outcome, wrong = _program_trial(seed, number - number // MISSION_EVERY)
        if wrong:
            more = f" (and {len(wrong) - 1} more)" if wrong[1:] else ""
            tally.violations.append(Violation(number, wrong[0] + more))
        else:
            tally.outcomes[outcome] += 1
    return tally


CAMPAIGN = Campaign(
    "Whatever happens to the link, at any telegram, motors stand still within a lease and their coasting, no reply is "
    "taken for the reply to another request, each call ends in time with a value or an error of the driver, and a "
    "mission continues or ends as guaranteed with a complete run folder.",
    "link faults",
    count=20_000,
    batch=60,
    run=trials,
)
