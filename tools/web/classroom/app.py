"""The web server of a classroom: its page, and the page of each robot under ``/robot/NAME/``."""

from __future__ import annotations

import html
import socket
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import IO

from anyio.to_thread import run_sync
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import (
    FileResponse,
    HTMLResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
    StreamingResponse,
)
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from behaviors.profile_names import named_profiles

from ..access import Pin
from ..app import STATIC, as_json, guarded, http_server, run_until_signal
from ..hub import Client
from ..messages import VERSION
from ..page_socket import serve_page
from .classroom import Classroom
from .messages import read_message
from .results import results, results_csv, write_zip

PAGE = STATIC / "classroom.html"
CHUNK_BYTES = 64 * 1024
NO_ROBOT = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>nxtdrive: no such robot</title>
<link rel="stylesheet" href="/style.css">
<link rel="icon" href="data:,">
</head>
<body>
<header><h1>nxtdrive</h1></header>
<main><section>There is no robot "{name}" in this classroom. <a href="/">Back to {classroom}</a></section></main>
</body>
</html>
"""
"""In place of the page of an unknown robot."""


@dataclass
class ClassroomServer:
    """The pages of a classroom.

    Attributes:
        classroom: The robots.
        pin: The PIN without which no browser is let in, for a server that other computers can reach; else None.
    """

    classroom: Classroom
    pin: Pin | None = None

    def app(self) -> Starlette:
        """Return the web application."""
        robots = [
            Mount(f"/robot/{station.entry.name}", routes=station.server.routes()) for station in self.classroom.stations
        ]
        return guarded(
            [
                WebSocketRoute("/ws", self._connect),
                Route("/", lambda _: FileResponse(PAGE)),
                Route("/api/results", self._results),
                Route("/results.csv", self._csv),
                Route("/runs.zip", self._zip),
                *robots,
                Route("/robot/{name:path}", self._robot),
                Mount("/", StaticFiles(directory=STATIC)),
            ],
            self.pin,
        )

    async def _connect(self, page: WebSocket) -> None:
        classroom = self.classroom
        await serve_page(
            page,
            classroom.hub,
            hello=self._hello,
            handle=lambda client, text: classroom.handle(client, read_message(text)),
            left=classroom.leave,
        )

    def _hello(self, client: Client) -> dict[str, object]:
        config = self.classroom.config
        robots = [
            {"name": each.name, "color": each.color, "address": str(each.address), "mission": each.mission}
            for each in config.robots
        ]
        return {
            "version": VERSION,
            "you": client.name,
            "name": config.name,
            "robots": robots,
            "missions": self.classroom.missions.names(),
            "profiles": named_profiles(),
        }

    def _robot(self, request: Request) -> Response:
        """Add the slash that a robot's page ends with, or say that there is no such robot."""
        name = request.path_params["name"]
        if any(name == station.entry.name for station in self.classroom.stations):
            return RedirectResponse(f"{request.url.path}/")
        name = html.escape(name.partition("/")[0])
        return HTMLResponse(NO_ROBOT.format(name=name, classroom=html.escape(self.classroom.config.name)), 404)

    def _results(self, _request: Request) -> Response:
        return as_json(results(self.classroom.config))

    def _csv(self, _request: Request) -> Response:
        text = results_csv(results(self.classroom.config))
        return Response(text.encode(errors="replace"), headers=_attached("results.csv"), media_type="text/csv")

    async def _zip(self, _request: Request) -> Response:
        """Send all runs; the file is made in a thread, on the disk and not in memory."""
        try:
            file = tempfile.TemporaryFile(prefix="nxtdrive-runs-")  # noqa: SIM115 - the answer closes it
            await run_sync(write_zip, self.classroom.config, file)
        except OSError as error:
            return PlainTextResponse(f"The runs cannot be collected ({error.strerror}).\n", 500)
        headers = {**_attached("runs.zip"), "content-length": str(file.tell())}
        return StreamingResponse(_chunks(file), headers=headers, media_type="application/zip")


def _chunks(file: IO[bytes]) -> Iterator[bytes]:
    """Yield a file's contents from its beginning, then close it."""
    with file:
        file.seek(0)
        while chunk := file.read(CHUNK_BYTES):
            yield chunk


def _attached(name: str) -> dict[str, str]:
    return {"content-disposition": f'attachment; filename="{name}"'}


def serve_classroom(server: ClassroomServer, listener: socket.socket, ready: Callable[[], None]) -> None:
    """Open the robots and serve their pages until a signal comes.

    Args:
        server: What to serve.
        listener: A bound socket.
        ready: Called when the robots are being opened.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    http = http_server(server.app())
    server.classroom.open()
    ready()
    run_until_signal(http, listener)
