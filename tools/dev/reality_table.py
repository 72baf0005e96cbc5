"""Print how each effect of reality affects each profile, as the table of docs/reality.md.

::

    nxtdrive sweep --suite reality --seeds 21000-21019 --agents thesis,adaptive,oracle --out reality.jsonl --resume
    python -m tools.dev.reality_table reality.jsonl

An effect's cost is the difference from the same missions without it, in the class `plain`; classes with rooms of their
own have none.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from nxtdrive.cli.output import write_line
from sim_backend.scenarios.classes import REALITY_CLASSES
from sim_backend.scenarios.effects import EFFECTS, PLAIN

from ..sweep.differences import difference
from ..sweep.mission_result import MissionResult
from ..sweep.result_file import read_results
from ..sweep.summary import Estimate, by, figures
from .program import parser


def rows(results: Sequence[MissionResult]) -> Iterator[str]:
    """Yield the lines of the Markdown table, one for each class with missions."""
    agents = by(results, "agent")
    yield "| class | seeds | " + " | ".join(f"{agent} | wrong stops, contacts, seconds" for agent in agents) + " |"
    yield "|---|---|" + "---|---|" * len(agents)
    plain = {agent: by(done, "kind").get(PLAIN, []) for agent, done in agents.items()}
    for kind, done in by(results, "kind").items():
        cells = [_cells(kind, by(done, "agent").get(agent, []), plain[agent]) for agent in agents]
        seeds = len({result.seed for result in done})
        yield f"| `{kind}` | {seeds} | " + " | ".join(cells) + " |"


def _cells(kind: str, results: Sequence[MissionResult], plain: Sequence[MissionResult]) -> str:
    """Return success with its cost, and the mishaps per mission, of one agent in one class."""
    if not results:
        return " | "
    found = figures(results)
    success = f"{found['success'].mean:.2f}{_interval(found['success'])}"
    if kind in EFFECTS and kind != PLAIN:
        cost = difference([result.model_copy(update={"kind": PLAIN}) for result in results], plain)
        if cost.number:
            success = f"{found['success'].mean:.2f}, {cost.mean:+.2f}{_interval(cost, '+')}"
    wrong = sum(target.wrong_stops for result in results for target in result.targets) / len(results)
    return f"{success} | {wrong:.1f}, {found['contacts'].mean:.1f}, {found['duration_s'].mean:.0f}"


def _interval(estimate: Estimate, sign: str = "") -> str:
    return f" [{estimate.low:{sign}.2f}, {estimate.high:{sign}.2f}]" if math.isfinite(estimate.low) else ""


def main() -> None:
    """Print the table of a sweep's file."""
    arguments = parser(__doc__)
    arguments.add_argument("path", metavar="FILE.jsonl", type=Path)
    path = arguments.parse_args().path
    order = {kind: place for place, kind in enumerate(REALITY_CLASSES)}
    results = sorted(
        (result for result in read_results(path) if result.kind in order),
        key=lambda result: (order[result.kind] if result.kind != PLAIN else -1, result.seed),
    )
    for row in rows(results):
        write_line(row)


if __name__ == "__main__":
    main()
