"""A brick served over the network, e.g. by ``nxtdrive sim serve``; telegrams are framed as over Bluetooth."""

from __future__ import annotations

import socket
from typing import Self

from firmware_protocol.errors import AddressError, BrickNotFound
from input_files.plain import whole_number
from nxtdrive.transports.address import Address
from nxtdrive.transports.sockets import SocketTransport

DEFAULT_PORT = 2727


class TcpTransport(SocketTransport):
    """``tcp://host:port``."""

    @classmethod
    def open(cls, address: Address, timeout_s: float = 1.0) -> Self:
        """Connect to the server.

        Raises:
            AddressError: The port is not a number.
            BrickNotFound: No server listens at that address.
        """
        return cls(str(address), connect(address, timeout_s))


def connect(address: Address, timeout_s: float) -> socket.socket:
    """Connect to the host and port of an address; errors as for `TcpTransport.open`."""
    address.read_options({})
    host, port = _split(address)
    try:
        connection = socket.create_connection((host, port), timeout=timeout_s)
        try:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # fails on macOS if the server has left
        except BaseException:
            connection.close()
            raise
    except (OSError, UnicodeError) as error:
        raise BrickNotFound(
            f"no brick is served at {host}:{port}: {getattr(error, 'strerror', None) or error}.",
            remedy="Start the server first, then check host and port.",
        ) from error
    return connection


def _split(address: Address) -> tuple[str, int]:
    host, separator, port = address.target.rpartition(":")
    if not separator or port.endswith("]"):  # which ends an address of IPv6
        host, port = address.target, str(DEFAULT_PORT)
    number = whole_number(port)
    if number is None or not 0 < number < 65536:
        raise AddressError(f"{address}: the port must be a number from 1 to 65535, not {port!r}.")
    return host.strip("[]") or "localhost", number
