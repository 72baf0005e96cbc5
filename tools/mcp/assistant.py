"""The operations of an assistant on a robot: look, short motions of limited length, missions, and stop."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from firmware_protocol.errors import ConfigError
from nxtdrive.recording.camera_folder import jpeg
from nxtdrive.recording.run_reader import read_run

from ..web.decisions import decisions_of
from ..web.mission_run import open_decision, under_way
from ..web.missions import Missions
from ..web.motions import ShortMotion
from ..web.robot import Robot
from ..web.runs import Runs
from .mission_status import MissionStatusHub

if TYPE_CHECKING:
    from behaviors.ports import MotionResult
    from nxtdrive.link.scheduler import Motion
    from nxtdrive.motion.rover import Rover

T = TypeVar("T")

MAX_DEG = 360.0
"""Largest turn of one call."""
NEXT_S = 1.0
"""How long to wait for a new picture or state of the robot."""
BEGIN_S = 10.0
"""`start_mission` waits this long for the mission to begin: its detectors are made first."""
END_S = 5.0
"""`stop` waits this long for the motion or mission to end; the robot stands still long before."""
POLL_S = 0.02
MOTION_S = 0.2
"""How often a motion checks whether the robot's thread still runs."""


@dataclass(frozen=True, slots=True)
class Assistant:
    """Tools of an assistant; all methods may be called from any thread, and some wait.

    What cannot be done raises `ValueError`, whose text says why and what to do.

    Attributes:
        robot: The robot, open.
        status_hub: The robot's hub.
        missions: The missions that can be started.
        runs: Folder of the runs.
        max_mm: Farthest that one call drives.
    """

    robot: Robot
    status_hub: MissionStatusHub
    missions: Missions
    runs: Path
    max_mm: float

    def look(self) -> bytes:
        """Return the camera's next picture as JPEG; while a mission is paused its latest one."""
        self.status_hub.small_pictures = True  # with geometric vision nothing else asks for frames
        try:
            picture = _next(self.robot.picture)
        finally:
            self.status_hub.small_pictures = False
        if picture is None:
            raise ValueError(
                "The camera delivers no frames. Plug it in again, or start `nxtdrive mcp` with another --camera."
            )
        return jpeg(picture)

    def drive(self, distance_mm: float) -> ShortMotion:
        """Begin to drive straight, negative: back; `wait` returns the result."""
        _check_limit("distance_mm", distance_mm, self.max_mm)
        return self._begin(lambda rover: rover.straight(distance_mm, wait=False))

    def turn(self, angle_deg: float) -> ShortMotion:
        """Begin to turn on the spot, positive right; `wait` returns the result."""
        _check_limit("angle_deg", angle_deg, MAX_DEG)
        return self._begin(lambda rover: rover.turn(angle_deg, wait=False))

    def read(self) -> ShortMotion:
        """Begin to read the sensors; `wait` returns them."""
        return self._begin(None)

    def wait(self, motion: ShortMotion) -> dict[str, Any]:
        """Wait for the end of a motion; returns why it ended, how far it went, and the sensors."""
        while not motion.wait(MOTION_S):
            if not self.robot.alive:
                raise ValueError("The robot's thread has ended. Start `nxtdrive mcp` again.")
        if motion.reading is None:
            raise ValueError(motion.problem)
        values: dict[str, Any] = {}
        if (result := motion.result) is not None:
            values = {"ended": result.stop.value, "distance_mm": round(result.distance_mm)}
            values |= {"turned_deg": round(result.turned_deg, 1)}
        elif motion.drives:
            values = {"ended": "cancelled", "distance_mm": 0, "turned_deg": 0.0}
        return values | _rounded(asdict(motion.reading)) | {"lacking": self.robot.lacking}

    def start_mission(self, name: str, profile: str, *, decide: bool, end_count: int) -> None:
        """Start a mission, and wait up to `BEGIN_S` until `status` describes it and not the one before.

        Args:
            name: One of `missions`; empty for the built-in one.
            profile: A built-in or an installed profile; empty for the mission's own.
            decide: Whether each recovery waits for `choose`.
            end_count: The robot's when it was asked for; see `TaskSlot`.
        """
        mission = self.missions.load(name, profile or None)
        self._check_nobody_drives()
        begun, until_s = self.status_hub.begun, time.monotonic() + BEGIN_S
        self.robot.start_mission(mission, confirm=decide, file=self.missions.file(name), end_count=end_count)
        while self.status_hub.begun == begun and self.robot.busy and time.monotonic() < until_s:
            time.sleep(POLL_S)

    def status(self, wait_s: float = 0.0) -> dict[str, Any]:
        """Return what the robot is doing, after waiting up to `wait_s` for a mission's end or question."""
        until_s = time.monotonic() + wait_s
        while time.monotonic() < until_s and self.robot.busy and not open_decision(self.robot.mission)["open"]:
            time.sleep(POLL_S)
        running, lost = self.robot.busy, self.status_hub.lost
        status: dict[str, Any] = {
            "running": running,
            "mission": self.status_hub.mission(),
            "question": open_decision(self.robot.mission),
        }
        if lost:
            status["link_lost"] = lost
        if running:
            return status
        # the last state may be from before the last motion; while the link is lost there is no other
        state = self.robot.state if lost else _next(lambda: self.robot.state)
        return {**status, "robot": _with_named_pose(state)}

    def choose(self, number: int) -> None:
        """Take a candidate of the open question."""
        under_way(self.robot.mission).operator.choose(number)

    def stop(self) -> bool:
        """Abort any motion or mission of the robot; return whether it has ended."""
        self.robot.stop_hand_drive()
        self.robot.end_task()
        until_s = time.monotonic() + END_S
        while self.robot.busy and time.monotonic() < until_s:
            time.sleep(POLL_S)
        return not self.robot.busy

    def explain(self, run: str = "") -> dict[str, Any]:
        """Return the decisions of a run, by default the latest: cause, what was known, candidates, choice and why."""
        names = Runs(self.runs).names()
        if not names or (run and run not in names):
            raise ValueError(
                f"There is no run {run!r} here." if names else "There are no runs yet. Run a mission first."
            )
        name = run or names[0]
        try:
            return {"run": name, "decisions": decisions_of(read_run(self.runs / name))}
        except ConfigError as error:
            raise ValueError(str(error)) from None

    def _begin(self, begin: Callable[[Rover], Motion[MotionResult]] | None) -> ShortMotion:
        if self.status_hub.lost:
            raise ValueError(f"{self.status_hub.lost} It is tried again and again.")
        if begin is not None:
            self._check_nobody_drives()
        motion = ShortMotion(begin)
        self.robot.start(motion)
        return motion

    def _check_nobody_drives(self) -> None:
        if any(self.robot.controls.wanted(self.robot.time_s)):
            raise ValueError("A person is driving the robot by hand. Try again later.")


def _next(latest: Callable[[], T]) -> T:
    """Return the next value of what the robot's thread renews, or the last one if it does not."""
    before, until_s = latest(), time.monotonic() + NEXT_S
    while (value := latest()) is before and time.monotonic() < until_s:
        time.sleep(POLL_S)
    return value


def _check_limit(name: str, value: float, limit: float) -> None:
    if not -limit <= value <= limit:
        raise ValueError(f"{name} must be from {-limit:g} to {limit:g} in one call, not {value:g}.")


def _with_named_pose(state: Mapping[str, Any]) -> dict[str, Any]:
    """Return the page's state, empty before the robot is open, with the pose as the motions give it."""
    if not state:
        return {}
    x_mm, y_mm, heading_deg = state["pose"]
    return {**state, "pose": {"x_mm": x_mm, "y_mm": y_mm, "heading_deg": heading_deg}}


def _rounded(values: dict[str, Any]) -> dict[str, Any]:
    """Round measurements to their accuracy."""
    pose = {key: round(value, 1) for key, value in values["pose"].items()}
    far = values["range_mm"]
    return {**values, "pose": pose, "range_mm": None if far is None else round(far)}
