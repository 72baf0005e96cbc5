"""The adaptive profile is interrupted in each of its states: by Ctrl-C, and by a link that falls silent for a while.

The scenarios are those of the sweep. What the profile would choose hangs on its numbers, so an operator insists on one
recovery. When a mission comes into which state is looked up in an undisturbed run; up to the disturbance the disturbed
one is the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import pytest

from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import RecordKind
from behaviors.mission import Mission
from behaviors.operator import Ask, Question
from behaviors.recoveries import DETOUR, MOVE_TO, RECOVERIES, Choice
from nxtdrive.simulated.scenario import Scenario, generate_scenario
from nxtdrive.tools.sweep.task import run_episode
from sim_backend.link import LinkFaults

# one process looks up when a state is visited, and performs both of its tests
STATES = [
    pytest.param(state, marks=pytest.mark.xdist_group(f"interrupted {state}"))
    for state in ("search", "arrive", "wait", "move_to", "detour", "rescan")
]
SCENARIOS = tuple(product(("block_transient", "block_permanent"), range(100, 105)))
LIMIT_S = 30.0
LONG_S = 0.8
"""A visit this long is long enough to be interrupted in its middle, whatever opening the link took."""
SILENT_S, LEASE_S = 4.0, 1.0


@dataclass(frozen=True)
class Visit:
    """When a mission is in a state for some time.

    Attributes:
        scenario: What is performed.
        ask: Who insists on a recovery.
        middle_s: Half of the longest visit is over then.
    """

    scenario: Scenario
    ask: Ask | None
    middle_s: float


def _insisting_on(state: str) -> Ask | None:
    """An operator who chooses one recovery whenever it is possible; None for the states that are not recoveries."""
    if state not in RECOVERIES:
        return None
    wanted = RECOVERIES[state]

    def answer(question: Question) -> Choice:
        evidence = question.evidence
        ways = [each.route for each in (evidence.detour, *evidence.viewpoints) if each and each.route]
        if wanted not in (DETOUR, MOVE_TO):
            return Choice(wanted, "it was wished", wait_s=20.0)
        return Choice(wanted, "it was wished", route=ways[0]) if ways else question.proposed

    return answer


def _mission(scenario: Scenario, limit_s: float) -> Mission:
    table = scenario.mission.mission.model_copy(update={"profile": "adaptive", "time_limit_s": limit_s})
    return scenario.mission.model_copy(update={"mission": table})


@pytest.fixture(scope="module", name="known")
def _known() -> dict[str, Visit]:
    return {}


@pytest.fixture(name="visit")
def _visit(known: dict[str, Visit], perform: Callable[..., Any]) -> Callable[[str], Visit]:
    """Where and when a state is visited; performs scenarios until that is known."""

    def look_up(state: str) -> Visit:
        if state not in known:
            known[state] = next(visits(state), None) or pytest.fail(f"{state} is not visited in any scenario")
        return known[state]

    def visits(state: str) -> Iterator[Visit]:
        for kind, seed in SCENARIOS:
            scenario, ask = generate_scenario(kind, seed), _insisting_on(state)
            done = perform(scenario.world, _mission(scenario, LIMIT_S), geometric=True, ask=ask)
            begin_s, end_s = max(done.in_state(state), key=lambda span: span[1] - span[0], default=(0.0, 0.0))
            if end_s - begin_s >= LONG_S:
                yield Visit(scenario, ask, round((begin_s + end_s) / 2, 2))

    return look_up


def _stands_still(samples: list[Any]) -> bool:
    """Whether it neither drives nor turns."""
    poses = [pose for _, pose, _ in samples]
    return all(
        math.dist(pose[:2], poses[0][:2]) < 1.0 and abs(pose.heading_deg - poses[0].heading_deg) < 0.5 for pose in poses
    )


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES)
def test_ctrl_c_in_any_state_stops_the_motors(perform, visit, state):
    scenario, ask, moment_s = visit(state).scenario, visit(state).ask, visit(state).middle_s
    mission = _mission(scenario, LIMIT_S)
    done = perform(scenario.world, mission, geometric=True, ask=ask, interrupt_at_s=moment_s)
    assert done.report.ending is Ending.INTERRUPTED
    assert done.report.path[-2:] == [state, "finished"]
    assert done.records[-1].kind is RecordKind.END
    (trip,) = done.of(RecordKind.TRANSITION, reason=Reason.OPERATOR_STOP, event="trip")
    assert trip.time_s == pytest.approx(moment_s, abs=0.01)
    after = done.between(moment_s + 0.5, math.inf)
    assert len(after) > 5
    assert _stands_still(after)


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES)
def test_a_link_that_falls_silent_in_any_state_suspends_the_mission_which_then_continues(perform, visit, state):
    scenario, ask, moment_s = visit(state).scenario, visit(state).ask, visit(state).middle_s
    back_s = moment_s + SILENT_S
    faults = LinkFaults(silent_ms=((round(moment_s * 1000), round(back_s * 1000)),))
    done = perform(scenario.world, _mission(scenario, back_s + 10.0), geometric=True, ask=ask, faults=faults)
    suspended = done.of(RecordKind.TRANSITION, to="suspended")
    resumed = done.of(RecordKind.TRANSITION, event="resume")
    assert suspended
    assert moment_s <= suspended[0].time_s <= moment_s + 2.5
    assert len(resumed) == len(suspended)
    assert {record.state for record in resumed} == {state}, "it goes on where it was"
    assert _stands_still(done.between(moment_s + LEASE_S + 0.5, back_s - 0.1)), "the lease has stopped it"
    assert done.report.ending is not Ending.LINK_LOST
    assert any(record.time_s > back_s + 0.5 for record in done.of(RecordKind.LOOK))


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["block_transient", *(pytest.param(kind, marks=pytest.mark.nightly) for kind in ("block_permanent", "dim"))]
)
def test_the_same_seed_gives_the_same_journal(kind):
    journals = []
    for _ in range(2):
        scenario = generate_scenario(kind, 101)
        _, recorder = run_episode(replace(scenario, mission=_mission(scenario, 30.0)), "adaptive", "geometric")
        journals.append([record.to_json() for record in recorder.records])
    assert len(journals[0]) > 50
    assert journals[0] == journals[1]
