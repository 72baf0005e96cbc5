"""Running classrooms of simulated robots."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from nxtdrive.mission.files import read_mission_file
from nxtdrive.tools.web.classroom.classroom import Classroom
from nxtdrive.tools.web.classroom.config import ClassroomConfig, RobotEntry
from nxtdrive.transports.address import Address


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
