"""The robot's thread between driving by hand and tasks."""

from __future__ import annotations

import math
import queue
import threading
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from typing import Any

import numpy as np
import pytest

from firmware_protocol.errors import LinkLost
from nxtdrive.mission.camera import GEOMETRIC
from nxtdrive.mission.files import read_mission_file
from nxtdrive.recording.camera_folder import CameraFolder
from nxtdrive.recording.camera_index import read_frames
from nxtdrive.tools.teleop.pilot import Pilot
from nxtdrive.tools.web import robot as robot_module
from nxtdrive.tools.web.hub import Hub
from nxtdrive.tools.web.mission_run import ShownMission
from nxtdrive.tools.web.motions import ShortMotion
from nxtdrive.tools.web.pictures import PictureFeed
from nxtdrive.tools.web.robot import Robot
from nxtdrive.transports.sim import SimTransport, shared
from nxtdrive.vision.camera import Frame
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation
from tests.tools.web.pages import robot_of

LIMIT_S = 30.0


class Witness(Hub):
    """A hub that knows when the robot has been driven by hand."""

    def __init__(self) -> None:
        super().__init__()
        self.driving = threading.Event()

    def show(self, kind: str, values: Mapping[str, Any]) -> None:
        if kind == "state" and values["doing"] == "driving":
            self.driving.set()
        super().show(kind, values)


def hold_stick(robot, ahead, turn):
    """Let a person hold the stick for ever."""
    robot.controls.steer(0.0, 0.0, math.inf)
    robot.controls.steer(ahead, turn, math.inf)


@pytest.fixture
def turning(tmp_path) -> Iterator[Robot]:
    """A robot that turns on the spot at full speed, since a person holds the stick."""
    hub = Witness()
    robot = robot_of(tmp_path, hub)
    robot.controls.percent = 100
    hold_stick(robot, 0.0, 1.0)
    with closing(robot):
        robot.open()
        assert hub.driving.wait(LIMIT_S)
        yield robot


def test_a_reading_does_not_end_driving_by_hand(turning):
    reading = ShortMotion()
    turning.start(reading)
    assert reading.wait(LIMIT_S)
    assert reading.reading is not None
    assert turning.controls.wanted(0.0) == (0.0, 90.0)


def test_the_robot_stands_when_something_else_begins_to_drive(turning):
    headings = []

    def begin(rover):
        for _ in range(2):
            headings.append(rover.pose().heading_deg)
            rover._link.sleep(0.3)
        return rover.turn(1.0, wait=False)

    motion = ShortMotion(begin)
    turning.start(motion)
    assert motion.wait(LIMIT_S)
    assert headings[1] == pytest.approx(headings[0], abs=3.0)


def test_a_stick_held_while_a_task_drives_does_not_drive_at_its_end(turning):
    def begin(rover):
        hold_stick(turning, 0.0, 1.0)
        return rover.turn(1.0, wait=False)

    for task in (ShortMotion(begin), ShortMotion()):
        turning.start(task)
        assert task.wait(LIMIT_S)
    assert turning.controls.wanted(0.0) == (0.0, 0.0)


class RoomWitness(Hub):
    """A hub with a client, that knows where the robot believes to be when the true room is shown."""

    watched = True

    def __init__(self) -> None:
        super().__init__()
        self.pose: list[float] | None = None
        self.poses: queue.SimpleQueue[tuple[Any, list[float]]] = queue.SimpleQueue()

    def show(self, kind: str, values: Mapping[str, Any]) -> None:
        super().show(kind, values)
        if kind == "state":
            self.pose = values["pose"]
        elif kind == "true_room":
            self.poses.put((self.pose, values["pose"]))


def test_the_true_room_stays_in_the_frame_of_the_pose_after_a_short_motion(tmp_path):
    hub = RoomWitness()
    robot = robot_of(tmp_path, hub, camera=GEOMETRIC)
    with closing(robot):
        robot.open()
        motion = ShortMotion(lambda rover: rover.straight(300, wait=False))
        robot.start(motion)
        assert motion.wait(LIMIT_S)
        while hub.poses.qsize():
            hub.poses.get()
        for _ in range(2):  # the first may be from before the pose
            believed, true = hub.poses.get(timeout=LIMIT_S)
        assert believed == pytest.approx([300, 0, 0], abs=10)
        assert true == pytest.approx(believed, abs=30)


def test_a_task_that_begins_with_the_robot_sends_no_state_without_its_values(tmp_path):
    hub = RoomWitness()
    robot = robot_of(tmp_path, hub, camera=GEOMETRIC)
    motion = ShortMotion(lambda rover: rover.straight(100, wait=False))
    robot.start(motion)
    with closing(robot):
        robot.open()
        assert motion.wait(LIMIT_S)
        assert robot.failure is None


@pytest.mark.slow
def test_clients_are_told_where_the_sonar_of_the_robot_that_drives_is(tmp_path):
    built_in = read_mission_file(None)
    built = built_in.model_copy(update={"robot": built_in.robot.model_copy(update={"sonar_forward_mm": 160.0})})
    places: queue.SimpleQueue[float] = queue.SimpleQueue()

    class Places(Hub):
        def show(self, kind: str, values: Mapping[str, Any]) -> None:
            super().show(kind, values)
            if kind == "robot":
                places.put(values["sonar_forward_mm"])

    robot = robot_of(tmp_path, Places(), camera=GEOMETRIC, mission=built)
    with closing(robot):
        robot.open()
        assert places.get(timeout=LIMIT_S) == 160.0
        robot.start_mission(built_in, confirm=False)
        assert places.get(timeout=LIMIT_S) == 100.0
        robot.end_task()
        assert places.get(timeout=LIMIT_S) == 160.0


