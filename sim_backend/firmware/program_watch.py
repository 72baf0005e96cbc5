"""Reaction of the user interface to programs that it did not start itself.

Source: docs/firmware.md section 8.
"""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware import ui_states as states
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import UiModule


class ProgramWatch:
    """Disables the keys while a program is active, and ends its sound.

    Args:
        ui: The user interface, which does both itself for a program that it started.
        sound: The sound module.
        screen: The screen, if the end of a program switches it on.
    """

    def __init__(self, ui: UiModule, sound: SoundModule, screen: ScreenRefresh | None) -> None:
        self._ui, self._sound, self._screen = ui, sound, screen
        self._was_active = False

    def note_end(self) -> None:
        """Notice in the next pass that a program, perhaps one that could not start, is over."""
        self._was_active = True
        self._ui.wake_later()

    def follow(self) -> None:
        """Check whether a program is active, once in a pass of the user interface."""
        ui, active = self._ui, self._ui.programs.active
        began, ended = active and not self._was_active, self._was_active and not active
        if began:
            ui.flags |= states.RUNNING_FLAGS
        elif ended:
            self._sound.end_program(ui.volume)
            if not ui.runs_file:
                ui.flags = ui.flags & ~states.RUNNING_FLAGS | int(UiFlag.ENABLE_STATUS)
            if self._screen:
                self._screen.restore()
        self._was_active = active
