"""The adaptive profile is interrupted in each of its states: by Ctrl-C, and by a link that falls silent for a while.

The scenarios are those of the sweep. When a mission comes into which state hangs on the profile's numbers, so it is
looked up in an undisturbed run; up to the disturbance the disturbed one is the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import pytest

from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import Kind
from behaviors.mission import Mission
from nxtdrive.tools.sweep.performance import perform as perform_scenario
from nxtdrive.tools.sweep.scenarios import Scenario, draw_scenario
from sim_backend.link import LinkFaults

STATES = ("search", "arrive", "wait", "move_to", "detour", "rescan")
SCENARIOS = list(product(range(100, 105), ("block_permanent", "block_transient", "far")))
LIMIT_S = 75.0
LONG_S = 0.8
"""A visit this long is long enough to be interrupted in its middle, whatever opening the link took."""
SILENT_S, LEASE_S = 4.0, 1.0


@dataclass(frozen=True)
class Visit:
    """When a mission is in a state for some time."""

    scenario: Scenario
    middle_s: float


def _mission(scenario: Scenario, limit_s: float) -> Mission:
    table = scenario.mission.mission.model_copy(update={"profile": "adaptive", "time_limit_s": limit_s})
    return scenario.mission.model_copy(update={"mission": table})


class Lookup:
    """What is known so far of when which state is visited."""

    def __init__(self) -> None:
        self.visits: dict[str, Visit] = {}
        self.left = iter(SCENARIOS)

    def perform_next(self, perform: Callable[..., Any]) -> None:
        """Perform another scenario undisturbed, and keep each state's longest visit."""
        seed, kind = next(self.left, (None, None))
        assert kind, f"of all states only {', '.join(self.visits)} are visited in these scenarios"
        scenario = draw_scenario(kind, seed)
        done = perform(scenario.world, _mission(scenario, LIMIT_S), geometric=True)
        for state in STATES:
            spans = [(end_s - begin_s, begin_s, end_s) for begin_s, end_s in done.in_state(state)]
            if spans and max(spans)[0] >= LONG_S:
                _, begin_s, end_s = max(spans)
                self.visits.setdefault(state, Visit(scenario, round((begin_s + end_s) / 2, 2)))


@pytest.fixture(scope="module", name="lookup")
def _lookup() -> Lookup:
    return Lookup()


@pytest.fixture(name="visit")
def _visit(lookup: Lookup, perform: Callable[..., Any]) -> Callable[[str], Visit]:
    """Where and when a state is visited; performs scenarios until that is known."""

    def look_up(state: str) -> Visit:
        while state not in lookup.visits:
            lookup.perform_next(perform)
        return lookup.visits[state]

    return look_up


def _stands_still(samples: list[Any]) -> bool:
    """Whether it neither drives nor turns."""
    poses = [pose for _, pose, _ in samples]
    return all(
        math.dist(pose[:2], poses[0][:2]) < 1.0 and abs(pose.heading_deg - poses[0].heading_deg) < 0.5 for pose in poses
    )


@pytest.mark.parametrize("state", STATES)
def test_ctrl_c_in_any_state_stops_the_motors(perform, visit, state):
    scenario, moment_s = visit(state).scenario, visit(state).middle_s
    done = perform(scenario.world, _mission(scenario, LIMIT_S), geometric=True, interrupt_at_s=moment_s)
    assert done.report.ending is Ending.INTERRUPTED
    assert done.report.path[-2:] == [state, "finished"]
    assert done.records[-1].kind is Kind.END
    (trip,) = done.of(Kind.TRANSITION, reason=Reason.OPERATOR_STOP, event="trip")
    assert trip.time_s == pytest.approx(moment_s, abs=0.01)
    after = done.between(moment_s + 0.5, math.inf)
    assert len(after) > 5
    assert _stands_still(after)


@pytest.mark.parametrize("state", STATES)
def test_a_link_that_falls_silent_in_any_state_suspends_the_mission_which_then_goes_on(perform, visit, state):
    scenario, moment_s = visit(state).scenario, visit(state).middle_s
    back_s = moment_s + SILENT_S
    faults = LinkFaults(silent_ms=((round(moment_s * 1000), round(back_s * 1000)),))
    done = perform(scenario.world, _mission(scenario, back_s + 10.0), geometric=True, faults=faults)
    suspended = done.of(Kind.TRANSITION, to="suspended")
    resumed = done.of(Kind.TRANSITION, event="resume")
    assert suspended
    assert moment_s <= suspended[0].time_s <= moment_s + 2.5
    assert len(resumed) == len(suspended)
    assert {record.state for record in resumed} == {state}, "it goes on where it was"
    assert _stands_still(done.between(moment_s + LEASE_S + 0.5, back_s - 0.1)), "the lease has stopped it"
    assert done.report.ending is not Ending.LINK_LOST
    assert any(record.time_s > back_s + 0.5 for record in done.of(Kind.LOOK))


@pytest.mark.parametrize("kind", ["block_permanent", "block_transient", "dim"])
def test_the_same_seed_gives_the_same_journal(kind):
    journals = []
    for _ in range(2):
        scenario = draw_scenario(kind, 101)
        _, referee = perform_scenario(replace(scenario, mission=_mission(scenario, 45.0)), "adaptive", "geometric")
        journals.append([record.to_json() for record in referee.records])
    assert len(journals[0]) > 50
    assert journals[0] == journals[1]
