"""The robot's thread between driving by hand and tasks."""

from __future__ import annotations

import math
import queue
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager

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
from tests.small_mission import with_table
from tests.tools.web.pages import ToldHub, hub_setting, robot_of

LIMIT_S = 30.0


def hold_stick(robot, ahead, turn):
    """Let a person hold the stick for ever."""
    robot.controls.steer(0.0, 0.0, math.inf)
    robot.controls.steer(ahead, turn, math.inf)


@pytest.fixture
def turning(tmp_path) -> Iterator[Robot]:
    """A robot that turns on the spot at full speed, since a person holds the stick."""
    driving = threading.Event()
    robot = robot_of(tmp_path, hub_setting(driving, "state", doing="driving"))
    robot.controls.percent = 100
    hold_stick(robot, 0.0, 1.0)
    with closing(robot):
        robot.open()
        assert driving.wait(LIMIT_S)
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


class WatchedHub(ToldHub):
    """A hub with a client."""

    watched = True


def test_the_true_room_stays_in_the_frame_of_the_pose_after_a_short_motion(tmp_path):
    believed, poses = [[]], queue.SimpleQueue()

    def note(kind, values):
        if kind == "state":
            believed[0] = values["pose"]
        elif kind == "true_room":
            poses.put((believed[0], values["pose"]))

    robot = robot_of(tmp_path, WatchedHub(note), camera=GEOMETRIC)
    with closing(robot):
        robot.open()
        motion = ShortMotion(lambda rover: rover.straight(300, wait=False))
        robot.start(motion)
        assert motion.wait(LIMIT_S)
        while poses.qsize():
            poses.get()
        for _ in range(2):  # the first may be from before the pose
            pose, true = poses.get(timeout=LIMIT_S)
        assert pose == pytest.approx([300, 0, 0], abs=10)
        assert true == pytest.approx(pose, abs=30)


def test_a_task_that_begins_with_the_robot_sends_no_state_without_its_values(tmp_path):
    robot = robot_of(tmp_path, WatchedHub(lambda kind, values: None), camera=GEOMETRIC)
    motion = ShortMotion(lambda rover: rover.straight(100, wait=False))
    robot.start(motion)
    with closing(robot):
        robot.open()
        assert motion.wait(LIMIT_S)
        assert robot.failure is None


@pytest.mark.slow
def test_clients_are_told_where_the_sonar_of_the_robot_that_drives_is(tmp_path):
    built_in = read_mission_file(None)
    built = with_table(built_in, "robot", sonar_forward_mm=160.0)
    places: queue.SimpleQueue[float] = queue.SimpleQueue()
    hub = ToldHub(lambda kind, values: places.put(values["sonar_forward_mm"]) if kind == "robot" else None)
    robot = robot_of(tmp_path, hub, camera=GEOMETRIC, mission=built)
    with closing(robot):
        robot.open()
        assert places.get(timeout=LIMIT_S) == 160.0
        robot.start_mission(built_in, confirm=False)
        assert places.get(timeout=LIMIT_S) == 100.0
        robot.end_task()
        assert places.get(timeout=LIMIT_S) == 160.0


def test_clients_are_told_which_sensors_the_robot_does_not_have(tmp_path):
    mission = with_table(read_mission_file(None), "robot", touch=0)
    driving = threading.Event()
    robot = robot_of(tmp_path, hub_setting(driving, "state", doing="driving"), mission=mission)
    hold_stick(robot, 1.0, 0.0)
    with closing(robot):
        robot.open()
        assert driving.wait(LIMIT_S)
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
    with unplugged_while_turning(hub_setting(lost, "link", lost=True), tmp_path) as robot:
        assert lost.wait(LIMIT_S)
        robot.controls.steer(0.0, 1.0, math.inf)
        assert robot.controls.wanted(0.0) == (0.0, 0.0)


def test_of_a_lost_brick_nothing_old_is_shown_and_a_stop_is(tmp_path):
    shown, unreachable, stopped = [], threading.Event(), threading.Event()

    def note(kind, values):
        if kind == "state":
            shown.append(values)
            if values["doing"] == "cannot be driven":
                (stopped if values["stopped"] else unreachable).set()

    with unplugged_while_turning(ToldHub(note), tmp_path) as robot:
        assert unreachable.wait(LIMIT_S)
        robot.stop()
        assert stopped.wait(LIMIT_S)
    assert "driving" in {each["doing"] for each in shown}
    assert shown[0].keys() - shown[-1].keys() == {"range_mm", "touching", "battery_mv", "latency_ms"}


def test_the_pause_of_a_mission_that_cannot_begin_is_over_with_it(tmp_path):
    (tmp_path / "runs").write_text("a file, no folder", encoding="utf-8")
    sent, failed = {"paused": {"paused": False}}, threading.Event()

    def note(kind, values):
        sent[kind] = values
        if kind == "problem":
            failed.set()

    robot = robot_of(tmp_path / "runs", ToldHub(note))
    robot.start_mission(read_mission_file(None), confirm=False)
    robot.mission.pause()
    assert sent["paused"]["paused"]
    with closing(robot):
        robot.open()
        assert failed.wait(LIMIT_S)
        assert not sent["paused"]["paused"]


def test_a_mission_that_cannot_begin_does_not_move_the_frame_of_the_pose(tmp_path):
    (tmp_path / "runs").write_text("a file, no folder", encoding="utf-8")
    failed = threading.Event()
    robot = robot_of(tmp_path / "runs", hub_setting(failed, "problem"), camera=GEOMETRIC)
    with closing(robot):
        robot.open()
        ahead, reading = ShortMotion(lambda rover: rover.straight(300, wait=False)), ShortMotion()
        robot.start(ahead)
        assert ahead.wait(LIMIT_S)
        robot.start_mission(read_mission_file(None), confirm=False)
        assert failed.wait(LIMIT_S)
        robot.start(reading)
        assert reading.wait(LIMIT_S)
        assert reading.reading.pose.x_mm == pytest.approx(300, abs=10)


@pytest.mark.parametrize("end", [ShownMission.end, ShownMission.finish])
def test_a_mission_that_is_over_or_to_end_is_not_paused_any_more(end):
    paused = threading.Event()
    mission = ShownMission(read_mission_file(None), hub_setting(paused, "paused", paused=True), confirm=False)
    end(mission)
    mission.pause()  # by a thread that found it a moment ago
    assert not paused.is_set()


@pytest.mark.parametrize("fps", [5, 10, 15, 20, 30])
def test_a_webcam_of_any_rate_leaves_five_pictures_a_second(tmp_path, fps):
    folder, feed = CameraFolder(tmp_path / "camera"), PictureFeed(Hub())
    feed.watch(lambda frame: folder.add(frame.image, frame.time_s))
    for index in range(4 * fps):
        feed.frame(Frame(np.zeros((48, 64, 3), np.uint8), index / fps, index))
    folder.close()
    assert len(read_frames(tmp_path).frames) == 20
