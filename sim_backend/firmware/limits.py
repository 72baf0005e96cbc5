"""Sizes of telegrams over USB and Bluetooth. Source: docs/firmware.md section 2."""

from __future__ import annotations

from typing import NamedTuple

from sim_backend.firmware.long_read import LongRead


class Limits(NamedTuple):
    """Sizes of one link in bytes.

    Attributes:
        buffer: Receive and send buffer of the firmware.
        read: Data of a Read reply.
        io_map_read: Data of an IOMapRead reply.
        poll: Data of a Poll reply.
        streams: Whether files are transferred in pieces of any length, and dangerous commands are refused.
    """

    buffer: int
    read: int
    io_map_read: int
    poll: int
    streams: bool


USB = Limits(64, 58, 55, 59, streams=False)
BLUETOOTH = Limits(128, 122, 119, 121, streams=True)


class Channel:
    """The link that the current command came over.

    Attributes:
        limits: Limits of that link.
        follows_port: Whether the high speed port has had its turn at this time, as it has before a command over USB;
            a program runs when the clock shows the next pass.
        inbox: Its receive buffer, with the bytes that follow it in the Comm map.
        outbox: Its send buffer, with the last reply.
        long_read: The long Read over Bluetooth.
    """

    def __init__(self, long_read: LongRead) -> None:
        self.limits, self.long_read, self.follows_port = USB, long_read, False
        self.inbox = self.outbox = memoryview(bytearray(USB.buffer))
