"""Sizes of telegrams over USB and Bluetooth. Source: docs/firmware.md section 2."""

from __future__ import annotations

from typing import NamedTuple


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
