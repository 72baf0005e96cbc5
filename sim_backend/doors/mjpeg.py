"""The simulated camera as an MJPEG stream over HTTP, like that of a network camera; browsers and OpenCV read it.

The simulation publishes frames and never waits. Each viewer has its own thread, which always sends the latest frame and
skips those that arrived while the connection was busy.
"""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Generator
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from socketserver import TCPServer, ThreadingMixIn
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import ConfigError
from sim_backend.doors.door import LOOPBACK, SEND_BUFFER

STREAM = "/camera.mjpg"
BOUNDARY = "frame"
JPEG_QUALITY = 80
"""Typical of webcams; the detectors were measured at this quality (docs/vision.md)."""

STALLED_S = 5.0
"""A viewer that accepts no byte for this time is disconnected."""


class MjpegDoor:
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
            ConfigError: The port is taken or not allowed.
        """
        self._feed = _Feed()
        try:
            self._server = _Server((LOOPBACK, port), self._feed)
        except (OSError, OverflowError) as error:
            raise ConfigError(
                f"the camera stream cannot use port {port}: {error}.", remedy="Take another one; 0 finds a free one."
            ) from error
        self.url = f"http://{LOOPBACK}:{self._server.server_address[1]}{STREAM}"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), name="camera stream")
        self._thread.start()

    @property
    def watched(self) -> bool:
        """Whether there is a viewer; without one no frame needs to be rendered."""
        return self._feed.watchers > 0

    def show(self, image: NDArray[np.uint8]) -> None:
        """Publish the BGR `image` as the latest frame; does not wait for slow viewers."""
        _, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        self._feed.put(jpeg.tobytes())

    def close(self) -> None:
        """Disconnect all viewers and free the port; returns when all threads have ended."""
        self._server.shutdown()
        self._thread.join()
        self._feed.end()
        self._server.server_close()


class _Feed:
    """The latest frame, between one producer and many viewers."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._picture = b""
        self._number = 0
        self._ended = False
        self._lines: list[socket.socket] = []

    @property
    def watchers(self) -> int:
        return len(self._lines)

    def put(self, picture: bytes) -> None:
        with self._changed:
            self._picture = picture
            self._number += 1
            self._changed.notify_all()

    def end(self) -> None:
        """Wake and disconnect all viewers."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()
            for line in self._lines:
                with contextlib.suppress(OSError):
                    line.shutdown(socket.SHUT_RDWR)

    def watch(self, line: socket.socket) -> Generator[bytes]:
        """Yield frames published from now on, each time the latest one."""
        with self._changed:
            self._lines.append(line)
            seen = self._number
        try:
            while (picture := self._after(seen)) is not None:
                seen, jpeg = picture
                yield jpeg
        finally:
            with self._changed:
                self._lines.remove(line)

    def _after(self, seen: int) -> tuple[int, bytes] | None:
        with self._changed:
            self._changed.wait_for(lambda: self._number > seen or self._ended)
            return None if self._ended else (self._number, self._picture)


class _Server(ThreadingMixIn, TCPServer):
    """A thread per viewer; `server_close` waits for all of them."""

    allow_reuse_address = True

    def __init__(self, address: tuple[str, int], feed: _Feed) -> None:
        self.feed = feed
        super().__init__(address, _Watcher)


class _Watcher(BaseHTTPRequestHandler):
    """One connection: the header of the stream, then frames until either side closes it."""

    timeout = STALLED_S

    def do_GET(self) -> None:
        """Answer a GET."""
        if self.path.partition("?")[0] != STREAM:
            self.send_error(HTTPStatus.NOT_FOUND, explain=f"The camera is at {STREAM}.")
            return
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        # a viewer leaves by closing the connection, possibly during a write
        with contextlib.suppress(OSError), contextlib.closing(self._pictures()) as pictures:
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={BOUNDARY}")
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            for jpeg in pictures:
                head = f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
                self.wfile.write(head.encode() + jpeg + b"\r\n")

    def log_message(self, *_: object) -> None:
        """Log nothing: standard output belongs to the program."""

    def _pictures(self) -> Generator[bytes]:
        return cast("_Server", self.server).feed.watch(self.connection)
