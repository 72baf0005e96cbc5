"""The thesis's rule."""

import json
import math

import numpy as np
import pytest

from behaviors.chart import MISSION_STATES
from behaviors.diagram import arrows
from behaviors.events import Reason
from behaviors.evidence import Evidence, evidence_from
from behaviors.journal import plain
from behaviors.recoveries import (
    CHANGE_TARGET,
    MOVE_TO,
    RECOVERIES,
    WAIT,
    Candidate,
    Choice,
    choice_from,
    recovery_in,
)
from behaviors.thesis.policy import ThesisPolicy


def _evidence(*, seen_since_search: bool, researches: int) -> Evidence:
    return Evidence("lena", Reason.TARGET_LOST, seen_since_search, researches)


@pytest.mark.parametrize("researches", [0, 1])
def test_seen_but_not_reached_waits_fifteen_seconds(researches):
    choice = ThesisPolicy().select(_evidence(seen_since_search=True, researches=researches))
    assert (choice.kind, choice.wait_s) == (WAIT, 15.0)


@pytest.mark.parametrize("researches", [0, 1])
def test_not_seen_turns_ninety_degrees_right_and_moves_on(researches):
    choice = ThesisPolicy().select(_evidence(seen_since_search=False, researches=researches))
    assert (choice.kind, choice.turn_deg) == (MOVE_TO, 90.0)


@pytest.mark.parametrize("seen_since_search", [True, False])
def test_after_two_researches_the_target_is_changed(seen_since_search):
    assert ThesisPolicy().select(_evidence(seen_since_search=seen_since_search, researches=2)).kind is CHANGE_TARGET


def test_journals_of_earlier_versions_are_understood():
    evidence = evidence_from("lena", {"reason": "target_lost", "exist": True, "researches": 1})
    assert evidence == Evidence("lena", Reason.TARGET_LOST, seen_since_search=True, researches=1)


@pytest.mark.parametrize("number", ["nan", "inf", math.nan])
@pytest.mark.parametrize(
    "place",
    [
        lambda number: {"spent_s": number},
        lambda number: {"here": {"travel_s": 1, "scan_s": 2, "chance": number}},
        lambda number: {"detour": {"extra_s": 1, "route": [[number, 0]]}},
    ],
)
def test_evidence_with_a_number_that_is_not_finite_is_none(number, place):
    with pytest.raises(ValueError, match="finite number"):
        evidence_from("lena", {"reason": "target_lost", "seen_since_search": True, "researches": 1, **place(number)})


@pytest.mark.parametrize("chance", [-0.001, 1.001, -7e18])
@pytest.mark.parametrize(
    "place",
    [
        lambda chance: {"here": {"travel_s": 1, "scan_s": 2, "chance": chance}},
        lambda chance: {"viewpoints": [{"travel_s": 1, "scan_s": 2, "chance": chance}]},
        lambda chance: {"others": [{"target": "rilakkuma", "travel_s": 1, "age_s": 2, "chance": chance}]},
    ],
)
def test_evidence_with_a_chance_that_is_none_is_none(chance, place):
    with pytest.raises(ValueError, match=r"equal to [01]"):
        evidence_from("lena", {"reason": "target_lost", "seen_since_search": True, "researches": 1, **place(chance)})


@pytest.mark.parametrize("recovery", RECOVERIES.values(), ids=RECOVERIES)
def test_every_recovery_has_one_transition_into_each_of_its_states(recovery):
    found = [arrow for arrow in arrows() if arrow.source == "select" and recovery_in(arrow.target) is recovery]
    assert [arrow.target for arrow in found] == list(recovery.states)
    assert {*recovery.states} <= {*MISSION_STATES}
    assert all(arrow.guard.startswith("chosen") for arrow in found)


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ((1200.0, -340.0), "1.2 m ahead, 0.3 m left of the start"),
        ((-30.0, 1500.0), "1.5 m right of the start"),
        ((-800.0, 0.0), "0.8 m behind the start"),
        ((3200.0, 0.0), "3.2 m ahead of the start"),
        ((-800.0, 400.0), "0.8 m behind, 0.4 m right of the start"),
        ((20.0, -49.0), "the start"),
    ],
)
def test_a_place_is_named_by_the_distances_that_count(place, words):
    assert Choice(MOVE_TO, "", route=(place,)).words() == f"look from {words}"


@pytest.mark.parametrize("route", [((1.0, 2.0, 3.0),), ((1.0,),), (("1", 2.0),), (math.nan, 0.0), ((0.0, math.inf),)])
def test_a_route_that_is_not_of_places_is_refused(route):
    with pytest.raises(TypeError, match="route must be places"):
        Choice(MOVE_TO, "test", route=route)


@pytest.mark.parametrize(("chance", "expected_s"), [(1.0, 10.0 + 6.0), (0.0, 10.0 + 40.0), (0.5, 10.0 + 3.0 + 20.0)])
def test_what_follows_success_and_failure_counts_by_its_chance(chance, expected_s):
    candidate = Candidate(Choice(WAIT, "test"), 10.0, chance, otherwise_s=40.0, then_s=6.0)
    assert candidate.expected_s == pytest.approx(expected_s)


def test_a_choice_with_numbers_of_numpy_can_be_written_into_the_journal():
    choice = Choice(MOVE_TO, "", wait_s=np.float32(1.5), turn_deg=np.int64(-30), route=((np.float64(1), np.int32(2)),))
    record = plain(choice.record())
    assert choice_from(json.loads(json.dumps(record))) == choice
