"""Connected sockets: bytes for TCP, Bluetooth and nxt-python's server, telegrams with lengths for the first two."""

from __future__ import annotations

import contextlib
import socket

from firmware_protocol.errors import LinkLost, LinkTimeout
from nxtdrive.transports.stream import SEND_TIMEOUT_S, StreamTransport

CHUNK = 4096


class Connection:
    """A connected socket whose failures are errors of ours."""

    def __init__(self, address: str, connected: socket.socket, remedy: str = "Is the brick on and in range?") -> None:
        """Take over the socket; `remedy` is what to do when the other end is gone."""
        self._address = address
        self._socket = connected
        self._remedy = remedy

    def read(self, timeout_s: float) -> bytes:
        """What has arrived, at least one byte, or nothing after `timeout_s`; LinkLost at the end of the stream."""
        # settimeout(0) would mean non-blocking; a millisecond serves "whatever is there" as well.
        self._socket.settimeout(max(timeout_s, 0.001))
        try:
            data = self._socket.recv(CHUNK)
        except TimeoutError:
            return b""
        except OSError as error:
            raise self._lost(error) from error
        if not data:
            raise self._lost("the other end closed the connection")
        return data

    def write(self, data: bytes) -> None:
        """All of `data`, within `SEND_TIMEOUT_S`."""
        self._socket.settimeout(SEND_TIMEOUT_S)
        try:
            self._socket.sendall(data)
        except TimeoutError:
            raise LinkTimeout(f"{self._address} takes no more telegrams.", remedy="Is the brick still on?") from None
        except OSError as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Hang up; never raises."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _lost(self, reason: object) -> LinkLost:
        return LinkLost(f"the link to {self._address} is gone: {reason}.", remedy=self._remedy)


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
