"""The simulated brick on TCP ports, in three dialects.

- `StreamClient`: telegrams preceded by their length, as over Bluetooth; used by the driver's ``tcp://``.
- `NxtServerClient`: nxt-python's ``nxt-server`` protocol, bare telegrams for the brick on the server's USB.
- `PacketClient`: a USB cable for `sim_backend.doors.usb_backend`, packets preceded by their length.
"""

from __future__ import annotations

import math
import socket
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from ipaddress import ip_address

from firmware_protocol.errors import ConfigError, system_words
from firmware_protocol.framing import LENGTH_LIMIT, USB_TELEGRAM_LIMIT, FrameReader, frame
from sim_backend.doors.door import ACCEPT_AGAIN_S, CHUNK, LOOPBACK, PARTIAL_LIMIT_S, SEND_BUFFER, Client, completed
from sim_backend.doors.splitter import CLOSE, GET_LINK_TYPE, TelegramSplitter

UNREAD_LIMIT = 1 << 16
"""Unread reply bytes, beyond the kernel's buffer, at which a program is disconnected."""

BACKLOG = 8
"""Programs that wait to be accepted, and that are accepted at a time."""

HANDOVER_S = 0.2
"""Wait of a program that finds the cable in use: the end of the previous program may not have been noticed yet."""

USB_LINK = b"usb"
"""Link type reported to nxt-python, which expects faster motor control on USB than over Bluetooth."""


class SocketClient(ABC):
    """One connection; see `Client`. Subclasses find the ends of telegrams."""

    bluetooth = False
    scheme = "tcp"

    def __init__(self, connection: socket.socket, name: str, now: Callable[[], float]) -> None:
        self.name = name
        self.at_end = self.closed = False
        self._socket = connection
        self._now = now
        self._received_s = now()
        self._unsent = bytearray()

    def receive(self) -> list[bytes]:
        """Return the telegrams that arrived since the last call."""
        self._flush()
        data = self._read()
        if data:
            self._received_s = self._now()
        return self._split(data, math.inf if self.at_end else self._now() - self._received_s)

    def send(self, data: bytes) -> None:
        """Write the data; a program that leaves too much unread is disconnected."""
        self._unsent += data
        self._flush()
        if len(self._unsent) > UNREAD_LIMIT:
            self.disconnect()

    def disconnect(self) -> None:
        """Close the connection."""
        self.closed = True
        self._socket.close()

    def fileno(self) -> int:
        """Return the file descriptor of the socket."""
        return self._socket.fileno()

    @abstractmethod
    def _split(self, data: bytes, silent_s: float) -> list[bytes]:
        """Return the telegrams that `data`, possibly empty, completes; `silent_s` is the time since the last byte.

        At the end of the connection it is infinite.
        """

    def _read(self) -> bytes:
        if self.closed or self.at_end:
            return b""
        try:
            data = self._socket.recv(CHUNK)
        except BlockingIOError:
            return b""
        except OSError:
            self.disconnect()
            return b""
        self.at_end = not data
        return data

    def _flush(self) -> None:
        if self._unsent and not self.closed:
            try:
                del self._unsent[: self._socket.send(self._unsent)]
            except BlockingIOError:
                return
            except OSError:
                self.disconnect()


class StreamClient(SocketClient):
    """Telegrams preceded by their length, for the brick's Bluetooth."""

    bluetooth = True

    def __init__(self, connection: socket.socket, name: str, now: Callable[[], float]) -> None:
        super().__init__(connection, name, now)
        self._frames = FrameReader(LENGTH_LIMIT)

    def _split(self, data: bytes, silent_s: float) -> list[bytes]:
        if silent_s > PARTIAL_LIMIT_S:
            self._frames.reset()
        return completed(self._frames, data)


class PacketClient(StreamClient):
    """Packets preceded by their length, for the brick's USB."""

    bluetooth = False
    scheme = "usb"

    def __init__(self, connection: socket.socket, name: str, now: Callable[[], float]) -> None:
        super().__init__(connection, name, now)
        self._frames = FrameReader(USB_TELEGRAM_LIMIT)

    def send(self, data: bytes) -> None:
        """Write a packet."""
        super().send(frame(data))


