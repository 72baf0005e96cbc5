"""The web server: the page and its WebSocket."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib import resources
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import anyio
import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from firmware_protocol.errors import ConfigError

from .access import SESSION, Pin, PinGate, SameSite
from .chart import chart, recoveries
from .editor import Editor
from .hub import Client, Hub
from .messages import (
    MAX_MESSAGE_BYTES,
    VERSION,
    Answer,
    Drive,
    GiveWheel,
    Message,
    PauseMission,
    Release,
    ResumeMission,
    SpeedLimit,
    StartMission,
    Stop,
    StopMission,
    TakeWheel,
    read_message,
)
from .missions import Missions
from .photographs import Photographs
from .robot import Robot
from .runs import Runs
from .wheel import Wheel

if TYPE_CHECKING:
    from nxtdrive.vision.detection import Image

STATIC = Path(str(resources.files(__package__))) / "static"
MAX_CLIENTS = 50
GRACE_S = 1
"""Clients have this time to close when the server ends."""
TRY_LATER = 1013
"""WebSocket close code "try again later". Source: the IANA registry of close codes."""


class Watched(Protocol):
    """A robot with a mission that clients watch; all methods may be called from any thread."""

    def picture(self) -> Image | None:
        """Return the camera's latest picture, if it has given one."""
        ...

    def stop(self) -> None:
        """Stop the robot and end a running mission."""
        ...

    def stop_mission(self) -> None:
        """End the running mission, if there is one."""
        ...

    def pause_mission(self) -> None:
        """Let the robot stand until `resume_mission`; `ValueError` says why it cannot."""
        ...

    def resume_mission(self) -> None:
        """End the pause, if there is one."""
        ...

    def answer(self, question: int, choice: int) -> None:
        """Answer a question."""
        ...


