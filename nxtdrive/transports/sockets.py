"""A stream of bytes through a connected socket; shared by TCP and Bluetooth."""

from __future__ import annotations

import contextlib
import socket

from firmware_protocol.errors import LinkLost, LinkTimeout
from nxtdrive.transports.stream import SEND_TIMEOUT_S, StreamTransport

CHUNK = 4096


class SocketTransport(StreamTransport):
    """Telegrams through a socket that is already connected."""

    def __init__(self, address: str, connection: socket.socket) -> None:
        super().__init__(address)
        self._socket = connection

    def _read(self, timeout_s: float) -> bytes:
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

    def _write(self, data: bytes) -> None:
        self._socket.settimeout(SEND_TIMEOUT_S)
        try:
            self._socket.sendall(data)
        except TimeoutError:
            raise LinkTimeout(f"{self.address} takes no more telegrams.", remedy="Is the brick still on?") from None
        except OSError as error:
            raise self._lost(error) from error

    def _close(self) -> None:
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _lost(self, reason: object) -> LinkLost:
        return LinkLost(f"the link to {self.address} is gone: {reason}.", remedy="Is the brick on and in range?")
