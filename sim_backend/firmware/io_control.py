"""The IO control module: power-off and the boot loader. Source: docs/firmware.md sections 5 (0x97) and 8.5."""

from __future__ import annotations

POWER_DOWN = 0x5A00
BOOT = 0xA55A
"""Commands to the second processor. Source: docs/firmware.md section 5.2 (IOCtrl)."""


class IoControl:
    """Commands to the processor that controls the power supply.

    Attributes:
        stays_on: Whether the brick is still on after it was switched off; then a word in the map is sent at once.
    """

    def __init__(self) -> None:
        self._word = self._sent = 0
        self._announced = self.stays_on = False

    @property
    def power_word(self) -> int:
        """0, `POWER_DOWN` or `BOOT`."""
        return self._word

    @power_word.setter
    def power_word(self, word: int) -> None:
        self._sent, self._word = self.power_command << 8, word
        if self.stays_on:
            self.take_back()

    @property
    def power_command(self) -> int:
        """Last command to the second processor: 0x00 none, 0x5A power off, 0xA5 boot loader."""
        sends = self._word in (POWER_DOWN, BOOT) and not self._announced
        return (self._word if sends else self._sent) >> 8

    def announce_power_down(self) -> None:
        """Show the command to switch off in the map, a pass before it is sent."""
        self._sent, self._word, self._announced, self.stays_on = self.power_command << 8, POWER_DOWN, True, False

    def send(self) -> None:
        """Send the command of the map."""
        self._announced = False

    def take_back(self) -> None:
        """Clear the command in the map, as the firmware does in each pass when the brick is still on after it."""
        self._sent, self._word, self.stays_on = self.power_command << 8, 0, True