@dataclass
class Server:
    """One robot and its clients.

    Attributes:
        robot: The robot; a `Robot` can also be driven by hand, and missions be started.
        hub: What it tells.
        missions: The missions that can be started.
        runs: The runs that can be replayed.
        address: The brick's, for the page.
        pin: The PIN without which no browser is let in, for a server that other computers can reach; else None.
    """

    robot: Robot | Watched
    hub: Hub
    missions: Missions
    runs: Runs
    address: str
    pin: Pin | None = None
    _numbers: Iterator[int] = field(default_factory=lambda: count(1))

    def __post_init__(self) -> None:
        self._wheel = Wheel(lambda driver, asking: self.hub.show("wheel", {"driver": driver, "asking": asking}))

    def app(self) -> Starlette:
        """Return the web application."""
        routes: list[BaseRoute] = [
            WebSocketRoute("/ws", self._connect),
            Route(SESSION, self.pin.answer, methods=["GET", "POST"]) if self.pin else Route(SESSION, _admit),
            *Editor(self.missions, Photographs(self.missions.folder, self.robot.picture)).routes(),
            Route("/api/runs", self._list_runs),
            Route("/api/runs/{name}", self._replay),
            Route("/runs/{name}/{file:path}", self._run_file),
            Mount("/", StaticFiles(directory=STATIC, html=True)),
        ]
        middleware = [Middleware(SameSite, lan=self.pin is not None)]
        if self.pin is not None:
            middleware.append(Middleware(PinGate, pin=self.pin))
        return Starlette(routes=routes, middleware=middleware)

    def _list_runs(self, _request: Request) -> Response:
        return _json(self.runs.listed())

    def _replay(self, request: Request) -> Response:
        try:
            return _json(self.runs.replay(request.path_params["name"]))
        except KeyError:
            return PlainTextResponse("There is no such run.\n", 404)
        except ConfigError as error:
            return PlainTextResponse(f"{error}\n", 422)

    def _run_file(self, request: Request) -> Response:
        try:
            return FileResponse(self.runs.file(request.path_params["name"], request.path_params["file"]))
        except KeyError:
            return PlainTextResponse("There is no such file.\n", 404)

    async def _connect(self, page: WebSocket) -> None:
        await page.accept()
        if len(self.hub.clients) >= MAX_CLIENTS:
            await page.close(TRY_LATER, "too many pages are open")
            return
        client = Client(asyncio.get_running_loop(), f"page {next(self._numbers)}")
        await page.send_json(self._hello(client))
        self.hub.join(client)
        try:
            async with anyio.create_task_group() as both:
                both.start_soon(self._send, page, client, both.cancel_scope)
                both.start_soon(self._receive, page, client, both.cancel_scope)
        finally:
            self.hub.leave(client)
            if self._wheel.driver == client.name and isinstance(self.robot, Robot):
                self.robot.let_go()
            self._wheel.give(client.name)
            if client.too_slow:
                await page.close(TRY_LATER, "this page is too slow")

    async def _send(self, page: WebSocket, client: Client, both: anyio.CancelScope) -> None:
        with contextlib.suppress(WebSocketDisconnect):
            while not client.too_slow:
                for message in await client.next():
                    if isinstance(message, bytes):
                        await page.send_bytes(message)
                    else:
                        await page.send_text(message)
        both.cancel()

    async def _receive(self, page: WebSocket, client: Client, both: anyio.CancelScope) -> None:
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                text = await page.receive_text()
                try:
                    self._obey(client, read_message(text))
                except ValueError as error:
                    await page.send_json({"type": "refused", "text": str(error)})
        both.cancel()

    def _obey(self, client: Client, message: Message) -> None:
        """Do what a client asks.

        Raises:
            ValueError: It cannot be done; the text says why.
        """
        robot = self.robot
        match message:
            case Stop():
                robot.stop()
            case StopMission():
                robot.stop_mission()
            case PauseMission():
                robot.pause_mission()
            case ResumeMission():
                robot.resume_mission()
            case Answer(question=question, choice=choice):
                robot.answer(question, choice)
            case _ if isinstance(robot, Robot):
                self._control(robot, client, message)
            case _:
                raise ValueError("This page shows one run. Start `nxtdrive web` to drive and to start missions.")

    def _control(self, robot: Robot, client: Client, message: Message) -> None:
        match message:
            case Drive():
                if not self._wheel.take(client.name) and (message.ahead or message.aside):
                    raise ValueError(f"{self._wheel.driver} drives; it has been asked for the wheel.")
                if self._wheel.driver == client.name:
                    robot.drive(message.ahead, message.aside)
            case Release():
                robot.release()
            case SpeedLimit(percent=percent):
                robot.controls.percent = percent
            case TakeWheel():
                self._wheel.take(client.name)
            case GiveWheel():
                self._wheel.give(client.name)
            case StartMission(mission=name):
                mission = self.missions.load(name, message.profile)
                robot.start_mission(mission, confirm=message.confirm, file=self.missions.file(name))

    def _hello(self, client: Client) -> dict[str, object]:
        return {
            "type": "hello",
            "version": VERSION,
            "you": client.name,
            "address": self.address,
            "drives": isinstance(self.robot, Robot),
            "missions": self.missions.names(),
            "chart": chart(),
            "recoveries": recoveries(),
        }


def _json(value: object) -> Response:
    """Answer in ASCII: names from outside may be no valid UTF-8."""
    return Response(json.dumps(value), media_type="application/json")


def _admit(_request: Request) -> Response:
    """Answer that no PIN is needed."""
    return Response(status_code=204)


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
    http = _http(server)
    robot.open(on_end=lambda: setattr(http, "should_exit", True))
    ready()
    http.run(sockets=[listener])


@contextlib.contextmanager
def serving(server: Server, listener: socket.socket) -> Iterator[None]:
    """Serve the page in a thread of its own until the end of the block, where clients get what is waiting for them.

    Args:
        server: What to serve.
        listener: A bound socket.
    """
    http = _http(server)
    thread = threading.Thread(target=http.run, args=([listener],), name="nxtdrive page", daemon=True)
    thread.start()
    try:
        yield
    finally:
        server.hub.flush(GRACE_S)
        http.should_exit = True
        thread.join(2 * GRACE_S)


def _http(server: Server) -> uvicorn.Server:
    config = uvicorn.Config(
        server.app(),
        log_level="warning",
        ws_max_size=MAX_MESSAGE_BYTES,
        timeout_graceful_shutdown=GRACE_S,
        lifespan="off",
    )
    return uvicorn.Server(config)
