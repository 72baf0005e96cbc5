"""The IO control module: power-off and the boot loader."""

from __future__ import annotations

POWER_DOWN = 0x5A00
BOOT = 0xA55A
"""Commands to the second processor. Source: docs/firmware.md section 5.2 (IOCtrl)."""


class IoControl:
    """Commands to the processor that controls the power supply.

    Attributes:
        power_word: 0, `POWER_DOWN` or `BOOT`.
        display_on: Whether the display is on; it goes off before the power.
    """

    def __init__(self) -> None:
        self.power_word = self._sent = 0
        self._announced = False
        self.display_on = True

    @property
    def power_command(self) -> int:
        """Last command to the second processor: 0x00 none, 0x5A power off, 0xA5 boot loader."""
        sends = self.power_word in (POWER_DOWN, BOOT) and not self._announced
        return (self.power_word if sends else self._sent) >> 8

    def power_down(self, *, announced: bool) -> None:
        """Switch the brick off; the map shows the command a pass before it is sent."""
        self.power_word, self._announced = POWER_DOWN, announced

    def take_back(self) -> None:
        """Clear the command in the map, as the firmware does when the brick is still on after it."""
        self._sent, self.power_word = self.power_command << 8, 0

    def shut_down(self, word: int) -> None:
        """Switch the display off, then the brick."""
        self.display_on = False
        self.power_word = word
