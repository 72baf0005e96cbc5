"""The policy on its own: evidence in, choice out."""

from __future__ import annotations

from patient import WAIT_S, Patient

from behaviors.events import Reason
from behaviors.evidence import Evidence
from behaviors.failures import Blocker
from behaviors.mission import Mission

MISSION = Mission.model_validate({"mission": {"targets": ["tag"]}, "target": {"tag": {"detector": "marker", "id": 7}}})
IN_THE_WAY = Blocker(range_mm=400.0)


def choice(**known):
    evidence = Evidence("tag", Reason.OBSTACLE_AHEAD, seen_since_search=True, researches=0, **known)
    return Patient.own_policy(MISSION).select(evidence)


def test_it_waits_for_what_is_in_the_way():
    assert choice(blocker=IN_THE_WAY).kind.name == "wait"
    assert choice(blocker=IN_THE_WAY).wait_s == WAIT_S


def test_it_waits_twice_at_one_place():
    assert choice(blocker=IN_THE_WAY, repeats={"wait": 1}).wait_s == WAIT_S
    assert choice(blocker=IN_THE_WAY, repeats={"wait": 2}).why != "people need time to leave"
