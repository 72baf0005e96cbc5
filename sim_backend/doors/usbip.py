"""The simulated brick as a USB device of any Linux computer, by USB/IP; ``usbip attach`` plugs it in."""

from __future__ import annotations

import socket
from collections.abc import Callable

from sim_backend.doors import nxt_descriptors as nxt
from sim_backend.doors.door import LOOPBACK, Client
from sim_backend.doors.sockets import BACKLOG, SocketClient, SocketDoor
from sim_backend.doors.usb_device import Speed, Stall, UsbDevice
from sim_backend.doors.usbip_session import BUS_ID, PORT, UsbIpSession

REQUEST_S = 5.0
"""Deadline of the request to list or import the brick."""

REPLY_LIMIT = 1024
"""Unread replies at which the computer is disconnected."""


class NxtDevice(UsbDevice):
    """The brick on USB.

    Attributes:
        inbox: Telegrams from the host.
        mute: Whether replies are held back: a brick that hangs.
    """

    def __init__(self, serial_number: str) -> None:
        super().__init__(
            nxt.DEVICE,
            nxt.WHOLE_CONFIGURATION,
            [serial_number],
            speed=Speed.FULL,
            packet_size=nxt.PACKET_SIZE,
            endpoint_in=nxt.ENDPOINT_IN,
        )
        self.inbox: list[bytes] = []
        self.mute = False

    def reset(self) -> None:
        """Forget the previous host."""
        super().reset()
        self.inbox.clear()

    def take(self, endpoint: int, data: bytes) -> None:
        """Take telegrams; each packet of at most 64 bytes is one."""
        if endpoint != nxt.ENDPOINT_OUT:
            raise Stall
        self.inbox += [data[at : at + nxt.PACKET_SIZE] for at in range(0, len(data), nxt.PACKET_SIZE)]


class UsbIpClient(SocketClient):
    """A computer that has the brick on its USB, or asks for it."""

    scheme = "usbip"

    def __init__(
        self, connection: socket.socket, name: str, now: Callable[[], float], device: NxtDevice, session: UsbIpSession
    ) -> None:
        super().__init__(connection, name, now)
        self.since_s = now()
        self._device, self._session = device, session

    @property
    def imported(self) -> bool:
        """Whether this computer has the brick."""
        return self._session.imported

    def ask(self) -> None:
        """Handle the request to list or import the brick."""
        self._session.feed(self._read())
        self._forward()

    def send(self, data: bytes) -> None:
        """Give a reply to the host's next read."""
        replies = self._device.outbox[nxt.ENDPOINT_IN]
        if not self._device.mute:
            replies.append(data)
        if len(replies) > REPLY_LIMIT:
            self.disconnect()
        self.pump()

    def pump(self) -> None:
        """Answer the host's reads, after a fault for example."""
        self._session.pump()
        self._forward()

    def _split(self, data: bytes, silent_s: float) -> list[bytes]:  # noqa: ARG002 - messages may take any time
        self._session.feed(data)
        self._forward()
        telegrams = list(self._device.inbox)
        self._device.inbox.clear()
        return telegrams

    def _forward(self) -> None:
        super().send(bytes(self._session.outgoing))
        self._session.outgoing.clear()
        self.at_end |= self._session.finished


class UsbIpDoor(SocketDoor):
    """A USB/IP server with one device, the brick; one computer at a time has it.

    Attributes:
        device: The brick on USB, for faults: halted endpoints, a mute brick.
        command: How to plug it into this computer.
    """

    def __init__(self, serial_number: str, port: int = PORT, *, host: str = LOOPBACK, now: Callable[[], float]) -> None:
        """Start to listen; see `SocketDoor`. `serial_number` is the brick's address, 12 hex digits."""
        super().__init__(UsbIpClient, port, host=host, now=now)
        self.device = NxtDevice(serial_number)
        self.command = attach_command(host, self.port)
        self._owner: UsbIpClient | None = None
        self._asking: list[UsbIpClient] = []

    def accept(self) -> list[Client]:
        """Return the computer that has just plugged the brick in."""
        self._asking += [client for client in self._connected() if isinstance(client, UsbIpClient)]
        asking, self._asking = self._asking, []
        for client in asking:
            client.ask()
            if client.imported:
                self._owner = client
            elif client.at_end or self._now() - client.since_s > REQUEST_S or len(self._asking) >= BACKLOG:
                client.disconnect()
            elif not client.closed:
                self._asking.append(client)
        return [client for client in asking if client.imported]

    def unplug(self) -> None:
        """Pull the cable."""
        if self._owner is not None:
            self._owner.disconnect()

    def halt(self, endpoint: int) -> None:
        """Halt an endpoint: transfers fail until the host clears it."""
        self.device.halted.add(endpoint)
        if self._owner is not None:
            self._owner.pump()

    def close(self) -> None:
        """Free the port and disconnect computers that only asked."""
        super().close()
        for client in self._asking:
            client.disconnect()
        self._asking = []

    def _in_use(self) -> bool:
        return self._owner is not None and not (self._owner.closed or self._owner.at_end)

    def _client(self, connection: socket.socket, name: str) -> UsbIpClient:
        return UsbIpClient(connection, name, self._now, self.device, UsbIpSession(self.device, self._in_use))


def attach_command(host: str, port: int) -> str:
    """Return the command that attaches the device at a USB/IP port of this computer."""
    here = LOOPBACK if host in ("", "0.0.0.0", "::") else host  # noqa: S104 - compared, not listened on
    return f"usbip --tcp-port {port} attach -r {here} -b {BUS_ID}"
