"""The command module, which runs programs, as long as none runs: its clock and the data log's.

Source: docs/firmware.md sections 4 and 5.2 (Command map).
"""

from __future__ import annotations

from sim_backend.firmware.module import Clock

MAILBOXES = 20
"""Ten towards a program and ten from it."""


class CommandModule:
    """State that telegrams can see.

    Attributes:
        sync_time: Time set by the data log's owner.
        sync_tick: The brick's time when it was set.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.sync_time = self.sync_tick = 0

    @property
    def tick(self) -> int:
        """Milliseconds since power-on, 32 bits."""
        return self._clock.now_ms & 0xFFFF_FFFF

    def set_times(self, sync_time: int) -> None:
        """Remember the owner's time and the brick's."""
        self.sync_time, self.sync_tick = sync_time, self.tick
