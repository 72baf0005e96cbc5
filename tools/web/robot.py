"""The robot's thread: it alone uses the brick, drives by hand or runs a mission, and sends messages to the hub."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from behaviors.mission import Mission
from behaviors.profiles.registry import raised_by_profile
from firmware_protocol.errors import BrickError, LinkError, NXTError, RemoteProtocolError
from nxtdrive.brick import Brick
from nxtdrive.mission.assembly import OpenRobot, open_robot
from nxtdrive.mission.body import build_rover, lacking_sensors
from nxtdrive.mission.camera import GEOMETRIC
from nxtdrive.motion.sensor_health import SENSOR_ERRORS
from nxtdrive.transports.address import Address

from ..teleop.controls import Controls
from ..teleop.pilot import Pilot, PilotState
from .hub import Hub
from .mission_run import ShownMission
from .motions import ShortMotion
from .pictures import PictureFeed
from .robot_shape import robot_shape
from .task_slot import Task, TaskSlot
from .true_room import TrueRoom

if TYPE_CHECKING:
    from nxtdrive.motion.rover import Rover
    from nxtdrive.vision.detection import Image

SPEED_MM_S, TURN_DEG_S = 300.0, 90.0
"""Highest speeds of driving by hand; the speed limit takes a share of them."""
SLICE_S = 0.005
"""A simulated robot sleeps in slices of this time, so that a message of the driver is handled at once."""
RETRY_S = 0.5
"""Time between attempts to reach a lost brick, without news."""
MEASURED = frozenset({"range_mm", "touching", "battery_mv", "latency_ms"})
"""What a state has only while the brick can be reached."""
CLOSE_S = 5.0
"""How long closing waits for the robot's thread; a brick that does not answer stops its motors itself."""
AWAITS_CENTRE = "Let go of the pad, then drive. A program sends zeros once."
BEEP = (880, 600)
"""Hertz and milliseconds."""


@dataclass(frozen=True, slots=True)
class _DrivenByHand:
    """A robot that no mission drives.

    Attributes:
        mission: How it is built.
        rover: Its vehicle.
        room: The true room, in the frame of the rover's pose.
    """

    mission: Mission
    rover: Rover
    room: TrueRoom


