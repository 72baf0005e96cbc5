"""Print how each effect of reality affects each profile, as the table of docs/reality.md.

::

    nxtdrive sweep --suite reality --seeds 21000-21019 --agents thesis,adaptive,oracle --out reality.jsonl --resume
    python -m tools.dev.reality_table reality.jsonl

An effect's cost is the difference from the same missions without it, in the class `plain`; classes with rooms of their
own have none.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from nxtdrive.cli.output import write_line
from sim_backend.scenarios.classes import REALITY_CLASSES
from sim_backend.scenarios.effects import EFFECTS, PLAIN

from ..sweep.headline import difference
from ..sweep.performance import Line
from ..sweep.result_file import read_lines
from ..sweep.summary import Estimate, by, figures


def rows(lines: Sequence[Line]) -> Iterator[str]:
    """Yield the lines of the Markdown table, one for each class with missions."""
    agents = by(lines, "policy")
    yield "| class | seeds | " + " | ".join(f"{agent} | wrong stops, contacts, seconds" for agent in agents) + " |"
    yield "|---|---|" + "---|---|" * len(agents)
    plain = {agent: by(done, "class").get(PLAIN, []) for agent, done in agents.items()}
    for kind, done in by(lines, "class").items():
        cells = [_cells(kind, by(done, "policy").get(agent, []), plain[agent]) for agent in agents]
        seeds = len({line["seed"] for line in done})
        yield f"| `{kind}` | {seeds} | " + " | ".join(cells) + " |"


def _cells(kind: str, lines: Sequence[Line], plain: Sequence[Line]) -> str:
    """Return success with its cost, and the mishaps per mission, of one agent in one class."""
    if not lines:
        return " | "
    found = figures(lines)
    success = f"{found['success'].mean:.2f} {_interval(found['success'])}"
    if kind in EFFECTS and kind != PLAIN:
        cost = difference([{**line, "class": PLAIN} for line in lines], plain)
        success = f"{found['success'].mean:.2f}, {cost.mean:+.2f} {_interval(cost, '+')}"
    wrong = sum(target["wrong_stops"] for line in lines for target in line["targets"]) / len(lines)
    return f"{success} | {wrong:.1f}, {found['contacts'].mean:.1f}, {found['duration_s'].mean:.0f}"


def _interval(estimate: Estimate, sign: str = "") -> str:
    return f"[{estimate.low:{sign}.2f}, {estimate.high:{sign}.2f}]"


def main(path: Path) -> None:
    """Print the table of a sweep's file."""
    order = {kind: place for place, kind in enumerate(REALITY_CLASSES)}
    lines = sorted(
        (line for line in read_lines(path) if line["class"] in order),
        key=lambda line: (order[line["class"]] if line["class"] != PLAIN else -1, line["seed"]),
    )
    for row in rows(lines):
        write_line(row)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
