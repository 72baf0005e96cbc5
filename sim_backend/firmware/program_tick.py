"""The Tick of the Command map, which can be behind the brick's time. Source: docs/firmware.md section 8.3."""

from __future__ import annotations

from sim_backend.firmware.module import Clock


class ProgramTick:
    """Milliseconds since power-on as programs see them, without the present pass.

    Args:
        clock: The brick's time.
        stops: Whether it leaves out the pass in which a program is aborted, see `Dialect.abort_stops_tick`.

    Attributes:
        lag: Passes that it has left out.
        in_program: Whether the program runs at this moment of the pass.
    """

    def __init__(self, clock: Clock, *, stops: bool) -> None:
        self._clock, self._stops = clock, stops
        self.lag, self.in_program = 0, False
        self._written: int | None = None

    def read(self) -> int:
        """Return it, 32 bits."""
        if self.in_program and self._written is not None:
            return self._written
        return self._clock.now_ms - self.in_program - self.lag & 0xFFFF_FFFF

    def write(self, tick: int) -> bool:
        """Set it for this pass; returns whether that changes it. After the pass it is one behind."""
        if tick == self.read():
            return False
        self.lag, self._written = 1, tick if self._stops else None
        return True

    def abort(self) -> None:
        """Leave out the present pass, in which a program is aborted."""
        self.lag |= self._stops

    def catch_up(self) -> None:
        """Count the pass that was left out: clumps have run for a whole pass."""
        if self._stops:
            self.lag = 0

    def end_pass(self) -> None:
        """Forget a written value, which counts for one pass only."""
        self._written = None

    @property
    def clump_lag(self) -> int:
        """Passes by which clumps wake up later; they also sleep from a written value on, in its pass."""
        return self.lag if self._written is None else self._clock.now_ms - 1 - self._written
