"""Campaign: whole missions in random rooms with random robots, parameters, events and faults."""

from __future__ import annotations

import contextlib
import io
import logging
import math
import tempfile
import time
import traceback
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import cast

import numpy as np

from behaviors.journal import Record, RecordKind
from behaviors.observers import Observers
from behaviors.ports import Point
from behaviors.profile_names import ADAPTIVE
from behaviors.recoveries import CHANGE_TARGET
from firmware_protocol.errors import NXTError
from nxtdrive.brick import Brick
from nxtdrive.cli.main import main
from nxtdrive.recording.run_folder import JOURNAL
from sim_backend.evaluation import scene
from sim_backend.scenarios.floor_plan import Goal
from sim_backend.simulation import Simulation

from .campaign import Campaign, Tally, Violation
from .link_missions import NO_BRICK, SETTING_UP, STILL_MS, pursue
from .random_missions import RandomMission, draw
from .wire import Wire
from .wire_transports import plug_in

CAMERA_EVERY, TWICE_EVERY = 15, 5
"""One mission out of these numbers renders frames; is repeated."""
SAME_PLACE_MM, MIN_PAUSE_S, MAX_REPEATS = 250.0, 1.0, 2
"""docs/adaptive.md: what counts as one place, the pause between decisions there, and choices of one recovery there."""
CLAIM_MM, CLAIM_DEG, MOVED_S = 700.0, 80.0, 3.0
"""Farthest and most oblique stop that counts, with a margin, and how long ago the print may have left."""
LONGEST_S = 120.0
"""Processor time of a mission; minutes of simulated time take seconds."""


@dataclass
class TruthMonitor:
    """Notes what a mission claims and decides, with the truth of that moment."""

    simulation: Simulation
    trial: RandomMission
    wrong: list[str] = field(default_factory=list)
    choices: list[tuple[Record, Point]] = field(default_factory=list)
    recent: list[dict[str, Goal]] = field(default_factory=list)
    here: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        self._watch()

    def __call__(self, record: Record) -> None:
        """Note a record of the journal."""
        if isinstance(pose := record.data.get("pose"), list):
            x_mm, y_mm, _ = cast("list[float]", pose)
            self.here = (x_mm, y_mm)  # by odometry: a robot cannot measure how its wheels slip
        if record.kind is RecordKind.CHOICE:
            self.choices.append((record, self.here))
        claims = record.kind is RecordKind.TRANSITION and record.data["to"] == "reached"
        if claims and self.trial.described and not self._is_at(record.target):
            here, there = self.simulation.truth.pose, self._goals().get(record.target)
            self.wrong.append(f"wrong stop at {record.time_s} s: {record.target} is at {there}, the robot at {here}")

    def _goals(self) -> dict[str, Goal]:
        """Return where a stop counts at this moment, with margins."""
        goals = scene(self.simulation).goals
        return {name: replace(goal, reach_mm=CLAIM_MM, reach_deg=CLAIM_DEG) for name, goal in goals.items()}

    def _watch(self) -> None:
        now_ms = self.simulation.now_ms
        self.recent = [*self.recent[-round(MOVED_S * 5) :], self._goals()]
        self.simulation.at(now_ms + 200, self._watch)

    def _is_at(self, target: str) -> bool:
        here = np.array(self.simulation.truth.pose[:2])
        return any(goals[target].covers(here) for goals in self.recent if target in goals)

    def livelocks(self) -> list[str]:
        """Return the decisions that the rules of docs/adaptive.md forbid."""
        wrong = list[str]()
        for (one, here), (other, there) in pairwise(self.choices):
            pause_s = other.time_s - one.time_s
            if pause_s < MIN_PAUSE_S and one.target == other.target and math.dist(here, there) < SAME_PLACE_MM:
                wrong.append(f"two decisions within {pause_s:.3f} s at {other.time_s} s")
        return wrong + (self._repeats() if self.trial.mission.mission.profile == ADAPTIVE else [])

    def _repeats(self) -> list[str]:
        """Return the recoveries that are one too many at one place after one kind of failure."""
        wrong, run = list[str](), 0
        first: tuple[tuple[str, object], Point] | None = None
        for record, place in self.choices:
            if record.data["choice"] == CHANGE_TARGET.name:
                first, run = None, 0
                continue
            known = record.data["evidence"]
            failed = (record.target, known["reason"] if isinstance(known, dict) else None)
            same = first is not None and first[0] == failed and math.dist(first[1], place) < SAME_PLACE_MM
            first, run = (first, run + 1) if same else ((failed, place), 1)
            if run > MAX_REPEATS:
                wrong.append(f"recovery number {run} in a row at one place after {failed} at {record.time_s} s")
        return wrong


