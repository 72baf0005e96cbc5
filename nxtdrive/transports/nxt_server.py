"""A brick behind nxt-python's ``nxt-server``, or behind our own substitute for it.

That protocol sends telegrams without delimiters. The server treats whatever arrives at once as one telegram, so two in
a row would become a single wrong one. Therefore each telegram requests a reply and is sent only after the reply to the
one before has arrived; replies that the program did not request are discarded.
"""

from __future__ import annotations

import contextlib
from collections import deque
from typing import Self

from firmware_protocol.catalog import command_of
from firmware_protocol.errors import LinkError, LinkTimeout, RemoteProtocolError
from firmware_protocol.framing import BLUETOOTH_TELEGRAM_LIMIT, USB_TELEGRAM_LIMIT
from firmware_protocol.telegram import NO_REPLY, REPLY_HEADER, Kind
from nxtdrive.transports.address import Address
from nxtdrive.transports.base import WallClock, closed
from nxtdrive.transports.sockets import Connection
from nxtdrive.transports.stream import SEND_TIMEOUT_S
from nxtdrive.transports.tcp import connect

GET_LINK_TYPE, CLOSE = b"\x98", b"\x99"
"""Telegrams for the server itself: query the type of the brick's link, and disconnect."""
LINK_LIMITS = {b"usb": USB_TELEGRAM_LIMIT, b"bluetooth": BLUETOOTH_TELEGRAM_LIMIT}


class NxtServerTransport(WallClock):
    """``nxt-server://host:port``."""

    def __init__(self, address: str, connection: Connection, max_telegram: int) -> None:
        self.address = address
        self.max_telegram = max_telegram
        self._connection = connection
        self._due = False
        self._unwanted = b""
        self._arrived: deque[bytes] = deque()
        self._open = True

    @classmethod
    def open(cls, address: Address, timeout_s: float = 1.0) -> Self:
        """Connect, and query the type of the brick's link.

        Raises:
            AddressError: The port is not a number.
            BrickNotFound: No server listens there.
            RemoteProtocolError: The server is not an nxt-server.
            LinkTimeout: It does not answer; perhaps it serves another program.
            LinkLost: It closes the connection.
        """
        connection = Connection(str(address), connect(address, timeout_s), "Is the server still running?")
        try:
            connection.write(GET_LINK_TYPE)
            kind = connection.read(timeout_s)
            if not kind:
                raise LinkTimeout(
                    f"the server at {address.target} does not answer.", remedy="It serves one program at a time."
                )
            if kind not in LINK_LIMITS:
                remedy = "If the server sends lengths before telegrams, use tcp://host:port."
                raise RemoteProtocolError("this is not an nxt-server", kind, remedy=remedy)
        except BaseException:
            connection.close()
            raise
        return cls(str(address), connection, LINK_LIMITS[kind])

    def send(self, telegram: bytes) -> None:
        """Send one telegram, after the reply to the one before or its timeout."""
        self._check_open()
        if self._due:
            self._await(SEND_TIMEOUT_S)
        self._connection.write(bytes((telegram[0] & ~NO_REPLY,)) + telegram[1:])
        self._due = True
        self._unwanted = bytes((Kind.REPLY, telegram[1])) if telegram[0] & NO_REPLY else b""

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next reply that the program requested, or None."""
        self._check_open()
        if not self._arrived:
            self._await(timeout_s)
        if not self._arrived:
            self._due = False  # the reply is overdue: do not wait for it again before the next telegram
            return None
        return self._arrived.popleft()

    def waiting(self) -> bool:
        """Return whether a reply has arrived."""
        self._check_open()
        if not self._due and not self._arrived:
            self._take(self._connection.read(0.0))
        return bool(self._arrived)

    def close(self) -> None:
        """Disconnect; the server then waits for the next program."""
        if self._open:
            self._open = False
            with contextlib.suppress(LinkError):
                self._connection.write(CLOSE)
            self._connection.close()

    def _await(self, timeout_s: float) -> None:
        """Wait for a reply, whether the program requested it or not."""
        deadline = self.now() + timeout_s
        waiting = True
        while waiting:
            data = self._connection.read(deadline - self.now())
            waiting = self.now() < deadline and not data
            self._take(data)

    def _take(self, data: bytes) -> None:
        for telegram in split_replies(data):
            self._due = False
            if self._unwanted and telegram.startswith(self._unwanted):
                self._unwanted = b""
            else:
                self._arrived.append(telegram)

    def _check_open(self) -> None:
        if not self._open:
            raise closed(self.address)


def split_replies(data: bytes) -> list[bytes]:
    """Split replies that arrived together, where one has its declared length and another begins."""
    replies = []
    while data:
        command = command_of(Kind.REPLY, data[1]) if len(data) > 1 else None
        layout = command.reply_type.layout if command else None
        end = REPLY_HEADER + layout.size if layout and not layout.tail else len(data)
        if not (len(data) > end and data[end] == Kind.REPLY):
            end = len(data)
        replies.append(data[:end])
        data = data[end:]
    return replies
