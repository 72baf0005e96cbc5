"""Values that the parts of the user interface share. Source: docs/firmware.md sections 5.2 (Ui map) and 8."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.files.names import NAME_SIZE
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.sound import MAX_VOLUME
from sim_backend.firmware.ui import times
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.states import UiState

PICTURES = 16
"""Number of the pictures of the logo; the first one is shown twice."""


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
        selected: Name of the file that was opened or chosen last.
        timer: Count of passes that several states share.
        step: Step of a state that takes several, or of a function of the menus, which they share, too.
        counter: The number that the pages of volume and sleep show, from 1 on.
        picture: Number of pictures of the logo that were shown, of `PICTURES`.
        wake_ms: The next pass in which the state has something to do.
        starting: Whether a start is not over.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.flags, self.state = int(UiFlag.ENABLE_STATUS), int(UiState.WAITING)
        self.button = self.force_off = self.error = self.pointer = 0
        self.run_state, self.has_cable = 1, True
        self.volume, self.program_name = MAX_VOLUME, bytes(NAME_SIZE)
        self.timer, self.step = PassCounter(clock, times.MELODY_PASSES), 0
        self.selected, self.counter, self.picture = "", 0, PICTURES
        self.wake_ms, self.starting = NEVER, False

    def go_to(self, state: int) -> None:
        """Continue with a state in the next pass."""
        self.state = int(state)
        self.rest(1)

    def end(self, state: int) -> None:
        """End the steps of a function, and continue with a state."""
        self.step = 0
        self.go_to(state)

    def rest(self, passes: int = NEVER) -> None:
        """Run the state again after some passes rather than in the next one, unless something else happens."""
        self.wake_ms = self._clock.now_ms + passes

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