def test_clients_are_told_which_sensors_the_robot_does_not_have(tmp_path):
    built_in = read_mission_file(None)
    mission = built_in.model_copy(update={"robot": built_in.robot.model_copy(update={"touch": 0})})
    hub = Witness()
    robot = robot_of(tmp_path, hub, mission=mission)
    hold_stick(robot, 1.0, 0.0)
    with closing(robot):
        robot.open()
        assert hub.driving.wait(LIMIT_S)
        assert robot.state["lacking"] == ["bumper"]


def test_a_lost_brick_is_tried_again_once_at_each_news(tmp_path, monkeypatch):
    tries = threading.Semaphore(0)

    def step(_pilot):
        tries.release()
        raise LinkLost("the cable is out")

    monkeypatch.setattr(Pilot, "step", step)
    monkeypatch.setattr(robot_module, "RETRY_S", 60.0)
    robot = robot_of(tmp_path, Hub())
    with closing(robot):
        robot.open()
        assert tries.acquire(timeout=LIMIT_S)
        robot.stop_hand_drive()
        assert tries.acquire(timeout=LIMIT_S)
        assert not tries.acquire(timeout=0.2)  # it would be tried thousands of times


@contextmanager
def unplugged_while_turning(hub, runs):
    """A robot that turns by hand, and whose cable is pulled out after 2 s."""
    faults = LinkFaults(unplugged_ms=((2000, 10**9),))
    with shared("unplugged", lambda: SimTransport(Simulation("empty"), faults=faults)) as address:
        robot = robot_of(runs, hub, address)
        hold_stick(robot, 0.0, 1.0)
        with closing(robot):
            robot.open()
            yield robot


def test_a_stick_held_while_the_link_is_lost_does_not_drive_when_the_brick_is_back(tmp_path):
    lost = threading.Event()

    class Watcher(Hub):
        def show(self, kind: str, values: Mapping[str, Any]) -> None:
            super().show(kind, values)
            if kind == "link" and values["lost"]:
                lost.set()

    with unplugged_while_turning(Watcher(), tmp_path) as robot:
        assert lost.wait(LIMIT_S)
        robot.controls.steer(0.0, 1.0, math.inf)
        assert robot.controls.wanted(0.0) == (0.0, 0.0)


def test_of_a_lost_brick_nothing_old_is_shown_and_a_stop_is(tmp_path):
    shown, unreachable, stopped = [], threading.Event(), threading.Event()

    class Watcher(Hub):
        def show(self, kind: str, values: Mapping[str, Any]) -> None:
            super().show(kind, values)
            if kind == "state":
                shown.append(values)
                if values["doing"] == "cannot be driven":
                    (stopped if values["stopped"] else unreachable).set()

    with unplugged_while_turning(Watcher(), tmp_path) as robot:
        assert unreachable.wait(LIMIT_S)
        robot.stop()
        assert stopped.wait(LIMIT_S)
    assert "driving" in {each["doing"] for each in shown}
    assert shown[0].keys() - shown[-1].keys() == {"range_mm", "touching", "battery_mv", "latency_ms"}


class PauseWitness(Hub):
    """A hub that knows whether the mission is shown as paused, and when one has failed."""

    def __init__(self) -> None:
        super().__init__()
        self.paused = False
        self.failed = threading.Event()

    def show(self, kind: str, values: Mapping[str, Any]) -> None:
        super().show(kind, values)
        if kind == "paused":
            self.paused = values["paused"]

    def publish(self, kind: str, values: Mapping[str, Any]) -> None:
        super().publish(kind, values)
        if kind == "problem":
            self.failed.set()


def test_the_pause_of_a_mission_that_cannot_begin_is_over_with_it(tmp_path):
    (tmp_path / "runs").write_text("a file, no folder", encoding="utf-8")
    hub = PauseWitness()
    robot = robot_of(tmp_path / "runs", hub)
    robot.start_mission(read_mission_file(None), confirm=False)
    robot.mission.pause()
    assert hub.paused
    with closing(robot):
        robot.open()
        assert hub.failed.wait(LIMIT_S)
        assert not hub.paused


def test_a_mission_that_cannot_begin_does_not_move_the_frame_of_the_pose(tmp_path):
    (tmp_path / "runs").write_text("a file, no folder", encoding="utf-8")
    hub = PauseWitness()
    robot = robot_of(tmp_path / "runs", hub, camera=GEOMETRIC)
    with closing(robot):
        robot.open()
        ahead, reading = ShortMotion(lambda rover: rover.straight(300, wait=False)), ShortMotion()
        robot.start(ahead)
        assert ahead.wait(LIMIT_S)
        robot.start_mission(read_mission_file(None), confirm=False)
        assert hub.failed.wait(LIMIT_S)
        robot.start(reading)
        assert reading.wait(LIMIT_S)
        assert reading.reading.pose.x_mm == pytest.approx(300, abs=10)


@pytest.mark.parametrize("end", [ShownMission.end, ShownMission.finish])
def test_a_mission_that_is_over_or_to_end_is_not_paused_any_more(end):
    hub = PauseWitness()
    mission = ShownMission(read_mission_file(None), hub, confirm=False)
    end(mission)
    mission.pause()  # by a thread that found it a moment ago
    assert not hub.paused


@pytest.mark.parametrize("fps", [5, 10, 15, 20, 30])
def test_a_webcam_of_any_rate_leaves_five_pictures_a_second(tmp_path, fps):
    folder, feed = CameraFolder(tmp_path / "camera"), PictureFeed(Hub())
    feed.watch(lambda frame: folder.add(frame.image, frame.time_s))
    for index in range(4 * fps):
        feed.frame(Frame(np.zeros((48, 64, 3), np.uint8), index / fps, index))
    folder.close()
    assert len(read_frames(tmp_path).frames) == 20
