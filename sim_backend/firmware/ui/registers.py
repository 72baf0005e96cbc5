"""Values that the parts of the user interface share. Source: docs/firmware.md sections 5.2 (Ui map) and 8."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.files.names import NAME_SIZE
from sim_backend.firmware.module import NEVER
from sim_backend.firmware.sound import MAX_VOLUME
from sim_backend.firmware.ui.states import UiState


class UiRegisters:
    """Values of the Ui map, and the mode that the parts share.

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
        next_step_ms: When the state has its next step.
        off_ms: When it was decided to switch off; `NEVER` while the brick is on.
        starting: Whether a start runs, by enter or by a state that was written.
        left_start: Whether another state that was written has ended a start, whose flags are left.
        from_menu: Whether a file that was run from its page has the screen; the state is still that of the page.
    """

    def __init__(self) -> None:
        self.flags, self.state = int(UiFlag.ENABLE_STATUS), int(UiState.WAITING)
        self.button = self.force_off = self.error = self.pointer = 0
        self.run_state, self.has_cable = 1, True
        self.volume, self.program_name = MAX_VOLUME, bytes(NAME_SIZE)
        self.next_step_ms = self.off_ms = NEVER
        self.starting = self.left_start = self.from_menu = False

    def leave_start(self) -> None:
        """End a start, if one runs, by another state."""
        self.left_start = self.left_start or self.starting
        self.starting = False

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
    def is_on(self) -> bool:
        """Whether the brick was not switched off."""
        return self.off_ms == NEVER

    @property
    def runs_file(self) -> bool:
        """Whether a file has the screen: a program, a sound, or the message about its end."""
        return self.state == UiState.RUNNING or self.from_menu

    @property
    def requested(self) -> bool:
        """Whether a file is requested, and nothing is busy."""
        return self.flags & (UiFlag.EXECUTE_FILE | UiFlag.BUSY) == UiFlag.EXECUTE_FILE
