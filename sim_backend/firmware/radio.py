"""The Bluetooth radio as telegrams see it: name, address, power, and how long it is busy.

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
    """Identity and state of the radio.

    Attributes:
        name: 16 bytes, zero-padded.
        address: Six bytes.
        on: Whether the radio is on.
    """

    def __init__(self, clock: Clock, name: bytes, address: bytes) -> None:
        self._clock = clock
        self.name = _padded(name)
        self.address = address
        self.on = True
        self._busy_until_ms = 0

    @property
    def busy(self) -> bool:
        """Whether an operation is running; no other can start."""
        return self._clock.now_ms < self._busy_until_ms

    def rename(self, name: bytes) -> None:
        """Change the name; at most 15 characters count."""
        self.name = _padded(name)
        self._occupy()

    def switch(self, on: bool) -> None:
        """Switch the radio on or off."""
        self.on = on
        self._occupy()

    def reset(self) -> None:
        """Restore the default name."""
        self.rename(DEFAULT_NAME)

    def _occupy(self) -> None:
        self._busy_until_ms = self._clock.now_ms + _OPERATION_MS


def _padded(name: bytes) -> bytes:
    return name[: NAME_SIZE - 1].ljust(NAME_SIZE, b"\0")
