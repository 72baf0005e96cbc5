"""A USB cable to a simulated brick in another process, which serves a `sim_backend.doors.sockets.UsbDoor`.

This file needs only the standard library, so that any interpreter can load it.
"""

from __future__ import annotations

import contextlib
import errno
import os
import selectors
import socket
import threading

CONNECT_S = 5.0
LENGTH_SIZE = 2


class SocketCable:
    """A cable to a simulated brick in another process; one thread may read while another writes."""

    def __init__(self, host: str, port: int) -> None:
        """Connect.

        Raises:
            BlockingIOError: Another program has the brick.
            OSError: The brick is gone.
        """
        self._socket = socket.create_connection((host, port), timeout=CONNECT_S)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._writing, self._reading = threading.Lock(), threading.Lock()
        self._buffer = bytearray()
        if not self._greeted():
            self._socket.close()
            raise BlockingIOError(errno.EBUSY, os.strerror(errno.EBUSY))

    def _greeted(self) -> bool:
        try:
            return self.read(CONNECT_S) is not None
        except ConnectionError:
            return False

    def write(self, packet: bytes, timeout_s: float | None) -> None:
        """Send a packet, completely or not at all."""
        with self._writing:
            if not _ready(self._socket, selectors.EVENT_WRITE, timeout_s):
                raise TimeoutError
            self._socket.sendall(len(packet).to_bytes(LENGTH_SIZE, "little") + packet)

    def read(self, timeout_s: float | None) -> bytes | None:
        """Return the next packet, or None on timeout; a partial packet is kept for the next call."""
        with self._reading:
            while (packet := self._whole()) is None:
                if not _ready(self._socket, selectors.EVENT_READ, timeout_s):
                    return None
                data = self._socket.recv(4096)
                if not data:
                    raise ConnectionResetError(errno.ECONNRESET, os.strerror(errno.ECONNRESET))
                self._buffer += data
            return packet

    def close(self) -> None:
        """Disconnect; a thread that reads at the same time gets an error."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _whole(self) -> bytes | None:
        end = LENGTH_SIZE + int.from_bytes(self._buffer[:LENGTH_SIZE], "little")
        if len(self._buffer) < max(end, LENGTH_SIZE + 1):
            return None
        packet = bytes(self._buffer[LENGTH_SIZE:end])
        del self._buffer[:end]
        return packet


def _ready(connection: socket.socket, event: int, timeout_s: float | None) -> bool:
    """Wait until the socket is readable or writable; returns whether it is."""
    with selectors.DefaultSelector() as selector:
        selector.register(connection, event)
        return bool(selector.select(timeout_s))
