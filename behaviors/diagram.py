"""The chart as tables and as a diagram, generated from the class, so that neither can become outdated.

The chart library's own Mermaid exporter redraws an edge at a compound's border as an edge of its first child, which is
wrong for `suspend` and `recovery_done`; this one draws what is declared.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from statemachine import HistoryState, State

from behaviors.chart import ROBOT, MissionChart
from behaviors.chart_words import EVENTS, STATES
from behaviors.recoveries import RECOVERIES


@dataclass(frozen=True, slots=True)
class Transition:
    """One declared transition.

    Attributes:
        region: Name of the region it stands in.
        source: State it leaves.
        event: Fact that triggers it; empty for one that follows by itself.
        guard: Condition, empty for none; ``!`` in front negates.
        target: State it enters.
        action: Name of the chart's method that the transition calls; empty for none.
    """

    region: str
    source: str
    event: str
    guard: str
    target: str
    action: str = ""

    @property
    def label(self) -> str:
        """Event and guard as a diagram shows them."""
        return " ".join(part for part in (self.event, f"[{self.guard}]" if self.guard else "") if part)


def arrows() -> list[Transition]:
    """Return every declared transition of the chart, region by region."""
    found = [arrow for region in ROBOT.states for arrow in _arrows_below(region, region.id)]
    return [*found, *_arrows_of(ROBOT, "robot")]


@dataclass(frozen=True, slots=True)
class StateNode:
    """A state with the states in it.

    Attributes:
        state: Its name.
        inner: The states in it, in the order of their declaration.
    """

    state: str
    inner: tuple[StateNode, ...]


def regions() -> list[StateNode]:
    """Return the chart's regions, each with all states in it."""
    return [_box(region) for region in ROBOT.states]


def initial_states() -> list[str]:
    """Return the states in which a mission begins, one for each region."""
    return [next(child.id for child in region.states if child.initial) for region in ROBOT.states]


def transition_table() -> str:
    """Return a Markdown table of all transitions, with their actions."""
    rows = ((a.region, a.source, a.event or "(at once)", a.guard, a.target, _sentence(a.action)) for a in arrows())
    return _table(("region", "in state", "on", "if", "to", "action"), rows)


def state_table() -> str:
    """Return a Markdown table of all states, each in a sentence, with what the chart does on entry."""
    rows = ((name, text, _sentence(f"on_enter_{name}")) for name, text in STATES.items())
    return _table(("state", "meaning", "on entry"), rows)


def event_table() -> str:
    """Return a Markdown table of all events, each in a sentence."""
    return _table(("event", "meaning"), ((str(event), text) for event, text in EVENTS.items()))


def guard_table() -> str:
    """Return a Markdown table of the guards that are methods of the chart."""
    found = dict.fromkeys(name for arrow in arrows() for name in arrow.guard.replace("!", "").split(" and "))
    names = [name for name in found if hasattr(MissionChart, name)]
    return _table(("guard", "holds when"), ((name, _sentence(name).removeprefix("Guard: ")) for name in names))


def recovery_table() -> str:
    """Return a Markdown table of all recoveries."""
    rows = ((each.name, " or ".join(each.states), each.label, each.fits) for each in RECOVERIES.values())
    return _table(("recovery", "state", "in words", "fits the cause"), rows)


def mermaid() -> str:
    """Return the chart as a Mermaid state diagram."""
    lines = ["stateDiagram-v2", "    state robot {"]
    for i, region in enumerate(ROBOT.states):
        if i:
            lines.append("        --")
        lines += _compound(region, 2)
    lines.append("    }")
    lines += [f"    robot --> done : {arrow.label}" for arrow in _arrows_of(ROBOT, "robot")]
    return "\n".join(lines)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows))


def _sentence(name: str) -> str:
    """Return the first line of a chart's method's docstring, or an empty string if there is no such method."""
    method = vars(MissionChart).get(name)
    return (method.__doc__ or "").partition("\n")[0] if method else ""


def _box(state: State) -> StateNode:
    return StateNode(state.id, tuple(_box(child) for child in state.states))


def _arrows_below(state: State, region: str) -> Iterator[Transition]:
    for child in state.states:
        yield from _arrows_of(child, region)
        yield from _arrows_below(child, region)


def _arrows_of(state: State, region: str) -> Iterator[Transition]:
    """Yield the transitions declared on `state`, without the library's own to initial children."""
    for transition in state.transitions:
        if transition.target is None or transition.initial:
            continue
        guard = " and ".join(str(condition) for condition in transition.cond)
        action = ", ".join(str(call) for call in transition.on if not call.is_convention)
        yield Transition(region, state.id, transition.event or "", guard, transition.target.id, action)


def _entered_by_itself(compound: State) -> bool:
    """Return whether a transition leads to a compound as such, not only to its states; a region is entered so."""
    return compound.parent is None or compound.parent.parallel or any(arrow.target == compound.id for arrow in arrows())


def _letter(history: HistoryState) -> str:
    return "H*" if history.type.value == "deep" else "H"


def _compound(state: State, depth: int) -> list[str]:
    indent = "    " * depth
    lines = [f"{indent}state {state.id} {{"]
    for child in state.states:
        if child.initial and _entered_by_itself(state):
            lines.append(f"{indent}    [*] --> {child.id}")
        if child.states:
            lines += _compound(child, depth + 1)
    lines += [f'{indent}    state "{_letter(history)}" as {history.id}' for history in state.history]
    for child in state.states:
        lines += [f"{indent}    {a.source} --> {a.target} : {a.label}" for a in _arrows_of(child, "")]
        if child.final:
            lines.append(f"{indent}    {child.id} --> [*]")
    lines.append(f"{indent}}}")
    return lines