def trials(seed: int, numbers: range) -> Tally:
    """Perform these missions."""
    logging.getLogger("nxtdrive").setLevel(logging.ERROR)
    tally = Tally()
    for number in numbers:
        with tempfile.TemporaryDirectory() as folder:
            begun_s = time.process_time()
            outcome, wrong = trial(seed, number, Path(folder))
            took_s = time.process_time() - begun_s
        tally.longest_s = max(tally.longest_s, took_s)
        if took_s > LONGEST_S:
            wrong.append(f"it took {took_s:.0f} s of processor time")
        tally.outcomes[outcome] += 1
        tally.violations += [Violation(number, f"{outcome}: {each}") for each in wrong]
    return tally


def trial(seed: int, number: int, folder: Path) -> tuple[str, list[str]]:
    """Perform one mission, some twice; return its outcome and any violations."""
    drawn = draw(seed, number, folder, camera=number % CAMERA_EVERY == CAMERA_EVERY - 1)
    outcome, wrong = run_mission(drawn, folder / "run")
    if outcome != NO_BRICK and (folder / "run" / JOURNAL).exists():
        wrong += _unreadable(folder / "run")
    if number % TWICE_EVERY == 0:
        run_mission(drawn, folder / "again")
        one, other = (folder / each / JOURNAL for each in ("run", "again"))
        if one.read_bytes() != other.read_bytes():
            wrong.append("the same mission again has another journal")
    return f"{drawn.mission.mission.profile}: {outcome}", wrong


def run_mission(drawn: RandomMission, folder: Path) -> tuple[str, list[str]]:
    """Perform a mission; return how it ended and any violations."""
    simulation, outcome = Simulation(drawn.world, seed=drawn.seed), "broken"
    simulation.webcam.unplugged_ms = drawn.camera_lost_ms
    wire = Wire(simulation, drawn.transport, drawn.fault, drawn.latency_ms)
    monitor, observers = TruthMonitor(simulation, drawn), Observers()
    observers.add("monitor", monitor)
    folder.mkdir()
    try:
        with Brick(plug_in(wire)) as brick:
            brick.link.keep_alive()
            brick.link.reconnect_timeout_s, brick.link.reconnecting = 0.0, True
            report = pursue(brick, drawn.mission, folder, observers, camera=drawn.camera)
        outcome = report.ending.value
        if report.duration_s > drawn.mission.mission.time_limit_s + 60 + drawn.mission.mission.reconnect_timeout_s:
            monitor.wrong.append(f"it lasted {report.duration_s:.1f} s")
    except NXTError as error:
        outcome = NO_BRICK if wire.count < SETTING_UP else f"broken by {type(error).__name__}"
        if outcome != NO_BRICK:
            monitor.wrong.append(traceback.format_exc(limit=-3))
    except Exception:  # noqa: BLE001 - anything else is a defect
        monitor.wrong.append(traceback.format_exc(limit=-5))
    if observers.failures:
        monitor.wrong.append(f"observers failed: {observers.failures}")
    simulation.advance(STILL_MS)
    if simulation.motors_turn():
        monitor.wrong.append("motors turn after the mission")
    return outcome, monitor.wrong + monitor.livelocks()


def _unreadable(folder: Path) -> list[str]:
    """Return the commands that cannot read the run."""
    wrong = list[str]()
    commands = (
        ("explain-run", str(folder)),
        ("explain-run", str(folder), "--profile", "thesis", "--json"),
        ("export", str(folder), "--html", str(folder / "run.html")),
        ("export", str(folder), "--csv", str(folder / "run.csv")),
    )
    for words in commands:
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main(words)
        if code != 0 or err.getvalue().strip():
            wrong.append(f"{' '.join(words)} exits with {code}: {err.getvalue()[-400:]}")
    return wrong


CAMPAIGN = Campaign(
    guarantee="Whatever the room, the robot and the parameters, a mission ends by its own rules with motors off and a "
    "readable journal, claims no target that it is not at, and does not repeat itself.",
    unit="missions",
    count=150,
    batch=5,
    run=trials,
)
