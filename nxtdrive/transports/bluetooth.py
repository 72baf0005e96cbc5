"""Bluetooth on Linux and Windows without extra packages: an RFCOMM socket to a paired brick.

On Linux many builds of Python lack ``socket.AF_BLUETOOTH``, but the kernel still supports it: the socket is created by
number, connected through the C library, and then used as an ordinary socket. On Windows Python has it since 3.9.
"""

from __future__ import annotations

import ctypes
import errno
import os
import select
import socket
import sys
from typing import Self

from firmware_protocol.errors import AddressError, BrickNotFound, LinkBusy, LinkError, PermissionDenied
from nxtdrive.transports.address import MAC, Address
from nxtdrive.transports.sockets import SocketTransport

AF_BLUETOOTH = 31
"""Source: Linux, include/linux/socket.h."""
BTPROTO_RFCOMM = 3
"""Source: BlueZ, lib/bluetooth.h."""
CHANNEL = 1
"""The brick's serial port service. Source: docs/firmware.md section 2."""


class _SockaddrRc(ctypes.Structure):
    """``struct sockaddr_rc``, the address of an RFCOMM socket."""

    _fields_ = (("family", ctypes.c_ushort), ("bdaddr", ctypes.c_uint8 * 6), ("channel", ctypes.c_uint8))


class BluetoothTransport(SocketTransport):
    """``bt://00:16:53:0A:1B:2C``."""

    @classmethod
    def open(cls, address: Address, timeout_s: float = 1.0) -> Self:
        """Connect to the paired brick; Bluetooth paging takes seconds, so at least 10 s are allowed.

        Raises:
            AddressError: Not a Bluetooth address.
            BrickNotFound: The brick does not answer.
            LinkBusy: Another program is connected to it.
            LinkError: This computer has no Bluetooth adapter, or its Python cannot use it.
            PermissionDenied: The brick and this computer are not paired.
        """
        address.read_options({})
        mac = address.target.upper()
        if not MAC.fullmatch(mac):
            raise AddressError(f"{address}: a Bluetooth address looks like bt://00:16:53:0A:1B:2C.")
        if sys.platform.startswith("linux"):
            return cls(str(address), _connect(mac, max(timeout_s, 10.0)))
        if sys.platform == "win32" and hasattr(socket, "AF_BLUETOOTH"):
            return cls(str(address), _connect_on_windows(mac, max(timeout_s, 10.0)))
        raise LinkError(
            f"{address} cannot be opened directly on this system.",
            remedy="Pair the brick, then use its serial port, e.g. serial://COM5 or serial:///dev/cu.NXT-DevB.",
        )


def _socket(family: int, protocol: int) -> socket.socket:
    try:
        return socket.socket(family, socket.SOCK_STREAM, protocol)
    except OSError as error:
        raise LinkError(
            f"this computer offers no Bluetooth: {error.strerror}.",
            remedy="Plug in a Bluetooth adapter, or use usb://.",
        ) from error


def _connect_on_windows(mac: str, timeout_s: float) -> socket.socket:
    connection = _socket(getattr(socket, "AF_BLUETOOTH"), getattr(socket, "BTPROTO_RFCOMM"))  # noqa: B009 - not Linux's
    connection.settimeout(timeout_s)
    try:
        connection.connect((mac, CHANNEL))
    except OSError as error:
        connection.close()
        raise _refused(mac, error.errno or 0, error.strerror or str(error)) from error
    return connection


def _connect(mac: str, timeout_s: float) -> socket.socket:
    connection = _socket(AF_BLUETOOTH, BTPROTO_RFCOMM)
    connection.setblocking(False)
    try:
        failure = _connect_by_number(connection.fileno(), mac)
        if failure == errno.EINPROGRESS:
            _, writable, _ = select.select([], [connection], [], timeout_s)
            failure = connection.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) if writable else errno.ETIMEDOUT
    except BaseException:
        connection.close()
        raise
    if failure:
        connection.close()
        raise _refused(mac, failure, os.strerror(failure))
    return connection


def _connect_by_number(descriptor: int, mac: str) -> int:
    """Call ``connect(2)`` and return 0 or the error number."""
    reversed_bytes = bytes.fromhex(mac.replace(":", ""))[::-1]
    target = _SockaddrRc(AF_BLUETOOTH, (ctypes.c_uint8 * 6)(*reversed_bytes), CHANNEL)
    library = ctypes.CDLL(None, use_errno=True)
    if library.connect(descriptor, ctypes.byref(target), ctypes.sizeof(target)) == 0:
        return 0
    return ctypes.get_errno()


def _refused(mac: str, failure: int, reason: str) -> Exception:
    if failure == errno.EBUSY:
        return LinkBusy(
            f"the brick {mac} is busy: {reason}.", remedy="Close the other program that is connected to it."
        )
    pair = "in the Bluetooth settings" if sys.platform == "win32" else f"`bluetoothctl`, in it `scan on`, `pair {mac}`"
    if failure == errno.EACCES:
        return PermissionDenied(
            f"the brick {mac} does not let this computer in: {reason}.",
            remedy=f"Pair them ({pair}). The brick's default PIN is 1234.",
        )
    return BrickNotFound(
        f"the brick {mac} does not answer: {reason}.",
        remedy=f"Is it on, in range and paired ({pair})? The brick's default PIN is 1234.",
    )
