"""All robots of a classroom: opened, started, stopped and watched together, each in its own threads."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

import cv2

from behaviors.mission import Mission
from nxtdrive.vision.detectors.scaling import at_height

from ..hub import Client, Hub, image_message
from ..missions import Missions
from ..page_socket import Work
from .config import ClassroomConfig
from .messages import Beep, ClassroomMessage, End, ReleaseAll, ReturnToBrick, Start, StopAll, Visible
from .station import CLOSE_S, Station

TILE_EVERY_S = 0.5
"""Period of the tiles' state and pictures."""
TILE_PICTURE = 4
"""First byte of a binary message whose image is the picture of a tile."""
TILE_HEIGHT_PX, TILE_QUALITY = 120, 70
"""Height of a tile's picture, and its JPEG quality."""


class Classroom:
    """The robots of a classroom.

    Args:
        config: Their descriptions.
        built: How a robot is built when it is driven by hand.
        robot: The robot file of all missions; by default the one that a mission names.

    Attributes:
        config: As given.
        hub: Sends messages to the classroom's page.
        missions: The missions that can be handed out.
        stations: The robots, in order.
    """

    def __init__(self, config: ClassroomConfig, built: Mission, robot: Path | None = None) -> None:
        self.config = config
        self.hub = Hub()
        self.missions = Missions(config.missions, robot)
        self.stations = [Station(entry, built, self.missions, config.runs / entry.name) for entry in config.robots]
        self._by_name = {station.entry.name: station for station in self.stations}
        self._visible: dict[Client, frozenset[str]] = {}
        self._sent: dict[tuple[Client, str], object] = {}
        self._shown: list[dict[str, Any]] = []
        self._closing = threading.Event()
        self._board = threading.Thread(target=self._show, name="nxtdrive classroom", daemon=True)

    def open(self) -> None:
        """Begin to open all robots at the same time; returns at once."""
        for station in self.stations:
            station.open()
        self._board.start()

    def close(self) -> None:
        """End all missions, stop all motors, close all robots at the same time."""
        self._closing.set()
        for station in self.stations:
            station.begin_closing()
        latest_s = time.monotonic() + CLOSE_S
        for station in self.stations:
            station.close(max(0.0, latest_s - time.monotonic()))

    def leave(self, client: Client) -> None:
        """Forget which pictures a client sees."""
        self._visible.pop(client, None)

    def handle(self, client: Client, message: ClassroomMessage) -> Work | None:
        """Execute a client's message, or return the part that takes longer.

        Raises:
            ValueError: Some of it failed; the text says what and why. The rest is done.
        """
        match message:
            case StopAll():
                for station in self.stations:
                    station.stop()
            case ReleaseAll():
                for station in self.stations:
                    station.release()
            case Start(robots=names, mission=mission, profile=profile):
                end_counts = {station: station.end_count for station in self.stations}

                def start(station: Station) -> None:
                    station.start(_chosen(station, mission), profile, end_counts[station])

                return partial(self._each, names, start)
            case End(robots=names):
                self._each(names, Station.end_mission)
            case Beep(robot=name):
                self._each([name], Station.beep)
            case ReturnToBrick(robot=name):
                self._each([name], Station.return_to_brick)
            case Visible(robots=names):
                self._visible[client] = frozenset(names)
        self._show_tiles()
        return None

    def _each(self, names: Iterable[str], action: Callable[[Station], None]) -> None:
        """Do the same with some robots; a failure of one does not affect the others."""
        refused = []
        for name in dict.fromkeys(names):
            try:
                if (station := self._by_name.get(name)) is None:
                    raise ValueError("There is no robot of this name.")
                action(station)
            except ValueError as error:
                refused.append(f"{name}: {error}")
        if refused:
            raise ValueError("\n".join(refused))

    def _show(self) -> None:
        while not self._closing.wait(TILE_EVERY_S):
            self._show_tiles()
            self._show_pictures()

    def _show_tiles(self) -> None:
        tiles = [station.tile() for station in self.stations]
        if tiles != self._shown:
            self._shown = tiles
            self.hub.show("robots", {"robots": tiles})

    def _show_pictures(self) -> None:
        """Send each client the new pictures of the tiles that it sees."""
        visible = dict(self._visible)
        for number, station in enumerate(self.stations):
            name = station.entry.name
            watching = [client for client, names in visible.items() if name in names]
            station.hub.small_pictures = bool(watching)
            image = station.picture() if watching else None
            if image is None:
                continue
            fresh = [client for client in watching if self._sent.get((client, name)) is not image]
            if not fresh:
                continue
            small = at_height(image, TILE_HEIGHT_PX)
            jpeg = cv2.imencode(".jpg", small, (cv2.IMWRITE_JPEG_QUALITY, TILE_QUALITY))[1].tobytes()
            for client in fresh:
                self._sent[client, name] = image
                client.put((TILE_PICTURE, number), image_message(TILE_PICTURE, number, 0.0, jpeg))
        self._sent = {key: image for key, image in self._sent.items() if key[0] in visible}


def _chosen(station: Station, mission: str | None) -> str:
    return station.entry.mission if mission is None else mission
