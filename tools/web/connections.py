"""Connections of the web server: a limited number, those of clients without the PIN included, and no dead ones."""

from __future__ import annotations

import asyncio
import logging
from itertools import count
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

MAX_CONNECTIONS = 100
"""Of HTTP; pages' WebSockets have a limit of their own. A process may open 256 files on macOS, 1024 on Linux."""
BACKLOG = 50
"""Connections that are accepted at once, before the oldest can be closed."""
PING_S, PONG_S = 5.0, 15.0
"""Period of the pings of a WebSocket, which browsers answer by themselves, and how long an answer may take: it waits
behind the messages that the client has not read."""

_numbers = count()


class BoundedHTTP(H11Protocol):
    """A connection of HTTP; when there are too many, the oldest is closed, one without a request under way first."""

    def __init__(self, *args: Any, **options: Any) -> None:  # noqa: ANN401 - uvicorn's
        super().__init__(*args, **options)
        self._number = next(_numbers)

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override] # as uvicorn's own
        """Take part, in the place of an older connection if there are too many."""
        super().connection_made(transport)
        others = [each for each in self.connections if isinstance(each, BoundedHTTP) and each is not self]
        if len(others) >= MAX_CONNECTIONS:
            oldest = min(others, key=lambda each: (each._answering, each._number))
            self.connections.discard(oldest)
            oldest.transport.abort()

    def send_400_response(self, msg: str) -> None:
        """Refuse what is not HTTP, and close. A request whose body is not gets this answer or its own, not both."""
        if self.cycle is not None and self.cycle.response_started:
            self.transport.close()
        else:
            super().send_400_response(msg)
        if self.cycle is not None:
            self.cycle.disconnected = True

    @property
    def _answering(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete


class LiveWebSocket(WebSocketsSansIOProtocol):
    """A connection of a WebSocket; one whose client has vanished or does not read is closed after `PING_S + PONG_S`."""

    def keepalive_timeout(self) -> None:
        """Close at once: uvicorn itself would wait until the client has read everything."""
        self.transport.abort()

    def handle_parser_exception(self) -> None:
        """Close after a violation of the protocol. The client counts as gone, even if it reads nothing more."""
        super().handle_parser_exception()
        self.disconnected = True
        self.loop.call_later(PONG_S, self.transport.abort)


def without_traceback(record: logging.LogRecord) -> bool:
    """Leave the traceback out of a log message about text of a client that is not UTF-8: it is not a defect."""
    if record.exc_info and isinstance(record.exc_info[1], UnicodeDecodeError):
        record.exc_info = None
    return True


def is_no_late_write(record: logging.LogRecord) -> bool:
    """Leave out asyncio's message about what is written to a client that has vanished, until its loss is noticed."""
    return record.msg != "socket.send() raised exception."
