"""Plot a sweep: success over time, and by class. Needs the extra ``plot`` (matplotlib)."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import number_of
from nxtdrive.host.environment import require
from sim_backend.scenarios.conditions import TIME_LIMIT_S

from .mission_result import MissionResult
from .summary import CONFIDENCE, by, reached_by, success_rate, wilson

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STYLES = (
    ("#0072b2", "-", "o"),
    ("#56b4e9", "--", "s"),
    ("#d55e00", "-", "D"),
    ("#b05a90", "-.", "^"),
    ("#8a6d00", ":", "v"),
    ("#222222", (0, (6, 2, 1, 2, 1, 2)), "P"),
)
"""Colour, dashes and marker of each agent, distinct for colour-blind readers (Okabe and Ito 2008) and in grey."""
MARK_EVERY_S = 50
ROW_INCHES, MIN_INCHES = 0.48, 5.2


def check_plotting(path: Path) -> None:
    """Check that a plot can be drawn into this file, before a sweep runs for hours.

    Raises:
        ConfigError: matplotlib is not installed, or does not support the format.
    """
    require("plot", "matplotlib", what="a plot")
    from matplotlib.backend_bases import FigureCanvasBase

    if path.suffix[1:].lower() not in FigureCanvasBase.get_supported_filetypes():
        raise ConfigError(
            f"{path} cannot be drawn: its name must end in .png, .svg or .pdf.",
            remedy="Choose another file with --plot.",
        )


def plot_bytes(results: Sequence[MissionResult], suffix: str) -> bytes:
    """Return the image file with success over mission time and success by class.

    Args:
        results: The sweep's results.
        suffix: ``.png``, ``.svg`` or ``.pdf``, as `check_plotting` accepts it.
    """
    from matplotlib.figure import Figure

    height = max(MIN_INCHES, 1.6 + ROW_INCHES * len(by(results, "kind")))
    figure = Figure(figsize=(12, height), layout="constrained")
    figure.suptitle(title(results))
    over_time, by_class = figure.subplots(1, 2)
    _plot_over_time(over_time, results)
    _plot_by_class(by_class, results)
    figure.legend(*over_time.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    content = io.BytesIO()
    figure.savefig(content, format=suffix[1:].lower())
    return content.getvalue()


def title(results: Sequence[MissionResult]) -> str:
    """Return the title of a plot: how many missions of how many classes, on which seeds."""
    seeds, classes = sorted({result.seed for result in results}), by(results, "kind")
    span = f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"
    kinds = f"class {next(iter(classes))}" if len(classes) == 1 else f"{len(classes)} classes"
    return f"{number_of(len(results), 'simulated mission')}: {kinds}, {span}"


def counted(results: Sequence[MissionResult]) -> tuple[float, float]:
    """Return how many targets were reached, and how many exist."""
    reached, number = np.sum([success_rate(result) for result in results], axis=0) if results else (0.0, 0.0)
    return float(reached), float(number)


def _plot_over_time(axes: Axes, results: Sequence[MissionResult]) -> None:
    times = np.arange(0.0, TIME_LIMIT_S + 1.0, 1.0)
    for i, (agent, group) in enumerate(by(results, "agent").items()):
        color, dashes, marker = STYLES[i % len(STYLES)]
        label = f"{agent} (n = {counted(group)[1]:.0f} targets)"
        (curve,) = axes.plot(times, 100 * reached_by(group, times), color=color, linestyle=dashes, label=label)
        curve.set(marker=marker, markersize=5, markevery=(4 * i, MARK_EVERY_S))
    axes.set(xlabel="mission time (s)", ylabel="targets reached so far (%)", ylim=(0, 102), xlim=(0, TIME_LIMIT_S))
    axes.set_title("Success over time")
    axes.grid(color="0.88")


def _plot_by_class(axes: Axes, results: Sequence[MissionResult]) -> None:
    agents, kinds = by(results, "agent"), list(by(results, "kind"))
    step = 0.8 / len(agents)
    for i, group in enumerate(agents.values()):
        color, _, marker = STYLES[i % len(STYLES)]
        cells = by(group, "kind")
        rows = [(row, *counted(cells.get(kind, []))) for row, kind in enumerate(kinds)]
        for row, reached, number in rows:
            if number:
                y, share = row + (i - len(agents) / 2 + 0.5) * step, reached / number
                low, high = wilson(reached, number)
                bars = [[100 * (share - low)], [100 * (high - share)]]
                axes.errorbar(100 * share, y, xerr=bars, color=color, marker=marker, markersize=4, capsize=1.5, lw=1)
    for row in range(len(kinds) - 1):
        axes.axhline(row + 0.5, color="0.88", lw=0.8)
    axes.set(yticks=range(len(kinds)), yticklabels=[_class_label(results, kind) for kind in kinds], xlim=(-2, 102))
    axes.set(xlabel=f"targets reached (%), with {CONFIDENCE:.0%} Wilson intervals", ylim=(len(kinds) - 0.5, -0.5))
    axes.set_title("Success by class")
    axes.grid(axis="x", color="0.88")


def _class_label(results: Sequence[MissionResult], kind: str) -> str:
    """Return a class's name with the number of its targets for each agent."""
    numbers = {counted(group)[1] for group in by(by(results, "kind")[kind], "agent").values()}
    low, high = min(numbers), max(numbers)
    return f"{kind}\nn = {low:.0f}" if low == high else f"{kind}\nn = {low:.0f} to {high:.0f}"
