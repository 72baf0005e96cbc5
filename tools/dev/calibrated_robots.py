"""Calibrate random robots in the simulation, and compare their missions with those of exactly known robots.

::

    python -m tools.dev.calibrated_robots --robots 50 --missions 600 --out calibrated.jsonl

Every robot differs from the usual one: field of view by up to 15 %, wheels and track by 8 %, yaw and roll by 15
degrees, tilt by 10, frames up to 0.3 s late. It is calibrated from the usual values; only then are its errors compared
with the truth. Missions come in pairs, of one robot in one room: as calibrated and exactly known; every fourth also by
the usual values.
The results are kept in a file, and an interrupted run continues where it left off.
"""

from __future__ import annotations

import datetime
import json
import math
import statistics
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from random import Random
from typing import Any

from behaviors.mission import described_by
from behaviors.mission.robot import CALIBRATED, CameraTable, RobotFile, RobotTable
from firmware_protocol.errors import NXTError
from nxtdrive.mission.assembly import open_robot
from nxtdrive.simulated.scenario import generate_scenario
from sim_backend.bundled import WORLDS
from sim_backend.scenarios.classes import CLASSES
from sim_backend.world.world_file import Camera, Robot

from ..calibrate.session import calibrate
from ..sweep.result_file import ResultFile
from ..sweep.task import UNCHANGED, Task, result_of, run_episode
from .program import parser

GOALS = {
    # value: goal, and whether it is a share of the value
    "camera.hfov_deg": (0.02, True),
    "camera.yaw_deg": (2.0, False),
    "camera.tilt_deg": (2.0, False),
    "camera.roll_deg": (2.0, False),
    "camera.latency_s": (0.03, False),
    "robot.wheel_diameter_mm": (0.01, True),
    "robot.axle_track_mm": (0.01, True),
}
ARMS = ("calibrated", "known", "usual")
FIRST_SEED = 22_000
"""Seeds of the rooms, which nothing was tuned on."""
USUAL_EVERY = 4
"""Uncalibrated robots need fewer missions for a clear result."""

Line = dict[str, Any]


def draw_robot(number: int) -> RobotFile:
    """Draw the true dimensions of a robot."""
    random = Random(f"calibrated-{number}")  # noqa: S311 - repeatable
    return RobotFile(
        robot=RobotTable(
            wheel_diameter_mm=round(56 * random.uniform(0.92, 1.08), 2),
            axle_track_mm=round(112 * random.uniform(0.92, 1.08), 1),
        ),
        camera=CameraTable(
            hfov_deg=round(60 * random.uniform(0.85, 1.15), 2),
            yaw_deg=round(random.uniform(-15, 15), 1),
            tilt_deg=round(random.uniform(-10, 10), 1),
            roll_deg=round(random.uniform(-15, 15), 1),
            latency_s=round(random.uniform(0, 0.3), 3),
            forward_mm=60.0,
        ),
    )


def calibrated(number: int) -> Line:
    """Calibrate a random robot; return the robot file, or why it was refused."""
    true = draw_robot(number)
    with tempfile.TemporaryDirectory() as folder:
        world = Path(folder) / "world.toml"
        world.write_text(_world(true), encoding="utf-8")
        try:
            with open_robot(f"sim://{world}?seed={number}", "sim") as robot:
                found = calibrate(robot.brick, robot.camera, UNCHANGED, CALIBRATED, datetime.date(2026, 1, 1))
        except NXTError as refusal:
            return {"robot": number, "refused": str(refusal)}
    return {"robot": number, "file": found.file.model_dump(mode="json", exclude={"calibration"}, exclude_unset=True)}


def _world(true: RobotFile) -> str:
    text = (WORLDS / "calibration.toml").read_text(encoding="utf-8")
    robot = f"[robot]\nwheel_diameter_mm = {true.robot.wheel_diameter_mm}\ntrack_mm = {true.robot.axle_track_mm}"
    camera = "\n".join(f"{key} = {value}" for key, value in true.camera.model_dump(exclude_unset=True).items())
    return text.replace("[robot]", robot) + f"\n[camera]\n{camera}\n"


