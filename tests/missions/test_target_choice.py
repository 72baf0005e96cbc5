"""Another target comes first when it can be had sooner, unless the mission wants them in order."""

from __future__ import annotations

from dataclasses import replace

import pytest

from behaviors.executive import Ending
from behaviors.journal import Kind
from behaviors.mission import Mission
from behaviors.recoveries import CHANGE_TARGET
from nxtdrive.simulated.scenario import Scenario, draw_scenario
from nxtdrive.tools.sweep.performance import perform

SCENARIO = draw_scenario("absent", 100)
"""The first target does not exist; the second is in view at the first look round."""


def _events(scenario: Scenario) -> tuple[Ending, list[tuple[str, str]]]:
    """How the mission ended, and in turn each (target, what happened): a choice, left for another one, or reached."""
    play, referee = perform(scenario, "adaptive", "geometric")
    events = []
    for record in referee.records:
        if record.kind is Kind.CHOICE:
            events.append((record.target, record.data.get("instead", record.data["choice"])))
        elif record.kind is Kind.TRANSITION and record.data["to"] == "reached":
            events.append((record.target, "reached"))
    return play.ending, events


def _in_order(mission: Mission) -> Mission:
    return mission.model_copy(update={"adaptive": mission.adaptive.model_copy(update={"in_order": True})})


@pytest.mark.slow
@pytest.mark.parametrize("in_order", [False, True])
def test_a_target_in_view_comes_before_one_that_is_not_found(in_order):
    first, second = SCENARIO.mission.mission.targets
    mission = _in_order(SCENARIO.mission) if in_order else SCENARIO.mission
    ending, events = _events(replace(SCENARIO, mission=mission))
    assert ending is not Ending.ACHIEVED
    left = (first, CHANGE_TARGET.name if in_order else second)
    assert events.index(left) < events.index((second, "reached"))
    assert (events[0] == left) != in_order
    # what does not exist is looked for again as long as there is time
    assert events[-1][0] == first
