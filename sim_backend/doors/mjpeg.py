"""The simulated camera as an MJPEG stream over HTTP, like that of a network camera; browsers and OpenCV read it.

The simulation publishes frames and never waits. One thread serves all viewers; each gets the latest frame and skips
those that arrived while its connection was busy. A connection has a deadline for its request and for each frame.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from functools import partial
from http import HTTPStatus
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_backend.doors.door import ACCEPT_AGAIN_S, LOOPBACK, SEND_BUFFER
from sim_backend.doors.loop_door import LoopDoor

LOG = logging.getLogger(__name__)

STREAM = "/camera.mjpg"
BOUNDARY = "frame"
JPEG_QUALITY = 80
"""Typical of webcams; the detectors were measured at this quality (docs/ranges.md)."""

VIEWER_LIMIT = 16
"""Viewers at a time; a further one is answered 503."""

WAITING_LIMIT = 64
"""Connections whose request is not complete; a further one takes the place of the oldest."""

REQUEST_S = 5.0
"""Deadline of a whole request."""

STALLED_S = 5.0
"""A viewer that takes longer for a frame is disconnected."""

LINE_LIMIT = 8192
"""Longest line of a request in bytes."""


def coded(image: NDArray[np.uint8]) -> bytes:
    """Code a BGR image as webcams do."""
    _, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return jpeg.tobytes()


class MjpegDoor(LoopDoor):
    """Serves ``http://127.0.0.1:PORT/camera.mjpg`` until closed.

    Attributes:
        url: Address of the stream.
    """

    def __init__(self, port: int = 0) -> None:
        """Start to listen.

        Args:
            port: TCP port on the loopback interface; 0 selects a free one. The stream has no password, so it is not
                available to other computers.

        Raises:
            ConfigError: See `LoopDoor`.
        """
        super().__init__("camera stream", LOOPBACK, port)
        self.url = f"http://{LOOPBACK}:{self.port}{STREAM}"
        self._waiting: dict[asyncio.Task[None], None] = {}
        self._viewers: set[asyncio.Task[None]] = set()
        self._full = False
        self._frame, self._number = b"", 0
        self._published = asyncio.Event()
        self._thread.start()

    @property
    def watched(self) -> bool:
        """Whether there is a viewer; without one no frame needs to be rendered."""
        return bool(self._viewers)

    def show(self, image: NDArray[np.uint8]) -> None:
        """Publish the BGR `image` as the latest frame; does not wait for slow viewers."""
        self._loop.call_soon_threadsafe(self._publish, coded(image))

    # --- in the thread ---

    async def _serve(self) -> None:
        self._listener.setblocking(False)
        self._loop.add_reader(self._listener, self._accept)
        await self._ended.wait()
        self._loop.remove_reader(self._listener)
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, (host, port) = self._listener.accept()
        except OSError:  # the client has left already, or too many files are open
            self._loop.remove_reader(self._listener)
            self._loop.call_later(ACCEPT_AGAIN_S, self._loop.add_reader, self._listener, self._accept)
            return
        connection.setblocking(False)
        if len(self._waiting) >= WAITING_LIMIT:
            next(iter(self._waiting)).cancel()
        task = asyncio.create_task(self._answer(connection, f"{host}:{port}"))
        self._waiting[task] = None
        task.add_done_callback(partial(self._disconnected, connection))

    def _disconnected(self, connection: socket.socket, task: asyncio.Task[None]) -> None:
        self._waiting.pop(task, None)
        self._viewers.discard(task)
        self._full = self._full and len(self._viewers) >= VIEWER_LIMIT
        connection.close()  # a task that was cancelled before it began has not

    def _publish(self, frame: bytes) -> None:
        self._frame, self._number = frame, self._number + 1
        self._published.set()
        self._published = asyncio.Event()

    async def _answer(self, connection: socket.socket, name: str) -> None:
        """Answer the request, then stream."""
        with contextlib.suppress(OSError):  # on macOS, if the viewer has left
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        task = cast("asyncio.Task[None]", asyncio.current_task())
        reader, writer = await asyncio.open_connection(sock=connection, limit=LINE_LIMIT)
        try:
            # a viewer leaves by closing the connection, possibly during a write
            with contextlib.suppress(OSError, TimeoutError):
                refusal = await self._refusal(reader, name)
                if refusal is None:
                    del self._waiting[task]
                    self._viewers.add(task)
                    await self._stream(writer)
                else:
                    await _refuse(writer, refusal)
        finally:
            writer.transport.abort()

    async def _refusal(self, reader: asyncio.StreamReader, name: str) -> HTTPStatus | None:
        """Read the request; return the status of a refusal, or None if it gets the stream."""
        try:
            async with asyncio.timeout(REQUEST_S):
                request = await reader.readline()
                while (await reader.readline()).strip():
                    pass  # the headers mean nothing here
        except TimeoutError:
            return HTTPStatus.REQUEST_TIMEOUT
        except ValueError:
            return HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
        words = request.split()
        if len(words) != 3 or not words[2].startswith(b"HTTP/"):
            return HTTPStatus.BAD_REQUEST
        if words[0] != b"GET":
            return HTTPStatus.METHOD_NOT_ALLOWED
        if words[1].partition(b"?")[0] != STREAM.encode():
            return HTTPStatus.NOT_FOUND
        if len(self._viewers) < VIEWER_LIMIT:
            return None
        if not self._full:  # one message until a viewer leaves
            self._full = True
            LOG.warning("camera viewer %s is refused, and further ones: there are %d already", name, VIEWER_LIMIT)
        return HTTPStatus.SERVICE_UNAVAILABLE

    async def _stream(self, writer: asyncio.StreamWriter) -> None:
        """Send the stream's header, then frames until the viewer leaves or stalls."""
        writer.transport.set_write_buffer_limits(high=0)  # `drain` then waits until everything is sent
        kind = f"multipart/x-mixed-replace; boundary={BOUNDARY}"
        head, sent = _head(HTTPStatus.OK, kind), self._number
        while True:
            async with asyncio.timeout(STALLED_S):
                writer.write(head)
                await writer.drain()
            while self._number == sent:
                await self._published.wait()
            sent, frame = self._number, self._frame
            size = f"Content-Length: {len(frame)}"
            head = f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\n{size}\r\n\r\n".encode() + frame + b"\r\n"


def _head(status: HTTPStatus, kind: str) -> bytes:
    head = f"HTTP/1.0 {status.value} {status.phrase}\r\nContent-Type: {kind}\r\nCache-Control: no-store\r\n\r\n"
    return head.encode()


async def _refuse(writer: asyncio.StreamWriter, status: HTTPStatus) -> None:
    """Answer with a sentence."""
    text = f"{status.value} {status.phrase}. The camera is at {STREAM}, for {VIEWER_LIMIT} viewers at most.\n"
    writer.write(_head(status, "text/plain") + text.encode())
    writer.write_eof()
    async with asyncio.timeout(REQUEST_S):
        await writer.drain()
