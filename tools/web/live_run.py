"""The page of one run, for `nxtdrive run --web`: clients watch, pause, end and answer; they cannot drive."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from behaviors.executive import Report
from behaviors.mission import Mission
from behaviors.observers import Observers
from nxtdrive.mission.assembly import MissionRun, OpenRobot

from .app import Server, serving
from .hub import Hub
from .mission_run import ShownMission
from .missions import Missions
from .pictures import PictureFeed
from .runs import Runs

if TYPE_CHECKING:
    from nxtdrive.vision.detection import Image


class LiveRun:
    """A run with a page; replaces the page's robot.

    Args:
        mission: The mission.
        listener: A bound socket, where the page is served.
        confirm: Whether clients confirm each recovery.
        file: The mission's file, for hints; None for the built-in one.
        runs: Where runs are kept.
    """

    def __init__(
        self, mission: Mission, listener: socket.socket, *, confirm: bool, file: Path | None, runs: Path
    ) -> None:
        self._hub = Hub()
        self._pictures = PictureFeed(self._hub)
        self._shown = ShownMission(mission, self._hub, confirm=confirm, file=file)
        self._listener = listener
        self._missions = Missions(file.parent if file else Path())
        self._runs = Runs(runs)
        self._address = ""

    def assemble(self, robot: OpenRobot, observers: Observers, say_hint: Callable[[str], None]) -> MissionRun:
        """Assemble the mission; see `ShownMission.assemble`."""
        self._address = robot.address
        run = self._shown.assemble(robot, observers, say_hint)
        # the frames of the video and the looks: others would change a simulated camera's noise, and with it the run
        robot.watch(self._pictures.frame)
        run.on_look(lambda frame, *_: self._pictures.frame(frame))
        return run

    def pursue(self, run: MissionRun, folder: str) -> Report:
        """Run the mission while serving the page; at the end clients get their pending messages.

        Args:
            run: As `assemble` returned it.
            folder: Name of the run folder.
        """
        server = Server(self, self._hub, self._missions, self._runs, self._address)
        with serving(server, self._listener):
            return self._shown.pursue(run, folder)

    def stop(self) -> None:
        """End the mission; any thread."""
        self._shown.end()

    end_task = stop  # clients cannot drive here, so no stop has to last until it is released

    @property
    def mission(self) -> ShownMission | None:
        """The mission, until it has ended; any thread."""
        return None if self._shown.over else self._shown

    def picture(self) -> Image | None:
        """Return the camera's latest picture, if it has given one; any thread."""
        return self._pictures.latest
