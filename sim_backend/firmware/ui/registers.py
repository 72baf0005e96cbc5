"""Values that the parts of the user interface share. Source: docs/firmware.md sections 5.2 (Ui map) and 8."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.files.names import NAME_SIZE
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.sound import MAX_VOLUME
from sim_backend.firmware.ui import times
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.states import UiState

PICTURES = 17
"""Number of the pictures of the logo."""


class UiRegisters:
    """Values of the Ui map, and those that its states leave to each other.

    Attributes:
        flags: See `firmware_protocol.iomap.UiFlag`.
        state: See `UiState`.
        button: A button pressed through the map, 0 for none.
        force_off: Nonzero to switch the brick off.
        run_state: Nonzero while the running sign of the status bar turns.
        error, pointer: Values that only the map uses; a start clears the error.
        volume: Volume of the menu, which SetProperty changes along with the sound module's.
        program_name: The file to start, 20 bytes.
        has_cable: Whether the USB cable is in.
        timer: Count of passes that several states share.
        step: Step of a state that takes several, which they share, too; see `states.Step`.
        picture: The picture of the logo that is shown, from 1 on.
        wake_ms: The next pass in which the state has something to do.
        starting: Whether a start is not over.
        may_switch_off: Whether exit switches the brick off when it is held: not from a file's beginning to its end.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.flags, self.state = int(UiFlag.ENABLE_STATUS), int(UiState.WAITING)
        self.button = self.force_off = self.error = self.pointer = 0
        self.run_state, self.has_cable = 1, True
        self.volume, self.program_name = MAX_VOLUME, bytes(NAME_SIZE)
        self.timer, self.step = PassCounter(clock, times.MELODY_PASSES), 0
        self.picture, self.wake_ms, self.starting, self.may_switch_off = PICTURES, NEVER, False, True

    def go_to(self, state: int) -> None:
        """Continue with a state in the next pass."""
        self.state = int(state)
        self.wake_in(1)

    def wake_in(self, passes: int) -> None:
        """Run the state again after some passes, at the latest."""
        self.wake_ms = min(self.wake_ms, self._clock.now_ms + passes)

    def set(self, flags: int) -> None:
        """Set bits of the flags."""
        self.flags |= int(flags)

    def clear(self, flags: int) -> None:
        """Clear bits of the flags."""
        self.flags &= ~int(flags)

    def put(self, flags: int, on: bool) -> None:
        """Set or clear bits of the flags."""
        self.flags = self.flags & ~int(flags) | on * int(flags)

    @property
    def usb_state(self) -> int:
        """2 while the USB cable is in, else 0."""
        return 2 * self.has_cable

    @property
    def requested(self) -> bool:
        """Whether a file is requested, and nothing is busy."""
        return self.flags & (UiFlag.EXECUTE_FILE | UiFlag.BUSY) == UiFlag.EXECUTE_FILE
