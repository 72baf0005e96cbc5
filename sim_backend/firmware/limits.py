"""How much fits into a telegram over either link. Source: docs/firmware.md section 2."""

from __future__ import annotations

from typing import NamedTuple


class Limits(NamedTuple):
    """Sizes of one link, bytes.

    Attributes:
        buffer: Of the firmware's receive and send buffers.
        read: Data of a Read reply that fits the buffer.
        io_map_read: Data of an IOMapRead reply.
        io_map_write: Data of an IOMapWrite request.
        poll: Data of a Poll reply.
        streams: Whether files are transferred in pieces of any length, and the dangerous commands refused.
    """

    buffer: int
    read: int
    io_map_read: int
    io_map_write: int
    poll: int
    streams: bool


USB = Limits(64, 58, 55, 54, 59, streams=False)
BLUETOOTH = Limits(128, 122, 119, 118, 121, streams=True)


class Channel:
    """Over which link the firmware is being asked.

    Attributes:
        limits: That link's.
    """

    def __init__(self) -> None:
        self.limits = USB
