"""The web server: the page and its WebSocket."""

from __future__ import annotations

import contextlib
import json
import logging
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib import resources
from mimetypes import guess_type
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from behaviors.mission import MissionError
from behaviors.profile_names import named_profiles
from firmware_protocol.errors import ConfigError
from input_files.json_text import MAX_BYTES
from input_files.plain import InputFileError, read_bytes
from nxtdrive.signals import handling

from ..calibrate.sheet import sheet_bytes
from . import connections
from .access import SESSION, Pin, PinGate, SameSite
from .calibration import Calibrations
from .chart import chart, recoveries
from .connections import BACKLOG, BoundedHTTP, LiveWebSocket, is_no_late_write, without_traceback
from .driver_arbiter import DriverArbiter
from .editor import Editor
from .hub import Client, Hub, as_message
from .messages import (
    MAX_MESSAGE_BYTES,
    VERSION,
    Answer,
    AnswerCalibration,
    Choose,
    Drive,
    Evidence,
    GiveControl,
    Message,
    PauseMission,
    Release,
    ResumeMission,
    SaveCalibration,
    SpeedLimit,
    StartCalibration,
    StartMission,
    Stop,
    StopMission,
    TakeControl,
    read_message,
)
from .mission_run import ShownMission, open_decision, under_way
from .missions import Missions
from .page_socket import Work, serve_page
from .photographs import Photographs
from .robot import Robot
from .runs import Runs

if TYPE_CHECKING:
    from nxtdrive.vision.detection import Image

STATIC = Path(str(resources.files(__package__))) / "static"
GRACE_S = 1
"""Clients have this time to close when the server ends."""


class WatchedRobot(Protocol):
    """A robot with a mission that clients watch; all methods may be called from any thread."""

    def picture(self) -> Image | None:
        """Return the camera's latest picture, if it has given one."""
        ...

    def stop(self) -> None:
        """Stop the robot and end its task, such as a mission."""
        ...

    def end_task(self) -> None:
        """End its task, such as a mission, if it has one."""
        ...

    @property
    def mission(self) -> ShownMission | None:
        """The mission that runs or is about to, if there is one."""
        ...


@dataclass
class Server:
    """One robot and its clients.

    Attributes:
        robot: The robot.
        hub: Sends its messages.
        missions: The missions that can be started.
        runs: The runs that can be replayed.
        address: The brick's, for the page.
        pin: The PIN without which no browser is let in, for a server that other computers can reach; else None.
        calibrations: The robot's; None where it cannot be calibrated.
    """

    robot: WatchedRobot
    hub: Hub
    missions: Missions
    runs: Runs
    address: str
    pin: Pin | None = None
    calibrations: Calibrations | None = None

    def __post_init__(self) -> None:
        self._arbiter = DriverArbiter(
            lambda driver, asking: self.hub.show("control", {"driver": driver, "asking": asking})
        )

    @property
    def driven(self) -> Robot | None:
        """The robot, if clients may drive it and start missions."""
        return self.robot if isinstance(self.robot, Robot) else None

    def app(self) -> Starlette:
        """Return the web application."""
        return guarded(self.routes(), self.pin)

    def routes(self) -> list[BaseRoute]:
        """Return the routes of the page, unguarded."""
        photographs = Photographs(self.missions.folder, lambda: self.robot.picture())  # noqa: PLW0108 - it is replaced
        return [
            WebSocketRoute("/ws", self._connect),
            *Editor(self.missions, photographs).routes(),
            Route("/api/sheet.pdf", self._sheet),
            Route("/api/runs", self._list_runs),
            Route("/api/runs/{name}", self._replay),
            Route("/runs/{name}/{file:path}", self._run_file),
            Mount("/", StaticFiles(directory=STATIC, html=True)),
        ]

    def _sheet(self, _request: Request) -> Response:
        return Response(sheet_bytes(".pdf"), media_type="application/pdf")

    def _list_runs(self, _request: Request) -> Response:
        mission = self.robot.mission
        return as_json(self.runs.listed(mission.run if mission else ""))

    def _replay(self, request: Request) -> Response:
        try:
            return as_json(self.runs.replay(request.path_params["name"]))
        except KeyError:
            return PlainTextResponse("There is no such run.\n", 404)
        except (ConfigError, MissionError) as error:  # the latter of what the run's profile is or returns
            return PlainTextResponse(f"{error}\n", 422)

    def _run_file(self, request: Request) -> Response:
        file = request.path_params["file"]
        try:
            # read as a whole: the journal of a run that is under way grows while it is sent
            content = read_bytes(self.runs.file(request.path_params["name"], file), MAX_BYTES)
        except KeyError:
            return PlainTextResponse("There is no such file.\n", 404)
        except InputFileError as error:  # too large, or gone meanwhile
            return PlainTextResponse(f"{error}\n", 404)
        return Response(content, media_type=guess_type(file)[0] or "application/octet-stream")

    async def _connect(self, page: WebSocket) -> None:
        await serve_page(
            page,
            self.hub,
            hello=self._hello,
            handle=lambda client, text: self._handle(client, read_message(text)),
            left=self._give_control,
        )

    def _give_control(self, client: Client) -> None:
        """Stop the robot for a driver that hands over or leaves; the next one's pad must return to its middle first."""
        if self._arbiter.driver == client.name and self.driven is not None:
            self.driven.stop_hand_drive()
        self._arbiter.give(client.name)

    def _handle(self, client: Client, message: Message) -> Work | None:
        """Execute a client's message, or return the part that takes longer.

        Raises:
            ValueError: It failed; the text says why.
        """
        robot, mission = self.robot, self.robot.mission
        match message:
            case Stop():
                robot.stop()
            case StopMission():
                robot.end_task()
            case PauseMission():
                under_way(mission).pause()
            case Choose(number=number):
                under_way(mission).operator.choose(number)
            case ResumeMission():
                if mission is not None:
                    mission.resume()
            case Answer(question=question, choice=choice):
                if mission is not None:
                    mission.operator.answer(question, choice)
            case Evidence():
                client.append(as_message("open_decision", open_decision(mission)))
            case _ if self.driven is not None:
                return self._control(self.driven, client, message)
            case _:
                raise ValueError("This page shows one run. Start `nxtdrive web` to drive and to start missions.")
        return None

    def _control(self, robot: Robot, client: Client, message: Message) -> Work | None:
        match message:
            case Drive():
                if not self._arbiter.take(client.name) and (message.ahead or message.turn):
                    raise ValueError(f"Another page ({self._arbiter.driver}) drives. It has been asked for control.")
                if self._arbiter.driver == client.name:
                    robot.drive(message.ahead, message.turn)
            case Release():
                robot.release()
            case SpeedLimit(percent=percent):
                robot.controls.percent = percent
            case TakeControl():
                self._arbiter.take(client.name)
            case GiveControl():
                self._give_control(client)
            case StartMission():
                return partial(self._start_mission, robot, message, robot.end_count)
            case StartCalibration() | AnswerCalibration() | SaveCalibration():
                return self._calibrate(robot, message)
        return None

    def _start_mission(self, robot: Robot, message: StartMission, end_count: int) -> None:
        mission, file = self.missions.load(message.mission, message.profile), self.missions.file(message.mission)
        robot.start_mission(mission, confirm=message.confirm, file=file, end_count=end_count)

    def _calibrate(self, robot: Robot, message: StartCalibration | AnswerCalibration | SaveCalibration) -> Work | None:
        if (calibrations := self.calibrations) is None:
            raise ValueError("Here the robot cannot be calibrated. Start `nxtdrive web` for it alone.")
        match message:
            case StartCalibration():
                return partial(calibrations.start, message, partial(robot.start, end_count=robot.end_count))
            case AnswerCalibration(question=question, value=value):
                calibrations.answer(question, value)
            case SaveCalibration():
                return calibrations.save
        return None

    def _hello(self, client: Client) -> dict[str, object]:
        return {
            "version": VERSION,
            "you": client.name,
            "address": self.address,
            "drives": self.driven is not None,
            "missions": self.missions.names(),
            "proposed": self.missions.proposed,
            "profiles": named_profiles(),
            "chart": chart(),
            "recoveries": recoveries(),
        }


