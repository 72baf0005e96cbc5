"""Reaction of the user interface to the beginning and end of programs.

Source: docs/firmware.md section 8.
"""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import states
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import Programs


class ProgramWatch:
    """Disables the keys while a program is active, and ends its sound and its drawing.

    Args:
        registers: Those of the user interface.
        programs: The command module.
        sound: The sound module.
        screen: Draws what a program has left.
        restores: Whether the end of a program switches the screen on.
    """

    def __init__(
        self, registers: UiRegisters, programs: Programs, sound: SoundModule, screen: ScreenRefresh, *, restores: bool
    ) -> None:
        self._registers, self._programs, self._sound, self._screen = registers, programs, sound, screen
        self._restores = restores
        self._was_active = self._had_screen = False

    @property
    def due(self) -> bool:
        """Whether to check in the next pass whether a program has ended: nothing else reports that."""
        programs = self._programs
        return programs.busy and not programs.running

    def note_end(self, *, had_screen: bool) -> None:
        """Notice in the next pass that a program, perhaps one that could not start, is over."""
        self._was_active, self._had_screen = True, had_screen

    def follow(self) -> None:
        """Check whether a program is active, once in a pass of the user interface."""
        registers, active = self._registers, self._programs.busy
        began, ended = active and not self._was_active, self._was_active and not active
        if began:
            registers.set(states.RUNNING_FLAGS)
        elif ended:
            self._sound.end_program(registers.volume)
            registers.clear(states.RUNNING_FLAGS)
            if self._had_screen:
                registers.set(UiFlag.ENABLE_STATUS | UiFlag.REDRAW_STATUS)
                self._screen.show_drawing()
            if self._restores:
                self._screen.restore()
        self._was_active = active