def mission(number: int, robot: int, file: RobotFile, arm: str) -> Line:
    """Run one mission of a random robot."""
    true = draw_robot(robot)
    kind = sorted(CLASSES)[number % len(CLASSES)]
    scenario = generate_scenario(kind, FIRST_SEED + number)
    world = scenario.world
    driven = {"wheel_diameter_mm": true.robot.wheel_diameter_mm, "track_mm": true.robot.axle_track_mm}
    seen = true.camera.model_dump(exclude_unset=True)
    world = world.model_copy(
        update={
            "robot": Robot.model_validate({**world.robot.model_dump(), **driven}),
            "camera": Camera.model_validate({**world.camera.model_dump(), **seen}),
        }
    )
    described = {"calibrated": file, "known": true, "usual": UNCHANGED}[arm]
    scenario = replace(scenario, world=world, mission=described_by(scenario.mission, described))
    trace, _ = run_episode(scenario, "adaptive", "geometric")
    result = result_of(Task(number, kind, scenario.seed, "adaptive", "geometric"), trace)
    kept = result.model_dump(mode="json", include={"success", "sum_reward", "duration_s", "contacts", "ending"})
    return {"mission": number, "robot": robot, "class": kind, "arm": arm, **kept}


def error_of(key: str, file: Line, number: int) -> float:
    """Return the error of a calibrated value in the unit of its goal."""
    table, name = key.split(".")
    true = float(getattr(getattr(draw_robot(number), table), name))
    error = abs(float(file[table][name]) - true)
    return error / true if GOALS[key][1] else error


def report(lines: Sequence[Line]) -> Iterator[str]:
    """Yield the report."""
    robots = [line for line in lines if "file" in line]
    refused = [line for line in lines if "refused" in line]
    yield f"{len(robots)} robots calibrated, {len(refused)} refused"
    for line in refused:
        yield f"  robot {line['robot']}: {line['refused']}"
    if robots:
        yield f"{'value':<28}{'median':>9}{'worst':>9}{'goal':>8}  within"
    for key, (goal, share) in GOALS.items() if robots else ():
        errors = [error_of(key, line["file"], line["robot"]) for line in robots]
        scale, unit = (100, " %") if share else (1, "")
        within = sum(error <= goal for error in errors)
        row = f"{key:<28}{scale * statistics.median(errors):>9.3g}{scale * max(errors):>9.3g}{scale * goal:>8.3g}"
        yield f"{row}{unit:<2}  {within}/{len(errors)}"
    yield from _missions({(line["mission"], line["arm"]): line for line in lines if "mission" in line})


def _missions(done: dict[tuple[int, str], Line]) -> Iterator[str]:
    for arm in ARMS:
        own = [line for (_, each), line in done.items() if each == arm]
        if own:
            wins = sum(line["success"] for line in own)
            yield f"{arm:<12}{wins:>5} of {len(own)} missions succeeded ({wins / len(own):.1%})"
    for other in ARMS[1:]:
        pairs = [
            float(line["success"]) - float(done[number, other]["success"])
            for (number, arm), line in done.items()
            if arm == "calibrated" and (number, other) in done
        ]
        if len(pairs) > 1:
            mean, half = statistics.fmean(pairs), 1.96 * statistics.stdev(pairs) / math.sqrt(len(pairs))
            interval = f"{100 * (mean - half):+.1f} to {100 * (mean + half):+.1f}"
            yield f"calibrated - {other}: {100 * mean:+.1f} points, 95 % interval {interval} ({len(pairs)} pairs)"


def main() -> None:
    """Calibrate, run missions, report."""
    arguments = parser(__doc__)
    arguments.add_argument("--robots", type=int, default=50)
    arguments.add_argument("--missions", type=int, default=600, help="for each of the two ways to describe the robot")
    arguments.add_argument(
        "--most", type=int, default=sys.maxsize, help="missions and calibrations of this run at most"
    )
    arguments.add_argument("--out", type=Path, default=Path("calibrated.jsonl"))
    args = arguments.parse_args()
    with ResultFile(args.out) as out:
        lines: list[Line] = [json.loads(line) for line in args.out.read_text(encoding="utf-8").splitlines()]
        for line in islice(_work(lines, args.robots, args.missions), args.most):
            out.append(json.dumps(line))
            lines.append(line)
    print("\n".join(report(lines)))


def _work(lines: list[Line], robots: int, missions: int) -> Iterator[Line]:
    """Yield the missing results, one after the other; `lines` has the existing ones, including those of this run."""
    known = {line["robot"] for line in lines if "mission" not in line}
    yield from (calibrated(number) for number in range(robots) if number not in known)
    files = {line["robot"]: RobotFile.model_validate(line["file"]) for line in lines if "file" in line}
    done = {(line["mission"], line["arm"]) for line in lines if "mission" in line}
    for number in range(missions):
        robot = sorted(files)[number % len(files)]
        for arm in ARMS if number % USUAL_EVERY == 0 else ARMS[:2]:
            if (number, arm) not in done:
                yield mission(number, robot, files[robot], arm)


if __name__ == "__main__":
    main()