def as_json(value: object) -> Response:
    """Answer in ASCII: names from outside may be no valid UTF-8."""
    return Response(json.dumps(value), media_type="application/json")


def guarded(routes: list[BaseRoute], pin: Pin | None) -> Starlette:
    """Return the web application of some routes; with a PIN, other computers may use it after entering that."""
    session = Route(SESSION, pin.answer, methods=["GET", "POST"]) if pin else Route(SESSION, _admit)
    middleware = [Middleware(SameSite, lan=pin is not None)]
    if pin is not None:
        middleware.append(Middleware(PinGate, pin=pin))
    return Starlette(routes=[session, *routes], middleware=middleware, exception_handlers={ClientDisconnect: _left})


def _admit(_request: Request) -> Response:
    """Answer that no PIN is needed."""
    return Response(status_code=204)


def _left(_request: Request, _error: Exception) -> Response:
    """Answer a client that has left in the middle of its request; the answer goes unread."""
    return Response(status_code=400)


def serve(server: Server, robot: Robot, listener: socket.socket, ready: Callable[[], None]) -> None:
    """Open the robot and serve the page until a signal comes or the robot's thread ends.

    Args:
        server: What to serve.
        robot: The server's.
        listener: A bound socket.
        ready: Called when the robot is open.

    Raises:
        NXTError: Brick or camera cannot be opened.
        KeyboardInterrupt: Ctrl-C.
    """
    http = http_server(server.app())
    robot.open(on_end=lambda: setattr(http, "should_exit", True))
    ready()
    run_until_signal(http, listener)


@contextlib.contextmanager
def serving(server: Server, listener: socket.socket) -> Iterator[None]:
    """Serve the page in a thread of its own until the end of the block; then clients get their pending messages.

    Args:
        server: What to serve.
        listener: A bound socket.
    """
    http = http_server(server.app())
    thread = threading.Thread(target=http.run, args=([listener],), name="nxtdrive page", daemon=True)
    thread.start()
    try:
        yield
    finally:
        server.hub.flush(GRACE_S)
        http.should_exit = True
        thread.join(2 * GRACE_S)


def run_until_signal(http: uvicorn.Server, listener: socket.socket) -> None:
    """Serve until a signal comes.

    uvicorn itself ends by SIGINT and SIGTERM alone, in a closed terminal it would break; and a Ctrl-C while it begins
    would leave a traceback.

    Args:
        http: The server.
        listener: A bound socket.
    """
    with handling(lambda *_: setattr(http, "should_exit", True), ("SIGHUP", "SIGINT")):
        http.run(sockets=[listener])


def http_server(app: Starlette) -> uvicorn.Server:
    """Return a server of a web application."""
    config = uvicorn.Config(
        app,
        http=BoundedHTTP,
        ws=LiveWebSocket,
        ws_ping_interval=connections.PING_S,
        ws_ping_timeout=connections.PONG_S,
        backlog=BACKLOG,
        log_level="warning",
        ws_max_size=MAX_MESSAGE_BYTES,
        timeout_graceful_shutdown=GRACE_S,
        lifespan="off",
    )
    logging.getLogger("uvicorn.error").addFilter(without_traceback)
    logging.getLogger("asyncio").addFilter(is_no_late_write)
    return uvicorn.Server(config)
