"""Base of the firmware's modules: they sleep until a pass in which they have work."""

from __future__ import annotations

from typing import Protocol

NEVER = 1 << 62
"""A pass that never comes."""


class Clock:
    """The brick's time; only the scheduler advances it.

    Attributes:
        now_ms: Milliseconds since power-on, the number of completed passes.
    """

    __slots__ = ("now_ms",)

    def __init__(self, now_ms: int) -> None:
        self.now_ms = now_ms


class Module(Protocol):
    """One module of the firmware, run by the scheduler once per pass of 1 ms.

    The scheduler skips passes in which no module has work. `run` receives the number of the pass; the module accounts
    for the skipped ones before it.

    Attributes:
        due_ms: The next pass that must run; `NEVER` if only a telegram can wake the module.
    """

    due_ms: int

    def run(self, now_ms: int) -> None:
        """Run the pass that ends at `now_ms`."""
