"""The requests of the page that edits missions and photographs their targets."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from anyio.to_thread import run_sync
from pydantic import BaseModel, ConfigDict, TypeAdapter
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

from nxtdrive.cli.templates.mission import template

from .messages import read
from .missions import Conflict, Missions
from .photographs import NewTarget, Photographs

MAX_BYTES = 256 * 1024
"""Longest body of a request; a mission file is some kilobytes long."""
B = TypeVar("B", bound=BaseModel)


class Text(BaseModel):
    """A mission's text to check."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    text: str


class File(Text):
    """A mission file to save.

    Attributes:
        version: As it was opened; empty for a new file.
    """

    version: str


class TooLong(ValueError):
    """The body of a request has more than `MAX_BYTES`."""


class Editor:
    """Lists, opens, checks and saves missions, and adds targets to them.

    Args:
        missions: The mission files.
        photographs: Of targets.
    """

    def __init__(self, missions: Missions, photographs: Photographs) -> None:
        self._missions = missions
        self._photographs = photographs

    def routes(self) -> list[Route]:
        """Return the routes of the editor."""
        return [
            Route("/api/missions", self._list),
            Route("/api/missions/{name}", self._open),
            Route("/api/missions/{name}", self._save, methods=["PUT"]),
            Route("/api/template", self._template),
            Route("/api/check", self._check, methods=["POST"]),
            Route("/api/pictures", self._take, methods=["POST"]),
            Route("/api/targets", self._add, methods=["POST"]),
        ]

    def _list(self, _request: Request) -> Response:
        return JSONResponse(self._missions.names())

    def _template(self, _request: Request) -> Response:
        return PlainTextResponse(template())

    def _open(self, request: Request) -> Response:
        try:
            text, version = self._missions.read(request.path_params["name"])
        except (KeyError, ValueError):  # the latter when it has just been replaced by what is not a mission
            return PlainTextResponse("There is no such mission.\n", 404)
        return JSONResponse({"text": text, "version": version})

    def _take(self, _request: Request) -> Response:
        try:
            number, png = self._photographs.take()
        except ValueError as error:
            return PlainTextResponse(f"{error}\n", 422)
        return Response(png, media_type="image/png", headers={"x-picture": str(number)})

    async def _add(self, request: Request) -> Response:
        return await answered(request, NewTarget, self._photographs.add)

    async def _check(self, request: Request) -> Response:
        def check(wanted: Text) -> object:
            found = self._missions.check(wanted.text)
            return {"mistakes": found.mistakes, "warnings": found.warnings}

        return await answered(request, Text, check)

    async def _save(self, request: Request) -> Response:
        def save(file: File) -> object:
            return {"version": self._missions.save(request.path_params["name"], file.text, file.version)}

        return await answered(request, File, save)


async def answered(request: Request, kind: type[B], work: Callable[[B], object]) -> Response:
    """Read a request's JSON, do the work in a thread, and answer with its result, or with why it cannot be done."""
    try:
        body = await _body(request, kind)
        return JSONResponse(await run_sync(work, body))
    except TooLong as error:
        return PlainTextResponse(f"{error}\n", 413)
    except Conflict as conflict:
        return PlainTextResponse(f"{conflict}\n", 409)
    except ValueError as error:
        return PlainTextResponse(f"{error}\n", 422)
    except OSError as error:
        return PlainTextResponse(f"The folder of the missions cannot be written ({error.strerror}).\n", 500)


async def _body(request: Request, kind: type[B]) -> B:
    content = b""
    async for part in request.stream():
        content += part
        if len(content) > MAX_BYTES:
            raise TooLong(f"This is too long. At most {MAX_BYTES // 1024} kB can be sent.")
    return read(TypeAdapter(kind), content)
