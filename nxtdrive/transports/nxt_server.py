"""A brick behind nxt-python's ``nxt-server``, or behind our own substitute for it.

That protocol sends telegrams without delimiters. The server treats whatever arrives at once as one telegram, so two in
a row would become a single wrong one. Therefore each telegram requests a reply and is sent only after the reply to the
one before has arrived; replies that the program did not request are discarded. A reply that arrives in pieces, as TCP
allows, ends where its declaration says; of one with an open end that has no count (`Read`) each piece is taken for all.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable
from typing import Self

from firmware_protocol.catalog import command_of
from firmware_protocol.errors import LinkError, LinkTimeout, RemoteProtocolError
from firmware_protocol.framing import BLUETOOTH_TELEGRAM_LIMIT, USB_TELEGRAM_LIMIT
from firmware_protocol.layout import Layout
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
        self._piece = b""
        self._arrived: deque[bytes] = deque()
        self._open = True

    @classmethod
    def open(cls, address: Address, timeout_s: float = 1.0) -> Self:
        """Connect, and query the type of the brick's link.

        Raises:
            AddressError: The port is not a number.
            BrickNotFound: No server listens at that address.
            RemoteProtocolError: The server is not an nxt-server.
            LinkTimeout: It does not answer; perhaps it serves another program.
            LinkLost: It closes the connection.
        """
        connection = Connection(str(address), connect(address, timeout_s), "Is the server still running?")
        try:
            connection.write(GET_LINK_TYPE)
            kind, clock = b"", WallClock()
            deadline = clock.now() + timeout_s
            while (data := connection.read(deadline - clock.now())) and _begins_a_kind(kind := kind + data):
                pass
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
        self._await(lambda: not self._due, SEND_TIMEOUT_S)
        self._piece = b""  # a rest that arrives even later is not part of the next reply
        self._connection.write(bytes((telegram[0] & ~NO_REPLY,)) + telegram[1:])
        self._due = True
        self._unwanted = bytes((Kind.REPLY, *telegram[1:2])) if telegram[0] & NO_REPLY else b""

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next reply that the program requested, or None."""
        self._check_open()
        self._await(lambda: bool(self._arrived), timeout_s)
        if self._arrived:
            return self._arrived.popleft()
        # the next telegram does not wait for an overdue reply of which no part has arrived
        self._due = bool(self._piece)
        return None

    def waiting(self) -> bool:
        """Return whether a reply has arrived."""
        self._check_open()
        if not self._arrived:
            self._take(self._connection.read(0.0))
        return bool(self._arrived)

    def close(self) -> None:
        """Disconnect; the server then waits for the next program."""
        if self._open:
            self._open = False
            with contextlib.suppress(LinkError):
                self._connection.write(CLOSE)
            self._connection.close()

    def _await(self, done: Callable[[], bool], timeout_s: float) -> None:
        """Take what arrives until `done()`, at most for `timeout_s`."""
        deadline = self.now() + timeout_s
        while not done():
            left = deadline - self.now()
            self._take(self._connection.read(left))
            if left <= 0:
                break

    def _take(self, data: bytes) -> None:
        telegrams, self._piece = split_replies(self._piece + data)
        for telegram in telegrams:
            self._due = False
            if self._unwanted and telegram.startswith(self._unwanted):
                self._unwanted = b""
            else:
                self._arrived.append(telegram)

    def _check_open(self) -> None:
        if not self._open:
            raise closed(self.address)


def split_replies(data: bytes) -> tuple[list[bytes], bytes]:
    """Split replies that arrived together, where one has its declared length and another begins.

    Returns:
        The whole replies, and the beginning of another one; a refusal may be shorter than declared.
    """
    replies: list[bytes] = []
    while data:
        command = command_of(Kind.REPLY, data[1]) if len(data) > 1 else None
        layout = command.reply_type.layout if command else None
        end = _declared_length(layout, data) if layout else REPLY_HEADER
        if data[0] == Kind.REPLY and len(data) < (REPLY_HEADER if any(data[2:REPLY_HEADER]) else end):
            return replies, data
        if layout is None or layout.tail or not (len(data) > end and data[end] == Kind.REPLY):
            end = len(data)
        replies.append(data[:end])
        data = data[end:]
    return replies, b""


def _declared_length(layout: Layout, data: bytes) -> int:
    """Return the length of a reply, or the shortest that it may have if its end is open."""
    end = REPLY_HEADER + layout.size
    if not layout.count:
        return end
    first, last = (REPLY_HEADER + each for each in layout.spans[layout.count])
    return end + int.from_bytes(data[first:last], "little")


def _begins_a_kind(data: bytes) -> bool:
    """Return whether `data` is the beginning of the name of a kind of link, and not all of it."""
    return data not in LINK_LIMITS and any(kind.startswith(data) for kind in LINK_LIMITS)
