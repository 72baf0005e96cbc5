"""USB/IP, the side that has the device: answers to ``usbip attach`` and the host's kernel. No I/O.

Messages are those of Linux's Documentation/usb/usbip_protocol.rst, version 1.1.1. `UsbIpSession` handles one
connection: first it lists or hands over its one device, then each message is a transfer. The kernel keeps several reads
under way; each is answered when the device has data.
"""

from __future__ import annotations

import errno
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from sim_backend.doors.usb_device import DEVICE_TO_HOST, Setup, Stall, UsbDevice

PORT = 3240
"""USB/IP's registered TCP port."""

BUS_ID = "1-1"
BUS, DEVICE = 1, 1

VERSION = 0x0111
OPERATION = struct.Struct(">HHI")
REQUEST_LIST, REQUEST_IMPORT = 0x8005, 0x8003
REPLY_LIST, REPLY_IMPORT = 0x0005, 0x0003
BUS_ID_SIZE = 32

OK, DEVICE_BUSY, NO_DEVICE = 0, 2, 4
"""Statuses of the reply to an import, usbip_common.h."""

SUBMIT, UNLINK, SUBMITTED, UNLINKED = 1, 2, 3, 4
HEADER = struct.Struct(">5Ii4I8s")
"""Command, sequence number, device, direction, endpoint; flags or status, length; three fields of isochronous
transfers; setup packet."""

TRANSFER_LIMIT = 1 << 20
"""Longest transfer in bytes that is taken; Linux's usbfs allows 16 MiB in all, webcams and bricks need far less."""


READ_LIMIT = 256
"""Reads under way at an endpoint at which the host is disconnected; drivers keep a dozen at most."""

INTERFACE = 4
"""Type of an interface descriptor."""


@dataclass(slots=True)
class _Read:
    """A bulk transfer to the host that waits for packets."""

    sequence: int
    length: int
    data: bytearray = field(default_factory=bytearray)


