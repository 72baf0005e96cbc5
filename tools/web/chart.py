"""The statechart and the recoveries as plain values, taken from the class and the registry."""

from __future__ import annotations

from dataclasses import asdict

from behaviors.chart_words import STATES
from behaviors.diagram import arrows, initial_states, regions
from behaviors.recoveries import RECOVERIES


def chart() -> dict[str, object]:
    """Return the regions as trees, the states in which a mission begins, all transitions, and sentences on states."""
    return {
        "regions": [asdict(region) for region in regions()],
        "initial": initial_states(),
        "arrows": [asdict(arrow) for arrow in arrows()],
        "words": STATES,
    }


def recoveries() -> dict[str, dict[str, object]]:
    """Return label and colour (red, green, blue) of each recovery, by name."""
    return {each.name: {"label": each.label, "rgb": list(each.color)} for each in RECOVERIES.values()}
