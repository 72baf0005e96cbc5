"""The link that a command comes over. Source: docs/firmware.md section 2."""

from __future__ import annotations

from sim_backend.firmware.limits import USB
from sim_backend.firmware.long_read import LongRead


class CommandLink:
    """The link that the current command came over.

    Attributes:
        limits: Limits of that link.
        follows_port: Whether the high speed port has already run in this pass, as before a command over USB;
            a program runs when the clock shows the next pass.
        inbox: Its receive buffer, with the bytes that follow it in the Comm map.
        outbox: Its send buffer, with the last reply.
        long_read: The long Read over Bluetooth.
    """

    def __init__(self, long_read: LongRead) -> None:
        self.limits, self.long_read, self.follows_port = USB, long_read, False
        self.inbox = self.outbox = memoryview(bytearray(USB.buffer))
