"""How the display processes its masks and refreshes the screen, as far as its map shows.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol.iomap import DisplayFlag
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.ui.screen_marks import FRAME, Marks

_SCREEN = 0x4000_0000
"""Bit of EraseMask whose turn clears that of the frame in UpdateMask."""

_DRAWING = Marks(update=0x2000_0000)
"""Bits that a program's drawing sets."""

_PERIOD_MS, _FIRST_PAUSE = 17, 15
"""Passes of a refresh, and one, counted from the boot, after which no line is being sent."""

_STOPPED = DisplayFlag.POPUP | DisplayFlag.REFRESH_DISABLED


_TEXT_LINES = 0xFF
"""Bits of UpdateMask for lines of text."""


class ScreenRefresh:
    """The masks and flags of the Display map.

    Attributes:
        due_ms: See `Module`.
        erase_mask: Parts of the screen to erase; one is done in each pass, the highest bit first.
        update_mask: Parts of the screen to draw, after those to erase and in the same way.
        centered_lines: The lines of text among them, its lowest eight bits, that are centered.
        lit: Whether the display's controller was last switched on.
        on_erase: Called with the number of a bit of `erase_mask` whose part of the normal screen is erased; set by the
            brick.
    """

    on_erase: Callable[[int], None]

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.due_ms = NEVER
        self.erase_mask = self.update_mask = self.centered_lines = 0
        self._flags, self._rests_ms, self.lit = int(DisplayFlag.ON | DisplayFlag.REFRESH), NEVER, True
        self._held_ms = self._frozen_ms = NEVER
        self.begin(_FIRST_PAUSE)

    @property
    def flags(self) -> int:
        """See `DisplayFlag`; the screen is being refreshed in all passes but one of each period."""
        now_ms = self._clock.now_ms
        if self._flags & _STOPPED or now_ms == self._held_ms:
            return self._flags
        pauses = self._flags & DisplayFlag.REFRESH and (self._pauses(now_ms) or now_ms == self._rests_ms)
        return self._flags & ~int(DisplayFlag.BUSY) | (0 if pauses else int(DisplayFlag.BUSY))

    @flags.setter
    def flags(self, flags: int) -> None:
        self._flags, self._held_ms = flags, self._clock.now_ms

    @property
    def on(self) -> bool:
        """Whether the display is on."""
        return bool(self._flags & DisplayFlag.ON)

    @on.setter
    def on(self, on: bool) -> None:
        self._flags = self._flags & ~int(DisplayFlag.ON) | on * int(DisplayFlag.ON)
        self.wake()

    def mark(self, marks: Marks) -> None:
        """Change the parts of the screen to erase and to draw from the next pass on."""
        self.erase_mask = self.erase_mask & ~marks.drop_erase | marks.erase
        self.update_mask = self.update_mask & ~marks.drop | marks.update
        centered = 0 if marks.again else marks.update & _TEXT_LINES
        left = marks.uncenter if marks.keeps_centered else marks.drop | marks.uncenter
        self.centered_lines = self.centered_lines & ~left | centered
        if any(marks):
            self.wake()

    def show_drawing(self) -> None:
        """Draw what a program has drawn."""
        self.mark(_DRAWING)

    def drop_drawings(self) -> None:
        """Drop what was left to draw: a program clears the screen."""
        self.update_mask = 0

    def show_normal(self) -> None:
        """Show the normal screen."""
        self._flags &= ~int(DisplayFlag.POPUP)

    def rest(self, now_ms: int) -> None:
        """Show the normal screen, and send no line in the given pass if another was shown."""
        if self.pops_up:
            self._rests_ms = now_ms
        self.show_normal()

    def restore(self) -> None:
        """Switch the display and its refresh on."""
        self.flags = int(DisplayFlag.ON | DisplayFlag.REFRESH)
        self.wake()

    def shut_down(self) -> None:
        """Switch the display off and its refresh on."""
        self.flags = self.flags & ~int(DisplayFlag.ON) | int(DisplayFlag.REFRESH)
        self.wake()

    @property
    def drawing(self) -> bool:
        """Whether parts of the screen are left to erase or to draw."""
        return bool(self.erase_mask or self.update_mask)

    @property
    def pops_up(self) -> bool:
        """Whether a message is shown over the normal screen."""
        return bool(self._flags & DisplayFlag.POPUP)

    def pop_up(self) -> None:
        """Show a message over the normal screen: no line is sent, and the flags stay as they are."""
        self._flags = self.flags | DisplayFlag.POPUP

    def end_refresh(self) -> None:
        """Make the refresh that runs the last one."""
        self.flags &= ~int(DisplayFlag.REFRESH)
        self.wake()

    def refresh(self) -> None:
        """Switch the refresh on again."""
        self.flags |= int(DisplayFlag.REFRESH)
        self.wake()

    @property
    def stopped(self) -> bool:
        """Whether the last refresh has ended."""
        return bool(self._flags & DisplayFlag.REFRESH_DISABLED)

    def begin(self, pause_ms: int) -> None:
        """Begin the refresh again, with a pause in the given pass."""
        self._pause_ms, self._frozen_ms = pause_ms, NEVER

    def wake(self) -> None:
        """Run in the next pass: the map was written."""
        self.due_ms = self._clock.now_ms + 1

    def run(self, now_ms: int) -> None:
        """Do one part of the screen, and end the refresh when it is switched off."""
        if self.erase_mask:
            if self.erase_mask.bit_length() == _SCREEN.bit_length():
                self.update_mask &= ~FRAME
            if not self.pops_up:
                self.on_erase(self.erase_mask.bit_length() - 1)
            self.erase_mask = _without_highest(self.erase_mask)
        else:
            before, self.update_mask = self.update_mask, _without_highest(self.update_mask)
            self.centered_lines &= ~(before ^ self.update_mask)
        pending = self.drawing
        if self._flags & DisplayFlag.POPUP:
            self._go_on(now_ms)
        else:
            pending = self._switch(now_ms) or pending
        self.due_ms = now_ms + 1 if pending else NEVER

    def _switch(self, now_ms: int) -> bool:
        """Refresh the screen, or stop according to the flags; return whether the next pass can change something."""
        if self._flags & DisplayFlag.REFRESH_DISABLED:
            self._frozen_ms = min(self._frozen_ms, now_ms)
            if self._flags & DisplayFlag.REFRESH:
                self._flags, self._held_ms = self._flags & ~int(DisplayFlag.REFRESH_DISABLED), now_ms
                return True
            return False
        self._go_on(now_ms)
        self.lit = self.on
        if self._flags & DisplayFlag.REFRESH:
            return False
        if self._pauses(now_ms):
            self._flags = self._flags & ~int(DisplayFlag.BUSY) | int(DisplayFlag.REFRESH_DISABLED)
            self._frozen_ms = now_ms + 1
        return not self._flags & DisplayFlag.REFRESH_DISABLED

    def _go_on(self, now_ms: int) -> None:
        """Continue a stopped refresh where it was."""
        if self._frozen_ms != NEVER:
            self._pause_ms, self._frozen_ms = self._pause_ms + now_ms - self._frozen_ms, NEVER

    def _pauses(self, now_ms: int) -> bool:
        return (now_ms - self._pause_ms) % _PERIOD_MS == 0


def _without_highest(mask: int) -> int:
    return mask & ~(1 << mask.bit_length() >> 1)
