"""A simulated robot of a classroom: it renders frames only for viewers, and its mission does not depend on that."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from nxtdrive.mission.assembly import open_robot
from nxtdrive.tools.web.hub import Client, Hub
from nxtdrive.tools.web.pictures import PictureFeed
from nxtdrive.vision.target_vision import CameraVision, GeometricVision
from tests.tools.web.pages import hub_setting, robot_of


@pytest.fixture
def client() -> Iterator[Client]:
    """A page that reads nothing."""
    with closing(asyncio.new_event_loop()) as loop:
        yield Client(loop, "page")


def test_frames_without_a_reader_are_not_rendered():
    numbers: list[int] = []
    with open_robot("sim://open", "geometric") as robot:
        robot.watch(lambda frame: numbers.append(frame.index), 20, lambda number: number % 10 == 0)
        robot.brick.sleep(1.6)
    assert numbers == [0, 10, 20, 30]


def test_more_frames_are_wanted_the_closer_someone_looks(client):
    hub = Hub()
    feed = PictureFeed(hub)

    def wanted() -> int:
        return sum(map(feed.needs, range(feed.fps)))

    assert wanted() == 0
    hub.small_pictures = True
    assert wanted() == 2
    hub.join(client)
    assert wanted() == 10
    feed.watch(lambda _: None)
    assert wanted() == 5  # those of the video


@pytest.mark.parametrize(
    ("camera", "target", "vision"),
    [("geometric", "lena", GeometricVision), ("geometric", "rilakkuma", CameraVision), ("sim", "lena", CameraVision)],
)
def test_frames_are_searched_only_for_targets_without_a_name_in_the_world(camera, target, vision, mission_for):
    with open_robot("sim://open", camera) as robot:
        assert type(robot.vision(mission_for(target))) is vision


def _journal(folder: Path, mission: Any, watchers: list[Client]) -> bytes:
    ended = threading.Event()
    hub = hub_setting(ended, "ended")
    for watcher in watchers:
        hub.join(watcher)
    with closing(robot_of(folder, hub, "sim://open?pace=fast", "geometric")) as robot:
        robot.start_mission(mission, confirm=False)
        robot.open()
        assert ended.wait(60)
    (journal,) = folder.glob("*/journal.jsonl")
    return journal.read_bytes()


@pytest.mark.slow
def test_watchers_do_not_change_its_mission(tmp_path, mission_for, client):
    alone = _journal(tmp_path / "alone", mission_for("lena"), [])
    watched = _journal(tmp_path / "watched", mission_for("lena"), [client])
    assert alone == watched
    assert len(alone) > 1000
