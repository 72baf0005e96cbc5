"""One robot of a classroom: opened in its own thread, reopened after a failure, replaced while it is lost."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from behaviors.mission import Mission
from firmware_protocol.errors import NXTError
from nxtdrive.mission.camera import GEOMETRIC
from nxtdrive.recording.wording import spaced

from ..app import Server
from ..hub import Hub
from ..missions import Missions
from ..robot import Robot
from ..runs import Runs
from .config import RobotEntry
from .lag import LagMeter

RETRY_S, FALL_BACK_AFTER_S = 5.0, 10.0
"""Real time between attempts to open a robot, and after which a lost brick is replaced."""
LOOK_EVERY_S = 0.5
"""How often a station checks, without news, how long its brick has been lost."""
CLOSE_S = 6.0
"""Longest wait for a robot at the end; its own wait for its thread (`Robot.close`) is shorter."""


class StationHub(Hub):
    """A robot's hub that stores the contents of its tile.

    Attributes:
        doing: What the robot is doing.
        battery_mv: Its battery; None before it was read.
        lost: Why the brick cannot be reached or one of its sensors not read, or empty.
        running: Name of the running mission, or empty.
        waits: Whether the mission waits for a person; the time of a simulated robot stands still then.
        last: Result of the last mission, or None.
        runs: Number of missions that have ended.
    """

    def __init__(self) -> None:
        super().__init__()
        self.doing = ""
        self.battery_mv: int | None = None
        self.lost = ""
        self.running = ""
        self.waits = False
        self.last: dict[str, Any] | None = None
        self.runs = 0

    def show(self, kind: str, values: Mapping[str, Any]) -> None:
        """Send a value that replaces the one before."""
        if kind in ("state", "status"):
            self.doing, self.battery_mv = values["doing"], values.get("battery_mv") or self.battery_mv
        elif kind == "link":
            self.lost = values["lost"]
        elif kind == "paused":
            self.waits = values["paused"]
        elif kind == "question":
            self.waits = values["open"]
            self.doing = "waits for an answer on its page" if self.waits else self.doing
        super().show(kind, values)

    def publish(self, kind: str, values: Mapping[str, Any]) -> None:
        """Send an event."""
        if kind == "run":
            self.running = values["name"]
        elif kind == "ended":
            self.last, self.running = result(values), ""
            self.runs += 1
        super().publish(kind, values)


def result(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return mission, ending, targets reached and seconds of a run, from its summary."""
    targets = summary.get("targets") or []
    return {
        "mission": summary.get("mission") or "",
        "ending": spaced(str(summary.get("ending") or "unfinished")),
        "achieved": bool(summary.get("achieved")),
        "reached": sum(each.get("outcome") == "reached" for each in targets),
        "targets": len(targets),
        "seconds": summary.get("duration_s"),
    }


