"""Plot a sweep: success over time, and by class. Needs the extra ``plot`` (matplotlib)."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from firmware_protocol.errors import ConfigError
from nxtdrive.host.environment import install_extra

from .performance import Line
from .scenarios import TIME_LIMIT_S
from .summary import by, estimate, reached_by, success_rate


def check_plotting() -> None:
    """Check that plots can be drawn, before a sweep runs for hours.

    Raises:
        ConfigError: matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise ConfigError("plots need matplotlib.", remedy=f"Install it: {install_extra('plot')}")


def write_plot(lines: Sequence[Line], path: Path) -> None:
    """Draw success over mission time and success by class.

    Args:
        lines: The sweep's lines.
        path: The image file; its extension selects the format (png, svg, pdf).

    Raises:
        ConfigError: matplotlib is not installed, or does not know the format.
    """
    check_plotting()
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.5), layout="constrained")
    over_time, by_class = figure.subplots(1, 2)
    times = np.arange(0.0, TIME_LIMIT_S + 1.0, 1.0)
    policies = by(lines, "policy")
    for policy, group in policies.items():
        over_time.plot(times, reached_by(group, times), label=policy)
    over_time.set(xlabel="mission time, s", ylabel="targets reached", ylim=(0, 1.02), title="success over time")
    over_time.legend()
    kinds = list(by(lines, "class"))
    width = 0.8 / len(policies)
    for i, group in enumerate(policies.values()):
        cells = by(group, "class")
        rates = [estimate([success_rate(line) for line in cells.get(kind, [])]).mean for kind in kinds]
        by_class.barh(np.arange(len(kinds)) + (i - len(policies) / 2 + 0.5) * width, rates, width)
    by_class.set(yticks=range(len(kinds)), yticklabels=kinds, xlim=(0, 1.02), title="success by class")
    by_class.invert_yaxis()
    try:
        figure.savefig(path)
    except (ValueError, OSError) as error:
        raise ConfigError(f"{path} cannot be drawn: {error}.", remedy="Name another with --plot.") from None
