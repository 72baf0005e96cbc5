"""Missions for the campaign of link faults."""

from __future__ import annotations

import json
import tempfile
import traceback
from pathlib import Path
from random import Random

from behaviors.executive import Ending, Executive, Report
from behaviors.mission import Mission
from behaviors.observers import Observers
from behaviors.ports import Vision
from firmware_protocol.errors import NXTError
from nxtdrive.brick import Brick
from nxtdrive.mission.body import MissionClock, mission_ports
from nxtdrive.mission.camera import open_mission_camera
from nxtdrive.mission.files import read_mission_file
from nxtdrive.mission.vision import camera_vision, geometric_vision
from nxtdrive.recording.recording import Recording
from nxtdrive.recording.run_folder import JOURNAL, MAP, MISSION, SUMMARY, RunFolder
from sim_backend.simulation import Simulation

from .wire import FOR_GOOD, KINDS, TRANSPORTS, Fault, Wire
from .wire_transports import plug_in

PROFILES = ("thesis", "adaptive")
CAMERA_EVERY = 25
"""One mission out of this number uses rendered camera frames, which takes some seconds."""
TELEGRAMS = 900
"""Roughly the number of telegrams of a mission over a fast link."""
LATENCIES_MS = (2, 2, 45)
STILL_MS, STILL_MM_S = 2300, 1.0
NO_BRICK = "no brick"
"""The outcome when opening the brick fails."""
SETTING_UP = 12
"""Telegrams until the mission begins; an error of the link then ends the program."""


def mission_trial(seed: int, number: int) -> tuple[str, list[str]]:
    """Run a mission with a fault; return its outcome and any violations."""
    random = Random(f"{seed}:{number}")  # noqa: S311 - repeatable
    profile, kind = PROFILES[number % 2], KINDS[number // 2 % len(KINDS)]
    transport, latency_ms = random.choice(TRANSPORTS), random.choice(LATENCIES_MS)
    camera = number % CAMERA_EVERY == CAMERA_EVERY - 1
    fault = Fault(kind, random.randrange(TELEGRAMS), draw=seed)
    outcome, wrong = run_mission(profile, transport, fault, latency_ms=latency_ms, camera=camera)
    if outcome not in (Ending.ACHIEVED, NO_BRICK) and (kind, outcome) != (FOR_GOOD, Ending.LINK_LOST):
        wrong.append(f"it ended with {outcome}")
    what = f"mission, {profile}, over {transport} at {latency_ms} ms, {kind} at telegram {fault.at}, camera: {camera}"
    return f"mission: {outcome}", [f"{what}: {each}" for each in wrong]


def run_mission(
    profile: str, transport: str, fault: Fault, *, latency_ms: int = 2, camera: bool = False
) -> tuple[str, list[str]]:
    """Perform a mission in an open room; return how it ended and any violations."""
    wire = Wire(Simulation("open", seed=1), transport, fault, latency_ms)
    with tempfile.TemporaryDirectory() as folder:
        return _perform(wire, mission_of(profile), Path(folder), camera=camera)


def mission_of(profile: str) -> Mission:
    """Return a mission with one target."""
    mission = read_mission_file(None)
    table = mission.mission.model_copy(update={"profile": profile, "targets": ["lena"], "reconnect_timeout_s": 15.0})
    return mission.model_copy(update={"mission": table})


def _perform(wire: Wire, mission: Mission, folder: Path, *, camera: bool) -> tuple[str, list[str]]:
    simulation, wrong, outcome = wire.simulation, [], "broken"

    def lost(until_ms: int) -> None:
        def look() -> None:
            if (speed := simulation.truth.speed_mm_s) > STILL_MM_S:
                wrong.append(f"the robot drives at {speed:.0f} mm/s {STILL_MS / 1000} s after the loss")

        if until_ms > simulation.now_ms + STILL_MS:
            simulation.at(simulation.now_ms + STILL_MS, look)

    wire.on_loss = lost
    try:
        with Brick(plug_in(wire)) as brick:
            brick.link.keep_alive()
            brick.link.reconnect_timeout_s, brick.link.reconnecting = 0.0, True
            report = pursue(brick, mission, folder, Observers(), camera=camera)
        outcome = report.ending.value
        wrong += _record_wrong(folder, report)
    except NXTError as error:
        outcome = NO_BRICK if wire.count < SETTING_UP else f"broken by {type(error).__name__}"
    except Exception:  # noqa: BLE001 - anything else is a defect
        wrong.append(traceback.format_exc(limit=-3))
    simulation.advance(STILL_MS)
    if (speed := simulation.truth.speed_mm_s) > STILL_MM_S or simulation.motors_turn():
        wrong.append(f"the robot drives at {speed:.0f} mm/s after the mission")
    return outcome, wrong


def pursue(brick: Brick, mission: Mission, folder: Path, observers: Observers, *, camera: bool) -> Report:
    """Pursue a mission with a journal and these observers.

    Args:
        brick: The brick, on a wire.
        mission: The mission.
        folder: The run folder.
        observers: A journal is added to them.
        camera: Whether the detectors search frames; otherwise vision is geometric.
    """
    vision: Vision
    if camera:
        vision = camera_vision(open_mission_camera("sim", brick), mission)
    else:
        vision = geometric_vision(brick, mission, brick.link.transport.webcam)  # type: ignore[attr-defined]
    recording = Recording(RunFolder(folder), MissionClock(brick), video=False)
    recording.folder.write_mission(mission)
    observers.add(JOURNAL, recording)
    report = None
    try:
        report = Executive(mission, mission_ports(brick, mission, vision), observers).run()
    finally:
        recording.finish(report, "", {"mission": mission.mission.name}, observers)
    return report


def _record_wrong(folder: Path, report: Report) -> list[str]:
    """Return the files missing from the run folder."""
    names = {path.name for path in folder.iterdir()}
    wrong = [f"{name} is missing" for name in (MISSION, JOURNAL, SUMMARY, MAP) if name not in names]
    records = [json.loads(line) for line in (folder / JOURNAL).read_text(encoding="utf-8").splitlines()]
    summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    if records[-1].get("ending") != report.ending or summary["ending"] != report.ending or not summary["targets"]:
        wrong.append(f"the record says {records[-1]} and {summary}, the report {report.ending}")
    return wrong
