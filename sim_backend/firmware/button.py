"""The button module: states and counters of the buttons. Source: docs/firmware.md sections 5.2 (Button map) and 8."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import IntFlag

from sim_backend.firmware.module import NEVER, Clock

EXIT_BUTTON, RIGHT_BUTTON, LEFT_BUTTON, ENTER_BUTTON = range(4)
"""Numbers of the buttons, and of their bits in masks."""

SAMPLE_MS = 2
LONG_PRESS_MS = 2000


class ButtonState(IntFlag):
    """State byte of the map; events last until the next sample, `NEW_PRESS` only for one pass."""

    NEW_PRESS = 0x01
    SHORT_RELEASE = 0x02
    LONG_PRESS = 0x04
    LONG_RELEASE = 0x08
    PRESSED = 0x80


class Button:
    """One button.

    Attributes:
        presses, long_presses, short_releases, long_releases, releases: 8-bit counters since power-on.
        state: See `ButtonState`.
        pressed: Whether it was down at the last sample.
    """

    def __init__(self) -> None:
        self.presses = self.long_presses = self.short_releases = self.long_releases = self.releases = 0
        self.state = 0
        self.pressed = False
        self._pressed_ms = 0

    def sample(self, pressed: bool, now_ms: int) -> None:
        """Update state and counters; the number of releases is the sum of short and long ones."""
        before, self.pressed = self.pressed, pressed
        held_ms = now_ms - self._pressed_ms
        self.state = int(ButtonState.PRESSED) if before else 0
        if pressed and not before:
            self._pressed_ms = now_ms
            self.presses = self.presses + 1 & 0xFF
            self.state = int(ButtonState.PRESSED | ButtonState.NEW_PRESS)
        elif pressed and held_ms == LONG_PRESS_MS:
            self.long_presses = self.long_presses + 1 & 0xFF
            self.state |= ButtonState.LONG_PRESS
        elif before and not pressed:
            self._release(held_ms > LONG_PRESS_MS + SAMPLE_MS)  # one that is released at once counts as short
        self.releases = self.short_releases + self.long_releases & 0xFF

    def forget_releases(self) -> None:
        """Clear the counters of releases."""
        self.short_releases = self.long_releases = self.releases = 0

    def _release(self, long: bool) -> None:
        if long:
            self.long_releases = self.long_releases + 1 & 0xFF
            self.state = int(ButtonState.LONG_RELEASE)
        else:
            self.short_releases = self.short_releases + 1 & 0xFF
            self.state = int(ButtonState.SHORT_RELEASE)


class ButtonModule:
    """The four buttons.

    Args:
        clock: The brick's time.
        buttons: The buttons by their numbers.
        on_change: Called with a mask of newly pressed buttons when buttons were pressed, released or long held.

    Attributes:
        due_ms: See `Module`.
        buttons: As given.
    """

    def __init__(self, clock: Clock, buttons: Sequence[Button], on_change: Callable[[int], None]) -> None:
        self._clock, self.buttons, self._on_change = clock, buttons, on_change
        self.due_ms = NEVER
        self._mask = 0

    @property
    def exit_held(self) -> bool:
        """Whether exit has just been held for two seconds."""
        return bool(self.buttons[EXIT_BUTTON].state & ButtonState.LONG_PRESS)

    def hold(self, mask: int) -> None:
        """Hold the buttons of `mask`, a bit for each number, and release the others."""
        self._mask = mask
        self.wake()

    def wake(self) -> None:
        """Sample the buttons at the next time."""
        if any(button.state & ButtonState.NEW_PRESS for button in self.buttons):
            self.due_ms = self._clock.now_ms
        self.due_ms = min(self.due_ms, (self._clock.now_ms // SAMPLE_MS + 1) * SAMPLE_MS)

    def note_write(self) -> None:
        """Show written states to the user interface until the next sample."""
        self.wake()
        self._on_change(0)

    def forget_releases(self) -> None:
        """Clear the counters of releases: whenever inputs and outputs are reset."""
        for button in self.buttons:
            button.forget_releases()

    def run(self, now_ms: int) -> None:
        """Sample all buttons; repeat while one is pressed or has an event to clear."""
        if now_ms % SAMPLE_MS:
            for button in self.buttons:
                button.state &= ~ButtonState.NEW_PRESS
            self.due_ms = now_ms + 1
            return
        before = sum(button.pressed << number for number, button in enumerate(self.buttons))
        shown = [button.state & ButtonState.PRESSED for button in self.buttons]
        for number, button in enumerate(self.buttons):
            button.sample(bool(self._mask >> number & 1), now_ms)
        new = self._mask & ~before
        differs = shown != [button.state & ButtonState.PRESSED for button in self.buttons]  # also if it was written
        if self._mask != before or self.exit_held or differs:
            self._on_change(new)
        steady = new == 0 and any(button.state for button in self.buttons)
        self.due_ms = now_ms + 1 if new else now_ms + SAMPLE_MS if steady else NEVER
