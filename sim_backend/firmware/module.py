"""What the firmware's modules have in common: they sleep until a pass in which they have something to do."""

from __future__ import annotations

from typing import Protocol

NEVER = 1 << 62
"""A pass that does not come."""


class Clock:
    """The brick's time; only the scheduler moves it.

    Attributes:
        now_ms: Milliseconds since power-on: the passes that are over.
    """

    __slots__ = ("now_ms",)

    def __init__(self, now_ms: int) -> None:
        self.now_ms = now_ms


class Module(Protocol):
    """One module of the firmware, run by the scheduler once per pass of 1 ms.

    The scheduler leaves out passes in which no module has anything to do, so that waiting costs nothing. `run` tells a
    module the pass it is in; it accounts for the uneventful ones before it.

    Attributes:
        due_ms: The next pass the module must not miss; `NEVER` when only a telegram can wake it.
    """

    due_ms: int

    def run(self, now_ms: int) -> None:
        """Run the pass that ends at `now_ms`."""
