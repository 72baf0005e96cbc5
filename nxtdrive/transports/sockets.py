"""Connected sockets: a byte stream for TCP, Bluetooth and nxt-server, and framed telegrams for the first two."""

from __future__ import annotations

import contextlib
import socket

from firmware_protocol.errors import LinkLost, LinkTimeout, system_words
from nxtdrive.transports.base import WallClock
from nxtdrive.transports.stream import SEND_TIMEOUT_S, StreamTransport

CHUNK = 4096
MIN_WAIT_S = 0.001
"""A timeout of 0 would mean not to wait at all, and raises another error."""
_CLOCK = WallClock()


class Connection:
    """A connected socket that raises the driver's own errors."""

    def __init__(self, address: str, connected: socket.socket, remedy: str = "Is the brick on and in range?") -> None:
        """Take over the socket; `remedy` is the advice when the other end is gone."""
        self._address = address
        self._socket = connected
        self._remedy = remedy

    def read(self, timeout_s: float) -> bytes:
        """Return at least one byte, or none after `timeout_s`; raise LinkLost at the end of the stream."""
        try:
            self._socket.settimeout(max(timeout_s, 0.0))
            data = self._socket.recv(CHUNK)
        except OSError as error:
            if _is_silence(error):
                return b""
            raise self._lost(system_words(error)) from error
        if not data:
            raise self._lost("the other end closed the connection")
        return data

    def write(self, data: bytes) -> None:
        """Write all of `data` within `SEND_TIMEOUT_S`; after a partial write, the next data would be read as its rest.

        Raises:
            LinkTimeout: None of it was sent.
            LinkLost: Only a part was sent, and the connection is closed; or it was lost before.
        """
        left, deadline = memoryview(data), _CLOCK.now() + SEND_TIMEOUT_S
        try:
            while left:
                self._socket.settimeout(max(deadline - _CLOCK.now(), MIN_WAIT_S))
                left = left[self._socket.send(left) :]
        except OSError as error:
            if not _is_silence(error):
                raise self._lost(system_words(error)) from error
            if len(left) < len(data):
                self.close()
                raise self._lost("it took only part of a telegram") from None
            raise LinkTimeout(f"{self._address} accepts no more telegrams.", remedy="Is the brick still on?") from None

    def close(self) -> None:
        """Close the connection; never raises."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _lost(self, reason: str) -> LinkLost:
        return LinkLost(f"the link to {self._address} is lost: {reason}.", remedy=self._remedy)


def _is_silence(error: OSError) -> bool:
    """Whether our own wait has ended; a TimeoutError of a connection that the system has dropped has a number."""
    return isinstance(error, BlockingIOError) or (isinstance(error, TimeoutError) and error.errno is None)


class SocketTransport(StreamTransport):
    """Telegrams through a socket that is already connected."""

    def __init__(self, address: str, connected: socket.socket) -> None:
        super().__init__(address)
        self._connection = Connection(address, connected)

    def _read(self, timeout_s: float) -> bytes:
        return self._connection.read(timeout_s)

    def _write(self, data: bytes) -> None:
        self._connection.write(data)

    def _close(self) -> None:
        self._connection.close()