class Robot:
    """One robot with its camera, in a thread of its own.

    Attributes:
        address: The brick's.
        controls: The driver's commands.
        failure: The defect that ended the thread, if one did.

    Args:
        address: The brick's.
        camera: As for ``nxtdrive run``; None for the default.
        mission: How the robot is built when it is driven by hand.
        hub: Gets all messages.
        runs: Where the folders of missions go.
        on_open: Called by the robot's thread when brick and camera are open.
    """

    def __init__(
        self,
        address: Address,
        camera: str | None,
        mission: Mission,
        hub: Hub,
        runs: Path,
        on_open: Callable[[Brick], None] = lambda _: None,
    ) -> None:
        self.controls = Controls(SPEED_MM_S, TURN_DEG_S)
        self.address = address
        self._camera = camera
        self._mission = mission
        self._hub = hub
        self._runs = runs
        self._on_open = on_open
        self._news = threading.Event()
        self._closing, self._beep = threading.Event(), threading.Event()
        self._slot = TaskSlot(self.controls)
        # None while something else drives: odometry then has the final wheel positions, not the path between
        self._hand: _DrivenByHand | None = None
        self._state: dict[str, object] = {}
        self._opened: queue.SimpleQueue[Exception | None] = queue.SimpleQueue()
        self._now: Callable[[], float] = lambda: 0.0
        self._pictures = PictureFeed(hub)
        self._on_end: Callable[[], None] = lambda: None
        self.failure: Exception | None = None
        self._thread = threading.Thread(target=self._guarded, name="nxtdrive web robot", daemon=True)

    def open(self, on_end: Callable[[], None] = lambda: None) -> None:
        """Start the thread and wait for brick and camera.

        Args:
            on_end: Called by the thread when it ends, even by a defect, which is in `failure` then.

        Raises:
            NXTError: One of them cannot be opened.
        """
        self._on_end = on_end
        self._thread.start()
        if error := self._opened.get():
            raise error

    def close(self) -> None:
        """End its task, stop the motors, close brick and camera; allowed before it is open.

        Waits at most `CLOSE_S`; then it may still be `alive`.
        """
        self._closing.set()
        self.end_task()
        self._news.set()
        if self._thread.is_alive():
            self._thread.join(CLOSE_S)

    def drive(self, ahead: float, turn: float) -> None:
        """Drive on by hand, at shares of the highest speeds, for the time of the dead-man switch; any thread.

        Raises:
            ValueError: It is stopped, does something else, or the pad has to be let go first; the text says so.
        """
        self.controls.steer(ahead, turn, self._now())
        self._news.set()
        if ahead or turn:
            self._slot.check_hand_drive()
            if self.controls.awaits_centre:
                raise ValueError(AWAITS_CENTRE)

    def stop_hand_drive(self) -> None:
        """Stop driving by hand; any thread."""
        self.controls.set_neutral()
        self._news.set()

    def stop(self) -> None:
        """Stop, end its task, and stay stopped until `release`; any thread."""
        self.controls.emergency_stop()
        self.end_task()
        self._news.set()

    def release(self) -> None:
        """End a stop; any thread."""
        self.controls.release()
        self._news.set()

    def start_mission(
        self, mission: Mission, *, confirm: bool, file: Path | None = None, end_count: int | None = None
    ) -> None:
        """Run a mission, unless one is running or the robot is stopped; any thread.

        Args:
            mission: What to do.
            confirm: Whether clients confirm each recovery.
            file: The mission's file, for hints; None for the built-in one.
            end_count: As it was when the mission was asked for.

        Raises:
            ValueError: It cannot start now; the text says why.
        """
        self.start(ShownMission(mission, self._hub, confirm=confirm, file=file), end_count)

    def start(self, task: Task, end_count: int | None = None) -> None:
        """Begin a task, unless the robot is busy, or is stopped and would drive; any thread.

        Args:
            task: The task.
            end_count: As it was when the task was asked for.

        Raises:
            ValueError: It cannot start now; the text says why.
        """
        self._slot.start(task, end_count)
        self._news.set()

    def rebuild(self, mission: Mission) -> None:
        """Drive by hand as a mission says the robot is built, from now on; any thread."""
        self._mission = mission
        self._news.set()

    def end_task(self) -> None:
        """End the mission, calibration or short motion that runs or is about to, if there is one; any thread."""
        self._slot.end()

    @property
    def busy(self) -> bool:
        """Whether a mission, calibration or short motion runs or is about to."""
        return self._slot.current is not None

    @property
    def end_count(self) -> int:
        """See `TaskSlot`."""
        return self._slot.end_count

    @property
    def lacking(self) -> list[str]:
        """Which of ``sonar`` and ``bumper`` it does not have."""
        return lacking_sensors(self._mission.robot)

    @property
    def alive(self) -> bool:
        """Whether the robot's thread runs."""
        return self._thread.is_alive()

    @property
    def time_s(self) -> float:
        """Time on the robot's clock; 0 before it is open."""
        return self._now()

    def beep(self) -> None:
        """Play a tone when the robot is driven by hand next; any thread."""
        self._beep.set()
        self._news.set()

    @property
    def state(self) -> Mapping[str, object]:
        """The last state sent to clients while no mission drove the robot; empty before it is open."""
        return self._state

    def picture(self) -> Image | None:
        """Return the camera's latest picture, if it has given one; any thread."""
        return self._pictures.latest

    @property
    def mission(self) -> ShownMission | None:
        """The mission that runs or is about to, if there is one; any thread."""
        return self._slot.mission

    def _guarded(self) -> None:
        try:
            self._work()
        except Exception as defect:  # noqa: BLE001 - it ends the program, which raises it
            self.failure = defect
            self._opened.put(defect)  # for a defect while it is opened, which `open` waits for
        finally:
            self._on_end()

    def _work(self) -> None:
        with ExitStack() as stack:
            try:
                robot = stack.enter_context(open_robot(self.address, self._camera))
            except NXTError as error:
                self._opened.put(error)
                return
            if robot.source == GEOMETRIC:  # its missions look at no frames
                robot.watch(self._pictures.frame, self._pictures.fps, self._pictures.needs)
            else:
                robot.watch(self._pictures.frame, self._pictures.fps)
            self._on_open(robot.brick)
            self._now = robot.brick.now
            self._opened.put(None)
            while not self._closing.is_set():
                if (task := self._slot.current) is not None and task.drives:
                    self._perform(task, robot)
                else:
                    self._drive_by_hand(robot.brick)
                self.controls.set_neutral()  # a pad that is held meanwhile must not start the robot

    def _drive_by_hand(self, brick: Brick) -> None:
        """Drive as the controls demand until a task is to drive, or the robot is built in another way."""
        hand = self._by_hand(brick)
        pilot = Pilot(brick, hand.rover, self.controls, rest=self._rest(brick))
        while not self._closing.is_set() and self._mission is hand.mission:
            task = self._slot.current
            if task is not None and task.drives:
                break
            try:
                if isinstance(task, ShortMotion):
                    task.perform(brick, hand.rover)
                if self._beep.is_set():
                    self._beep.clear()
                    brick.tone(*BEEP)
                self._show(pilot.step())
                hand.room.show()
            except (LinkError, BrickError, RemoteProtocolError) as error:  # the leases stop the wheels
                if not isinstance(error, SENSOR_ERRORS):
                    self.controls.set_neutral()  # as after a task
                self._show_lost(error)
                self._news.wait(RETRY_S)
                self._news.clear()  # or the next wait would not wait
        if pilot.moving:
            with suppress(NXTError):  # a lost link; the leases stop the wheels
                pilot.stop()

    def _by_hand(self, brick: Brick) -> _DrivenByHand:
        """Return the robot for driving by hand; it keeps its pose until something else drives or it is rebuilt."""
        mission = self._mission
        if self._hand is None or self._hand.mission is not mission:
            self._hand = _DrivenByHand(mission, build_rover(brick, mission.robot), TrueRoom(brick, self._hub))
            self._hub.show("robot", robot_shape(mission))
        return self._hand

    def _rest(self, brick: Brick) -> Callable[[float], None]:
        """Return a function that waits for a time or for news."""

        def rest(duration_s: float) -> None:
            until_s = brick.now() + duration_s
            while (left_s := until_s - brick.now()) > 0 and not self._news.is_set():
                if brick.link.transport.simulated:
                    brick.sleep(min(left_s, SLICE_S))
                else:
                    self._news.wait(left_s)
            self._news.clear()

        return rest

    def _show(self, view: PilotState) -> None:
        self._hub.show("link", {"lost": ""})
        self._state = {
            "doing": "stopped until released" if self.controls.stopped else view.state,
            "pose": [round(view.pose.x_mm, 1), round(view.pose.y_mm, 1), round(view.pose.heading_deg, 1)],
            "range_mm": view.range_mm,
            "touching": view.touching,
            "lacking": self.lacking,
            "battery_mv": view.battery_mv,
            "latency_ms": round(view.latency_ms, 1),
            **self._hand_state(),
        }
        self._hub.show("state", self._state)

    def _show_lost(self, error: NXTError) -> None:
        """Send why the robot cannot be driven, and the last state, if there is one, without what was measured."""
        self._hub.show("link", {"lost": str(error)})
        if self._state:
            kept = {key: value for key, value in self._state.items() if key not in MEASURED}
            self._hub.show("state", {**kept, "doing": "cannot be driven", **self._hand_state()})

    def _show_doing(self, what: str) -> None:
        """Send the last state again, if there is one, with what the robot does now."""
        if self._state:
            self._hub.show("state", {**self._state, "doing": what})

    def _hand_state(self) -> dict[str, object]:
        return {"speed_limit": self.controls.percent, "stopped": self.controls.stopped}

    def _perform(self, task: Task, robot: OpenRobot) -> None:
        if self.controls.stopped or self._closing.is_set():
            task.end()  # requests before this moment did not find it
        if isinstance(task, ShortMotion):
            self._show_doing("driving")
            task.perform(robot.brick, self._by_hand(robot.brick).rover)
        elif isinstance(task, ShownMission):
            self._pursue(task, robot)
        else:
            self._hand = None
            self._show_doing("calibrating")
            task.perform(robot)

    def _pursue(self, task: ShownMission, robot: OpenRobot) -> None:
        try:
            run = task.assemble(robot)
            recording = run.record(self._runs, watch=self._pictures.watch)
            self._hand = None
            task.pursue(run, recording.folder.path.name, self._hand_state)
        except Exception as error:
            known = error if isinstance(error, NXTError) else raised_by_profile(error, task.profile)
            if known is None:
                raise
            task.finish()  # before clients are informed: one may start another task at once
            self._hub.publish("problem", {"text": str(known)})
        finally:
            task.finish()
            self._pictures.watch(None)
