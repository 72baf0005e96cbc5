"""Shows a decision on the terminal: the evidence, and the candidates with their expected cost."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from rich.table import Table
from rich.text import Text

from behaviors.evidence import Evidence
from behaviors.operator import OperatorChoice
from firmware_protocol.printable import printable
from nxtdrive.cli.output import make_table
from nxtdrive.recording.wording import evidence_lines

SECONDS_SHOWN = 10_000.0
"""An expected time beyond this is shown as "never"."""


def known_lines(evidence: Evidence) -> Text:
    """List the evidence, one item per line."""
    return Text("\n".join(map(printable, evidence_lines(evidence))))


def candidate_table(candidates: Sequence[OperatorChoice], marks: Iterable[str], chosen: int | None) -> Table:
    """Make a table of the candidates with the policy's estimates.

    Args:
        candidates: One per row.
        marks: First cell of each row.
        chosen: Index of the row in bold, or None.
    """
    table = make_table("", "candidate", box=None, padding=(0, 2, 0, 0), header_style="dim")
    for title in ("takes", "chance", "per success"):
        table.add_column(title, justify="right", overflow="fold")
    for number, (candidate, mark) in enumerate(zip(candidates, marks, strict=True)):
        cells = [printable(candidate.choice.words()), *_expected(candidate)]
        table.add_row(mark, *cells, style="bold" if number == chosen else None)
    return table


def _expected(candidate: OperatorChoice) -> tuple[str, str, str]:
    weighed = candidate.weighed
    if weighed is None:
        return "-", "-", "-"
    return f"{_seconds(weighed.seconds)}", f"{weighed.chance:.0%}", _seconds(weighed.expected_s)


def _seconds(value: float) -> str:
    return "never" if math.isinf(value) or value > SECONDS_SHOWN else f"{value:.0f} s"
