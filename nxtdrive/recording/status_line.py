"""A live line on the terminal: state, target, sighting, mission time, battery, and the reason for a recovery."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.text import Text

from behaviors.journal import Record, RecordKind
from behaviors.recoveries import Recovery, recovery_in
from firmware_protocol.printable import printable
from nxtdrive.recording.wording import outage_words

REDRAWS_PER_S = 8


class StatusLine:
    """Shows the latest values; prints nothing on what is not a terminal.

    It sends no requests to the robot, so a run is the same with and without it.

    Args:
        console: The terminal.
    """

    def __init__(self, console: Console) -> None:
        self._battery = ""
        self._sighting = "-"
        self._why = self._outage = ""
        self._live = Live(console=console, refresh_per_second=REDRAWS_PER_S, transient=True)
        self._shown = console.is_terminal

    def __enter__(self) -> Self:
        """Start drawing."""
        if self._shown:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Clear the line."""
        self._live.stop()

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Free the terminal for other output during the block."""
        self._live.stop()
        try:
            yield
        finally:
            if self._shown:
                self._live.start()

    def __call__(self, record: Record) -> None:
        """Update the line with a record."""
        if not self._shown:
            return
        if record.kind is RecordKind.CHOICE:
            self._why = str(record.data["why"])
        if record.kind is RecordKind.OUTAGE:
            self._outage = outage_words(record)
        if record.kind is RecordKind.LOOK:
            sighting = record.data.get("sighting")
            self._sighting = _sighting(sighting) if isinstance(sighting, dict) else "-"
        battery_mv = record.data.get("battery_mv")
        if isinstance(battery_mv, int):
            self._battery = f"  battery {battery_mv / 1000:.1f} V"
        recovery = recovery_in(record.state)
        self._live.update(
            Text.assemble(
                (f" {recovery.label if recovery else record.state:<9}", "bold"),
                f" {printable(record.target)}  ",
                (f"sighting {self._sighting}", "green" if self._sighting != "-" else "dim"),
                f"  {record.time_s:6.1f} s",
                self._battery,
                (printable(self._note(record.state, recovery)), "dim"),
                no_wrap=True,
                overflow="ellipsis",
            )
        )

    def _note(self, state: str, recovery: Recovery | None) -> str:
        """Return why it is in this state, where that is not obvious."""
        if state == "suspended":
            return f"  {self._outage}"
        return f"  {self._why}" if recovery and self._why else ""


def _sighting(values: Mapping[str, object]) -> str:
    at_most = "≤ " if values.get("bound") else ""
    return f"{at_most}{values['distance_mm']:.0f} mm at {values['bearing_deg']:+z.0f}°"
