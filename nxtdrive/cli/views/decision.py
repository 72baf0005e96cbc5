"""Show a decision on the terminal: the evidence, and the candidates with their expected cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from behaviors.evidence import Evidence
from behaviors.operator import OperatorChoice
from firmware_protocol.printable import printable
from nxtdrive.cli.output import make_table
from nxtdrive.recording.wording import evidence_lines

ESTIMATES = ("costs", "chance", "per success")
"""Titles of the estimates; a detour costs only what it takes beyond the straight path."""
NARROW = 50
"""In fewer columns the candidates' words would be cut into pieces beside the estimates."""
SECONDS_SHOWN = 10_000.0
"""An expected time beyond this is shown as "never"."""


def known_lines(evidence: Evidence) -> Text:
    """List the evidence, one item per line."""
    return Text("\n".join(map(printable, evidence_lines(evidence))))


@dataclass(frozen=True, slots=True)
class CandidateTable:
    """Candidates with the policy's estimates, for rich; in a narrow terminal the estimates are below each candidate.

    Attributes:
        candidates: One per row.
        marks: First cell of each row.
        chosen: Index of the row in bold, or None.
    """

    candidates: Sequence[OperatorChoice]
    marks: Sequence[str]
    chosen: int | None

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Yield the table that fits."""
        yield self._fitting(options)

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        """Return the widths of the table that fits."""
        return Measurement.get(console, options, self._fitting(options))

    def _fitting(self, options: ConsoleOptions) -> Table:
        narrow = options.max_width < NARROW
        table = make_table("", "candidate", box=None, padding=(0, 2, 0, 0), header_style="dim", show_header=not narrow)
        for title in () if narrow else ESTIMATES:
            table.add_column(title, justify="right", overflow="fold")
        for number, (candidate, mark) in enumerate(zip(self.candidates, self.marks, strict=True)):
            words, estimates = printable(candidate.choice.words()), _expected(candidate)
            below = ", ".join(f"{title} {each}" for title, each in zip(ESTIMATES, estimates, strict=True))
            cells = [f"{words}\n{below}" if candidate.weighed else words] if narrow else [words, *estimates]
            table.add_row(mark, *cells, style="bold" if number == self.chosen else None)
        return table


def _expected(candidate: OperatorChoice) -> tuple[str, str, str]:
    weighed = candidate.weighed
    if weighed is None:
        return "-", "-", "-"
    return _seconds(weighed.seconds), f"{weighed.chance:.0%}", _seconds(weighed.expected_s)


def _seconds(value: float) -> str:
    return "never" if math.isinf(value) or value > SECONDS_SHOWN else f"{value:.0f} s"
