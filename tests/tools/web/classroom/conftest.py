"""Running classrooms of simulated robots."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from nxtdrive.mission.files import read_mission_file
from nxtdrive.tools.web.classroom.classroom import Classroom
from nxtdrive.tools.web.classroom.config import ClassroomConfig, RobotEntry
from nxtdrive.transports.address import Address

PATIENCE_S = 30.0


def until(happens: Callable[[], object]) -> None:
    """Wait until something happens."""
    latest_s = time.monotonic() + PATIENCE_S
    while not happens():
        assert time.monotonic() < latest_s
        threading.Event().wait(0.005)


def simulated(name: str, pace: str = "realtime") -> RobotEntry:
    """Return a simulated robot before one picture."""
    return RobotEntry(name, "#c4161c", Address("sim", "open", {"pace": pace}))


@pytest.fixture
def running(tmp_path) -> Callable[..., contextmanager[Classroom]]:
    """Opens a class of some robots in a folder of its own."""

    @contextmanager
    def run(*robots: RobotEntry) -> Iterator[Classroom]:
        folder = Path(tmp_path)
        classroom = Classroom(ClassroomConfig("7b", robots, folder / "runs", folder), read_mission_file(None))
        classroom.open()
        try:
            yield classroom
        finally:
            classroom.close()

    return run
