"""The IO control module: the word that switches the brick off or into its boot loader."""

from __future__ import annotations

POWER_DOWN = 0x5A00
BOOT = 0xA55A
"""What the word means to the second processor. Source: docs/firmware.md section 5.2 (IOCtrl)."""


class IoControl:
    """Orders to the processor that controls the supply.

    Attributes:
        power_word: 0, `POWER_DOWN` or `BOOT`.
        display_on: Whether the display is on; it goes off before the supply.
    """

    def __init__(self) -> None:
        self.power_word = 0
        self.display_on = True

    @property
    def power_command(self) -> int:
        """What the second processor was told: 0x00 nothing, 0x5A power off, 0xA5 boot loader."""
        return self.power_word >> 8

    def shut_down(self, word: int) -> None:
        """Switch the display off, then the brick."""
        self.display_on = False
        self.power_word = word