class UsbIpSession:
    """One connection of a host.

    Attributes:
        outgoing: Bytes for the host; the owner takes them away.
        imported: Whether the host has the device.
        finished: Whether the connection is to be closed when `outgoing` is sent.
    """

    def __init__(self, device: UsbDevice, in_use: Callable[[], bool]) -> None:
        """Serve `device` unless it is in use by another host at the moment of the import."""
        self.outgoing = bytearray()
        self.imported = self.finished = False
        self._device, self._in_use = device, in_use
        self._received = bytearray()
        self._reads: dict[int, deque[_Read]] = {}

    def feed(self, data: bytes) -> None:
        """Handle bytes from the host; anything that is not USB/IP finishes the session."""
        self._received += data
        while not self.finished and (self._transfer() if self.imported else self._operation()):
            pass
        self.pump()

    @property
    def reading(self) -> bool:
        """Whether the host waits for bulk data."""
        return any(self._reads.values())

    def pump(self) -> None:
        """Answer reads with the packets that the device has for them."""
        for endpoint, reads in self._reads.items():
            packets = self._device.outbox[endpoint]
            while reads and (endpoint in self._device.halted or packets):
                read = reads[0]
                if endpoint in self._device.halted:
                    status, ended = -errno.EPIPE, True
                else:
                    status, ended = self._filled(read, packets.popleft())
                if ended:
                    reads.popleft()
                    self._answer(read.sequence, status, bytes(read.data))

    def _filled(self, read: _Read, packet: bytes) -> tuple[int, bool]:
        """Add a packet; returns the transfer's status and whether it has ended."""
        if len(packet) > read.length - len(read.data):
            return -errno.EOVERFLOW, True
        read.data += packet
        return 0, len(packet) < self._device.packet_size or len(read.data) == read.length

    # --- before the import ---

    def _operation(self) -> bool:
        """Answer a request; returns whether it had arrived completely."""
        if len(self._received) < OPERATION.size:
            return False
        version, code, _ = OPERATION.unpack_from(self._received)
        if version != VERSION or code not in (REQUEST_LIST, REQUEST_IMPORT):
            self.finished = True
            return True
        if code == REQUEST_LIST:
            self.outgoing += OPERATION.pack(VERSION, REPLY_LIST, OK) + struct.pack(">I", 1) + self._described()
            self.outgoing += self._interfaces()
            self.finished = True
            return True
        if len(self._received) < OPERATION.size + BUS_ID_SIZE:
            return False
        wanted = self._take(OPERATION.size + BUS_ID_SIZE)[OPERATION.size :].rstrip(b"\0")
        self._import(wanted)
        return True

    def _import(self, wanted: bytes) -> None:
        status = NO_DEVICE if wanted != BUS_ID.encode() else DEVICE_BUSY if self._in_use() else OK
        self.outgoing += OPERATION.pack(VERSION, REPLY_IMPORT, status)
        if status == OK:
            self.imported = True
            self._device.reset()
            self.outgoing += self._described()
        else:
            self.finished = True

    def _described(self) -> bytes:
        """Return `struct usbip_usb_device`: path, bus, and what the descriptors say."""
        identity = struct.unpack_from("<HHH", self._device.descriptor, 8)
        kind = self._device.descriptor[4:7]
        path = f"/sys/devices/virtual/nxtdrive/{BUS_ID}".encode()
        return (
            struct.pack(">256s32sIIIHHH", path, BUS_ID.encode(), BUS, DEVICE, self._device.speed, *identity)
            + kind
            + bytes((self._device.configuration[5], self._device.descriptor[17], self._device.configuration[4]))
        )

    def _interfaces(self) -> bytes:
        """Return class, subclass and protocol of each interface."""
        found, rest = bytearray(), self._device.configuration
        while rest:
            length, kind = rest[0], rest[1]
            if kind == INTERFACE and rest[3] == 0:
                found += rest[5:8] + b"\0"
            rest = rest[length:]
        return bytes(found)

    # --- after it ---

    def _transfer(self) -> bool:
        """Handle one message; returns whether it had arrived completely."""
        if len(self._received) < HEADER.size:
            return False
        command, sequence, _, to_host, number, flags, length, *_, setup = HEADER.unpack_from(self._received)
        if command == UNLINK:
            self._take(HEADER.size)
            self._unlink(sequence, flags & 0xFFFFFFFF)
            return True
        if command != SUBMIT or length > TRANSFER_LIMIT:
            self.finished = True
            return True
        size = HEADER.size + (0 if to_host else length)
        if len(self._received) < size:
            return False
        data = self._take(size)[HEADER.size :]
        if number == 0:
            self._control(sequence, Setup.decode(setup), data)
        elif to_host:
            self._read(sequence, number | DEVICE_TO_HOST, length)
        else:
            self._write(sequence, number, data)
        return True

    def _control(self, sequence: int, setup: Setup, data: bytes) -> None:
        try:
            answer = self._device.control(setup, data)
        except Stall:
            self._answer(sequence, -errno.EPIPE)
        else:
            self._answer(sequence, 0, answer, None if setup.to_host else len(data))

    def _read(self, sequence: int, endpoint: int, length: int) -> None:
        if endpoint not in self._device.outbox:
            self._answer(sequence, -errno.EPIPE)
            return
        reads = self._reads.setdefault(endpoint, deque())
        reads.append(_Read(sequence, length))
        self.finished = len(reads) > READ_LIMIT

    def _write(self, sequence: int, endpoint: int, data: bytes) -> None:
        try:
            if endpoint in self._device.halted:
                raise Stall
            self._device.take(endpoint, data)
        except Stall:
            self._answer(sequence, -errno.EPIPE)
        else:
            self._answer(sequence, 0, b"", len(data))

    def _unlink(self, sequence: int, victim: int) -> None:
        """Withdraw a read, unless it has been answered already."""
        status = 0
        for reads in self._reads.values():
            for read in [read for read in reads if read.sequence == victim]:
                reads.remove(read)
                status = -errno.ECONNRESET
        self.outgoing += HEADER.pack(UNLINKED, sequence, 0, 0, 0, status, 0, 0, 0, 0, b"")

    def _answer(self, sequence: int, status: int, data: bytes = b"", length: int | None = None) -> None:
        actual = len(data) if length is None else length
        self.outgoing += HEADER.pack(SUBMITTED, sequence, 0, 0, 0, status, actual, 0, 0, 0, b"") + data

    def _take(self, size: int) -> bytes:
        taken = bytes(self._received[:size])
        del self._received[:size]
        return taken