class NxtServerClient(SocketClient):
    """nxt-python's server protocol, for the brick's USB."""

    scheme = "nxt-server"

    def __init__(self, connection: socket.socket, name: str, now: Callable[[], float]) -> None:
        super().__init__(connection, name, now)
        self._splitter = TelegramSplitter()

    def _split(self, data: bytes, silent_s: float) -> list[bytes]:
        self._splitter.feed(data)
        telegrams = []
        while (telegram := self._splitter.next(silent_s)) is not None:
            if telegram[0] == GET_LINK_TYPE:
                self.send(USB_LINK)
            elif telegram[0] == CLOSE:
                self.at_end = True
                break
            else:
                telegrams.append(telegram)
        return telegrams


class SocketDoor:
    """A TCP port where programs connect.

    Attributes:
        address: Scheme, host and port.
        bluetooth: See `Door`.
        port: The actual port.
    """

    def __init__(
        self,
        dialect: type[SocketClient],
        port: int = 0,
        *,
        host: str = LOOPBACK,
        now: Callable[[], float],
    ) -> None:
        """Start to listen.

        Args:
            dialect: The protocol.
            port: TCP port; 0 selects a free one.
            host: Address of this computer; any other than the loopback interface lets other computers drive.
            now: Returns seconds of a monotonic clock.

        Raises:
            ConfigError: The port is taken or not allowed, or the host is not an address of this computer.
        """
        self.bluetooth = dialect.bluetooth
        self._dialect, self._now = dialect, now
        self._accepts_at_s = -math.inf
        self._listener = listen(host, port)
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self.address = f"{dialect.scheme}://{bracketed(host)}:{self.port}"

    def accept(self) -> list[Client]:
        """Return the programs that connected since the last call."""
        return list(self._connected())

    def fileno(self) -> int | None:
        """Return the file descriptor of the listening socket; None for a moment after it could not accept a program."""
        return self._listener.fileno() if self._now() >= self._accepts_at_s else None

    def close(self) -> None:
        """Free the port; existing connections stay."""
        self._listener.close()

    def _connected(self) -> Iterator[SocketClient]:
        for _ in range(BACKLOG):
            try:
                connection, peer = self._listener.accept()
            except BlockingIOError:  # no connection
                return
            except OSError:  # it is gone already, or too many files are open
                self._accepts_at_s = self._now() + ACCEPT_AGAIN_S
                return
            connection.setblocking(False)
            try:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            except OSError:  # it is gone already: macOS
                connection.close()
                continue
            yield self._client(connection, f"{bracketed(peer[0])}:{peer[1]}")

    def _client(self, connection: socket.socket, name: str) -> SocketClient:
        return self._dialect(connection, name, self._now)


class UsbDoor(SocketDoor):
    """The far end of a USB cable, used by one program at a time.

    That program is greeted with the brick's serial number; others are disconnected without a greeting.
    """

    def __init__(self, serial_number: str, *, now: Callable[[], float]) -> None:
        """Start to listen on a free port of the loopback interface; see `SocketDoor`."""
        super().__init__(PacketClient, 0, now=now)
        self._serial_number = serial_number
        self._owner: SocketClient | None = None
        self._queue: list[tuple[float, SocketClient]] = []

    def accept(self) -> list[Client]:
        """Return the program that gets the cable, if it was free."""
        now_s = self._now()
        self._queue += [(now_s, client) for client in self._connected()]
        admitted: list[Client] = []
        waiting: list[tuple[float, SocketClient]] = []
        for since_s, client in self._queue:
            if self._owner is None or self._owner.closed or self._owner.at_end:
                self._owner = client
                client.send(self._serial_number.encode("ascii"))
                admitted.append(client)
            elif now_s - since_s > HANDOVER_S or len(waiting) >= BACKLOG:
                client.disconnect()
            else:
                waiting.append((since_s, client))
        self._queue = waiting
        return admitted

    def close(self) -> None:
        """Free the port and disconnect waiting programs."""
        super().close()
        for _, client in self._queue:
            client.disconnect()
        self._queue = []


def listen(host: str, port: int) -> socket.socket:
    """Listen on a TCP port.

    Raises:
        ConfigError: The port is taken or not allowed, or the host is not an address of this computer.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=BACKLOG)
    except (OSError, OverflowError) as error:
        reason = system_words(error) if isinstance(error, OSError) else str(error)
        raise ConfigError(
            f"cannot listen on {host}, port {port}: {reason}.",
            remedy="Take another port; 0 finds a free one.",
        ) from error


def is_loopback(host: str) -> bool:
    """Return whether only this computer can reach the address."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def bracketed(host: str) -> str:
    """Return a host as an address writes it: one of IPv6 in brackets."""
    return f"[{host}]" if ":" in host else host
