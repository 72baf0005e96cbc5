"""Messages from the robot's thread to the clients: always the latest, without the robot ever waiting for a client."""

from __future__ import annotations

import asyncio
import json
import struct
import threading
import time
from collections import deque
from collections.abc import Mapping
from itertools import count
from typing import Any

FRAME, GRID, BELIEF = 1, 2, 3
"""First byte of a binary message: the kind of its image."""
_HEADER = struct.Struct("<BxxxId")

BACKLOG = 20_000
"""Events of a run that are kept for clients that come later: more than an hour of a mission."""
BEHIND = 2_000
"""A client that is this many events behind is too slow and is closed; its page connects again and catches up."""

FLUSH_S = 0.02
"""Interval of checks whether all events have been sent."""


def image_message(kind: int, number: int, time_s: float, encoded: bytes) -> bytes:
    """Return a binary message: kind, number and time (seconds, robot's clock), then the image as JPEG or PNG."""
    return _HEADER.pack(kind, number, time_s) + encoded


class Client:
    """The pending messages of one client.

    Args:
        loop: The event loop that sends it.
        name: Shown to the others.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, name: str) -> None:
        self.name = name
        self.too_slow = False
        self._loop = loop
        self._news = asyncio.Event()
        self._lock = threading.Lock()
        self._latest: dict[object, str | bytes] = {}
        self._events: deque[str] = deque()
        self._sending = 0

    def put(self, key: object, message: str | bytes) -> None:
        """Replace the message waiting under `key`; any thread."""
        with self._lock:
            self._latest[key] = message
        self._wake()

    def append(self, message: str) -> None:
        """Add an event, none of which may be left out until the client is too slow and gets no more; any thread."""
        with self._lock:
            if not self.too_slow:
                self._events.append(message)
            self.too_slow = self.too_slow or len(self._events) > BACKLOG + BEHIND
        self._wake()

    @property
    def waiting(self) -> int:
        """Number of events that have not been sent."""
        return len(self._events) + self._sending

    async def next(self) -> list[str | bytes]:
        """Wait for messages to send: events first, in order, then the latest of everything else.

        Messages returned before count as sent.
        """
        self._sending = 0
        await self._news.wait()
        self._news.clear()
        with self._lock:
            messages: list[str | bytes] = [*self._events, *self._latest.values()]
            self._sending = len(self._events)
            self._events.clear()
            self._latest.clear()
        return messages

    def _wake(self) -> None:
        try:
            self._loop.call_soon_threadsafe(self._news.set)
        except RuntimeError:  # the loop is closed: the server ends
            self.too_slow = True


class Hub:
    """Distributes messages to clients; all methods may be called from any thread.

    Attributes:
        small_pictures: Whether the camera's picture is wanted, slowly, by a page or a program that is not a client.
    """

    def __init__(self) -> None:
        self.small_pictures = False
        self._lock = threading.Lock()
        self._clients: set[Client] = set()
        self._latest: dict[object, str | bytes] = {}
        self._events: deque[str] = deque()
        self._numbers = count(1)

    def new_name(self) -> str:
        """Return a name for a client, which no other of this hub has had."""
        return f"page {next(self._numbers)}"

    @property
    def watched(self) -> bool:
        """Whether there is a client; without one no images need to be encoded."""
        return bool(self._clients)

    @property
    def clients(self) -> list[Client]:
        """The clients that are connected."""
        with self._lock:
            return list(self._clients)

    def join(self, client: Client) -> None:
        """Add a client and give it everything that it missed."""
        with self._lock:
            self._clients.add(client)
            for event in self._events:
                client.append(event)
            for key, message in self._latest.items():
                client.put(key, message)

    def leave(self, client: Client) -> None:
        """Remove a client."""
        with self._lock:
            self._clients.discard(client)

    def show(self, kind: str, values: Mapping[str, Any]) -> None:
        """Send a value that replaces the one before."""
        self._put(kind, as_message(kind, values))

    def show_image(self, kind: int, number: int, time_s: float, encoded: bytes) -> None:
        """Send an image that replaces the one before."""
        self._put(kind, image_message(kind, number, time_s, encoded))

    def publish(self, kind: str, values: Mapping[str, Any]) -> None:
        """Send an event to every client, including those that connect later."""
        message = as_message(kind, values)
        with self._lock:
            if len(self._events) >= BACKLOG:
                del self._events[1]  # the first one says which run it is
            self._events.append(message)
            for client in self._clients:
                client.append(message)

    def flush(self, timeout_s: float) -> None:
        """Wait until all clients have been sent their events, for at most `timeout_s`."""
        until_s = time.monotonic() + timeout_s
        while time.monotonic() < until_s and any(client.waiting for client in self.clients):
            time.sleep(FLUSH_S)

    def begin_run(self) -> None:
        """Forget the events of the last run, and the state of the robot before this one."""
        with self._lock:
            self._events.clear()
            for key in (GRID, BELIEF, "state"):
                self._latest.pop(key, None)

    def _put(self, key: object, message: str | bytes) -> None:
        with self._lock:
            self._latest[key] = message
            for client in self._clients:
                client.put(key, message)


def as_message(kind: str, values: Mapping[str, Any]) -> str:
    """Return a message to a client."""
    return json.dumps({"type": kind, **values}, ensure_ascii=False, allow_nan=False)