class Station:
    """A robot of the classroom and its page.

    The robot is opened, and opened again if that fails or a defect ended it. If the classroom's file says so, a
    simulated robot replaces a brick that cannot be opened or is lost, until `return_to_brick`.

    Args:
        entry: Its description.
        built: How the robot is built when it is driven by hand.
        missions: The missions of the classroom.
        runs: Where the folders of its missions go.
        retry_s: A robot that cannot be opened is tried again after this time.
        fall_back_after_s: A brick that is lost for longer is replaced, unless a mission runs, which waits for it.

    Attributes:
        entry: As given.
        hub: Sends messages to its page.
        server: Its page.
        trouble: Why it is not open, or why a simulated robot replaces it; empty if all is well.
        stands_in: Whether a simulated robot replaces the brick.
        is_open: Whether the robot is open.
    """

    def __init__(
        self,
        entry: RobotEntry,
        built: Mission,
        missions: Missions,
        runs: Path,
        *,
        retry_s: float = RETRY_S,
        fall_back_after_s: float = FALL_BACK_AFTER_S,
    ) -> None:
        self.entry = entry
        self.hub = StationHub()
        self.trouble = ""
        self.stands_in = False
        self.is_open = False
        self._built = built
        self._runs = runs
        self._retry_s, self._fall_back_after_s = retry_s, fall_back_after_s
        self._lock = threading.Lock()
        self._news, self._closing = threading.Event(), threading.Event()
        self._return_wanted = False
        self._lag = LagMeter()
        self._robot = self._make_robot()
        self.server = Server(self._robot, self.hub, missions, Runs(runs), f"{entry.name} ({entry.address})")
        self._thread = threading.Thread(target=self._supervise, name=f"nxtdrive station {entry.name}", daemon=True)

    @property
    def stopped(self) -> bool:
        """Whether the robot is stopped until it is released."""
        return self._robot.controls.stopped

    @property
    def time_s(self) -> float:
        """Time on the robot's clock."""
        return self._robot.time_s

    def open(self) -> None:
        """Begin to open the robot; returns at once."""
        self._thread.start()

    def begin_closing(self) -> None:
        """End the mission, stop the motors; returns at once."""
        self._closing.set()
        self._robot.stop()
        self._news.set()

    def close(self, timeout_s: float = CLOSE_S) -> None:
        """Close the robot; wait only for a limited time for a brick that is being opened and does not answer."""
        self.begin_closing()
        if self._thread.is_alive():
            self._thread.join(timeout_s)

    @property
    def alive(self) -> bool:
        """Whether its thread or its robot's runs."""
        return self._thread.is_alive() or self._robot.alive

    def stop(self) -> None:
        """Stop the robot, even if it is lost or not open yet, until `release`; any thread."""
        with self._lock:
            self._robot.stop()

    def release(self) -> None:
        """End a stop; any thread."""
        with self._lock:
            self._robot.release()

    @property
    def end_count(self) -> int:
        """The robot's; see `TaskSlot`."""
        return self._robot.end_count

    def start(self, mission: str, profile: str | None, end_count: int | None = None) -> None:
        """Start a mission, unless it was ended since `end_count`; any thread.

        Raises:
            ValueError: It cannot start now; the text says why.
        """
        if not self.is_open:
            raise ValueError(self.trouble or "The robot is not open yet.")
        missions = self.server.missions
        loaded, file = missions.load(mission, profile), missions.file(mission)
        self._robot.start_mission(loaded, confirm=False, file=file, end_count=end_count)

    @property
    def busy(self) -> bool:
        """Whether a mission runs or is about to."""
        return self._robot.busy

    def end_mission(self) -> None:
        """End the mission that runs or is about to, if there is one; any thread."""
        self._robot.end_task()

    def beep(self) -> None:
        """Play a tone on the brick; any thread.

        Raises:
            ValueError: It cannot now; the text says why.
        """
        if not self.is_open or self.hub.running:
            raise ValueError("The robot is on a mission." if self.is_open else "The robot is not open.")
        self._robot.beep()

    def return_to_brick(self) -> None:
        """Return to the brick, if it can be opened; any thread.

        Raises:
            ValueError: It cannot now; the text says why.
        """
        if not self.stands_in:
            raise ValueError("No simulated robot takes its place.")
        if self.hub.running:
            raise ValueError("A mission is running. End it first.")
        self._return_wanted = True
        self._news.set()

    def picture(self) -> Any:  # noqa: ANN401 - an image, or None
        """Return the camera's latest picture."""
        return self._robot.picture() if self.is_open else None

    def tile(self) -> dict[str, Any]:
        """Return its tile on the classroom's page."""
        hub = self.hub
        return {
            "name": self.entry.name,
            "brick": "stand-in" if self.stands_in else self.entry.address.scheme,
            "open": self.is_open,
            "trouble": hub.lost if self.is_open and hub.lost else self.trouble,
            "doing": ("cannot be driven" if hub.lost else hub.doing) if self.is_open else "",
            "battery_mv": hub.battery_mv if self.is_open else None,
            "stopped": self.stopped,
            "lags": self._lags(),
            "running": hub.running,
            "last": hub.last,
            "ended": hub.runs,
        }

    def _lags(self) -> bool:
        """Return whether the robot, a simulated one, is slower than real time."""
        if not self.is_open or self.hub.waits:
            self._lag.reset()
            return False
        return self._lag.lags(time.monotonic(), self.time_s)

    def _supervise(self) -> None:
        while not self._closing.is_set():
            try:
                again_at_once = self._serve_once()
            except Exception as defect:  # noqa: BLE001 - shown on the page; the other robots continue
                again_at_once = False
                self.trouble = f"the robot's program broke: {type(defect).__name__}: {defect}"
            finally:
                self.is_open = False
            if not again_at_once:
                self._closing.wait(self._retry_s)

    def _serve_once(self) -> bool:
        """Open the robot or its replacement, and wait for its end; return whether to try again at once.

        Raises:
            Exception: A defect ended the robot.
        """
        robot = self._renew()
        try:
            robot.open(self._news.set)
            if not self.stands_in:
                self.trouble = ""
            self.is_open = True
            return self._watch(robot)
        except NXTError as error:
            return self._falls_back(str(error))
        finally:
            robot.close()

    def _watch(self, robot: Robot) -> bool:
        """Wait until the robot ends, the brick is lost for too long, or the user asks for the brick again.

        Returns:
            Whether another robot replaces it at once.

        Raises:
            Exception: A defect ended the robot.
        """
        lost_since_s = math.inf
        while not self._closing.is_set() and robot.alive:
            self._news.wait(LOOK_EVERY_S)
            self._news.clear()
            if self._return_wanted:
                self.is_open = self._return_wanted = self.stands_in = False
                self.trouble = ""
                return True
            lost_since_s = min(lost_since_s, time.monotonic()) if self.hub.lost and not self.hub.running else math.inf
            if time.monotonic() - lost_since_s >= self._fall_back_after_s and self._falls_back(self.hub.lost):
                return True
        if robot.failure:
            raise robot.failure
        return False

    def _falls_back(self, reason: str) -> bool:
        """Note why the brick cannot be used; return whether a simulated robot replaces it from now on."""
        falls_back = self.entry.stand_in is not None and not self.stands_in
        if falls_back or not self.stands_in:
            self.trouble = reason
        if falls_back:
            self.is_open, self.stands_in = False, True
            self.hub.publish("problem", {"text": f"a simulated robot takes the brick's place: {reason}"})
        return falls_back

    def _renew(self) -> Robot:
        """Replace the robot, which can be opened only once; a stop stays."""
        with self._lock:
            old, self._robot = self._robot, self._make_robot()
            self._robot.controls.percent = old.controls.percent
            if old.controls.stopped:
                self._robot.stop()
            self.server.robot = self._robot
            self.server.address = f"{self.entry.name} ({'simulated in place of ' * self.stands_in}{self.entry.address})"
            self.hub.lost = self.hub.running = ""
        return self._robot

    def _make_robot(self) -> Robot:
        entry = self.entry
        stand_in = entry.stand_in if self.stands_in else None
        camera = GEOMETRIC if stand_in else entry.camera
        return Robot(stand_in or entry.address, camera, self._built, self.hub, self._runs)
