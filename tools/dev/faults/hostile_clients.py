"""Misbehaving clients for the campaign `servers`. None of them ever waits."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
from abc import ABC, abstractmethod
from random import Random

BLOCK = 1 << 16
"""Bytes that a greedy client tries to send in a step."""
SMALL_BUFFER = 4096
"""Receive buffer of a client that does not read; it fills up at once."""
MANY = 40
"""Clients of the kind "many"; above the limit of each server."""
CROWD = 6
"""Clients of every other kind."""


class Connection(ABC):
    """One connection to a server, or one opened serial port."""

    @abstractmethod
    def send(self, data: bytes) -> None:
        """Send what can be sent at once."""

    @abstractmethod
    def finish_sending(self) -> None:
        """Close the sending side, or the nearest equivalent."""

    @abstractmethod
    def reset(self) -> None:
        """Disconnect abruptly."""


class Socket(Connection):
    """A TCP connection that never reads."""

    def __init__(self, address: tuple[str, int]) -> None:
        self._socket = socket.socket()
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SMALL_BUFFER)
        self._socket.setblocking(False)
        with contextlib.suppress(OSError):  # in progress
            self._socket.connect(address)

    def send(self, data: bytes) -> None:
        """Send what fits."""
        with contextlib.suppress(OSError):  # full, not yet connected, or disconnected by the server
            self._socket.send(data)

    def finish_sending(self) -> None:
        """Close the sending side."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)

    def reset(self) -> None:
        """Close with a reset."""
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._socket.close()


class Port(Connection):
    """A serial port that is opened and never read."""

    def __init__(self, path: str) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def send(self, data: bytes) -> None:
        """Send what fits."""
        with contextlib.suppress(OSError):
            os.write(self._file, data)

    def finish_sending(self) -> None:
        """Close the port, since it has no separate sending side."""
        self.reset()

    def reset(self) -> None:
        """Close."""
        file, self._file = self._file, -1
        if file >= 0:
            os.close(file)


class HostileClients:
    """Some clients of one kind at one address.

    Args:
        kind: One of `KINDS`.
        address: Host and port, or the path of a serial port.
        request: A valid request of the server's protocol.
        rng: Chooses the garbage.
    """

    def __init__(self, kind: str, address: tuple[str, int] | str, request: bytes, rng: Random) -> None:
        self.kind = kind
        self._address, self._request, self._rng = address, request, rng
        self._steps = 0
        self._connections = [self._connect() for _ in range(MANY if kind == "many" else CROWD)]

    def step(self) -> None:
        """Do one step."""
        for number, connection in enumerate(self._connections):
            match self.kind:
                case "slow":
                    at = self._steps % len(self._request)
                    connection.send(self._request[at : at + 1])
                case "greedy":
                    connection.send(self._request * (BLOCK // len(self._request)))
                case "garbage":
                    connection.send(self._rng.randbytes(self._rng.randrange(1, 2000)))
                case "many" if self._steps == 0:
                    connection.send(self._request)
                case "half-closed" if self._steps == 0:
                    connection.send(self._request[:-1])
                    connection.finish_sending()
                case "resetting":
                    connection.send(self._request[: self._rng.randrange(len(self._request) + 1)])
                    connection.reset()
                    self._connections[number] = self._connect()
        self._steps += 1

    def leave(self) -> None:
        """Disconnect abruptly."""
        for connection in self._connections:
            connection.reset()

    def _connect(self) -> Connection:
        return Port(self._address) if isinstance(self._address, str) else Socket(self._address)


KINDS = ("silent", "slow", "greedy", "garbage", "many", "half-closed", "resetting")
"""What the clients do; the step of a silent one does nothing."""
