"""Another target comes first when it can be reached sooner, unless the mission asks for them in order."""

from __future__ import annotations

from dataclasses import replace

import pytest

from behaviors.executive import Ending
from behaviors.journal import RecordKind
from behaviors.mission import Mission
from behaviors.recoveries import CHANGE_TARGET
from nxtdrive.simulated.scenario import Scenario, generate_scenario
from nxtdrive.tools.sweep.task import run_episode

SCENARIO = generate_scenario("absent", 100)
"""The first target does not exist; the second is in view at the first scan."""
TIME_LIMIT_S = 80.0
"""After the second target is reached, in either order, and the first is looked for again."""


def _events(scenario: Scenario) -> tuple[Ending, list[tuple[str, str]]]:
    """How the mission ended, and in turn each (target, what happened): a choice, left for another one, or reached."""
    trace, recorder = run_episode(scenario, "adaptive", "geometric")
    events = []
    for record in recorder.records:
        if record.kind is RecordKind.CHOICE:
            events.append((record.target, record.data.get("instead", record.data["choice"])))
        elif record.kind is RecordKind.TRANSITION and record.data["to"] == "reached":
            events.append((record.target, "reached"))
    return trace.ending, events


def _mission(mission: Mission, in_order: bool) -> Mission:
    adaptive = mission.adaptive.model_copy(update={"in_order": in_order})
    table = mission.mission.model_copy(update={"time_limit_s": TIME_LIMIT_S})
    return mission.model_copy(update={"adaptive": adaptive, "mission": table})


@pytest.mark.slow
@pytest.mark.parametrize("in_order", [pytest.param(False, marks=pytest.mark.nightly), True])
def test_a_target_in_view_comes_before_one_that_is_not_found(in_order):
    first, second = SCENARIO.mission.mission.targets
    ending, events = _events(replace(SCENARIO, mission=_mission(SCENARIO.mission, in_order)))
    assert ending is Ending.TIME_UP
    left = (first, CHANGE_TARGET.name if in_order else second)
    assert events.index(left) < events.index((second, "reached"))
    assert (events[0] == left) != in_order
    # what does not exist is looked for again as long as there is time
    assert events[-1][0] == first


@pytest.mark.slow
def test_a_target_that_was_left_before_it_was_ever_seen_comes_next_once_it_is_seen():
    scenario = generate_scenario("flat", 16900)
    first, second, near = scenario.mission.mission.targets
    _, events = _events(scenario)
    left, back = events.index((first, near)), events.index((second, first))
    assert left < events.index((near, "reached")) < back
    assert events[back + 1] == (first, "reached")


@pytest.mark.slow
@pytest.mark.parametrize("in_order", [False, True])
def test_after_an_arrival_a_target_that_was_seen_comes_before_one_that_was_not(in_order):
    scenario = generate_scenario("hurry", 16907)
    near, unseen, seen = scenario.mission.mission.targets
    _, events = _events(replace(scenario, mission=_mission(scenario.mission, in_order)))
    reached = [target for target, event in events if event == "reached"]
    assert reached == ([near, unseen, seen] if in_order else [near, seen, unseen])
