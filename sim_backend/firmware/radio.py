"""The Bluetooth radio as far as telegrams see it: name, address, power, and that it takes its time.

Source: docs/firmware.md section 5 (0x98, 0x9A, 0x9B, 0xA4) and section 10.
"""

from __future__ import annotations

from sim_backend.firmware.module import Clock

NAME_SIZE = 16
"""Bytes of the name field; at most 15 count."""

DEFAULT_NAME = b"NXT"

_OPERATION_MS = 500
"""How long the radio is busy after a change."""


class Radio:
    """Who the brick is, on the air.

    Attributes:
        name: 16 bytes, zero-padded.
        address: Six bytes.
        on: Whether the radio is on.
    """

    def __init__(self, clock: Clock, name: bytes, address: bytes) -> None:
        self._clock = clock
        self.name = name[: NAME_SIZE - 1].ljust(NAME_SIZE, b"\0")
        self.address = address
        self.on = True
        self._busy_until_ms = 0

    @property
    def busy(self) -> bool:
        """Whether an operation is running, so that no other can start."""
        return self._clock.now_ms < self._busy_until_ms

    def rename(self, name: bytes) -> None:
        """Take up to 15 characters as the new name."""
        self.name = name[: NAME_SIZE - 1].ljust(NAME_SIZE, b"\0")
        self._occupy()

    def switch(self, on: bool) -> None:
        """Switch the radio on or off."""
        self.on = on
        self._occupy()

    def reset(self) -> None:
        """Back to the name it was delivered with."""
        self.rename(DEFAULT_NAME)

    def _occupy(self) -> None:
        self._busy_until_ms = self._clock.now_ms + _OPERATION_MS
