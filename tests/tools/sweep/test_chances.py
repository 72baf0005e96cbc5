"""The chances of choices are compared with their outcomes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sweep_results import mission_result

from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.evidence import evidence_from
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.operator import candidates
from behaviors.recoveries import RECOVERIES
from nxtdrive.recording.predictions import Prediction, predictions
from nxtdrive.tools.sweep.calibration import calibration_error, error_of_true_chances, pairs, reliability
from nxtdrive.tools.sweep.tables import calibration_rows, chance_rows

MISSION = Mission.model_validate(
    {"mission": {"targets": ["a"]}, "target": {"a": {"detector": "color", "color": "red"}}}
)
SEEN = ("full_turn_without_sighting", {"here": {"travel_s": 0.0, "scan_s": 8.0, "chance": 0.25, "route": []}})


BLOCKED = (
    "blocked_short",
    {"blocker": {"range_mm": 300.0, "hides": True}, "detour": {"extra_s": 5.0, "route": [[0.0, 900.0]]}},
)


ELSEWHERE = ("uncertain", {**SEEN[1], "others": [{"target": "b", "travel_s": 3.0, "age_s": 3.0, "chance": 0.9}]})


KEYS = ("source", "to", "reason")


def _journal(*after, chosen="rescan", failure=SEEN):
    """A choice of the adaptive profile's own, with the transitions before and after; those to "b" are about it."""
    reason, known = failure
    evidence = {"reason": reason, "seen_since_search": False, "researches": 0, **known}
    weighed = candidates(AdaptivePolicy(MISSION.adaptive), evidence_from("a", evidence))
    data = next(each.choice.record() for each in weighed if each.choice.kind.name == chosen)
    choice = Record(1.0, RecordKind.CHOICE, "select", "a", {**data, "evidence": evidence})
    steps = [("search", "select", reason), ("select", RECOVERIES[chosen].states[0], ""), *after]
    moves = [
        Record(
            2.0 + i, RecordKind.TRANSITION, to, "".join(target) or "a", dict(zip(KEYS, (source, to, why), strict=True))
        )
        for i, (source, to, why, *target) in enumerate(steps)
    ]
    return [choice, *moves]


@pytest.mark.parametrize(
    ("after", "came_true"),
    [
        ([("rescan", "arrive", "sighted"), ("arrive", "reached", "within_reach")], [True]),
        ([("rescan", "arrive", "sighted"), ("arrive", "select", "target_lost")], [True]),
        ([("rescan", "arrive", "sighted"), ("arrive", "select", "full_turn_without_sighting")], [False]),
        ([("rescan", "search", ""), ("search", "select", "full_turn_without_sighting")], [False]),
        ([("rescan", "search", ""), ("search", "finished", "time_up")], []),
        ([("rescan", "search", "")], []),
    ],
)
def test_a_look_comes_true_when_it_shows_the_target_and_the_same_failure_does_not_follow(after, came_true):
    found = predictions(_journal(*after), "adaptive", MISSION)
    assert [each.came_true for each in found] == came_true
    assert all((each.choice, each.situation.split("/")[:2]) == ("rescan", ["rescan", "0.15"]) for each in found)
    assert predictions(_journal(*after), "random-walk", MISSION) == []


@pytest.mark.parametrize(
    ("after", "came_true"),
    [
        ([("detour", "arrive", "sighted"), ("arrive", "reached", "within_reach")], [True]),
        ([("detour", "search", "there"), ("search", "select", "never_seen")], [True]),
        ([("detour", "arrive", "sighted"), ("arrive", "select", "blocked_short")], [False]),
        ([("detour", "select", "no_way")], [False]),
        ([("detour", "search", "no_way"), ("search", "select", "never_seen")], [False]),
    ],
)
def test_a_detour_comes_true_when_it_leads_past_what_blocked_the_path(after, came_true):
    found = predictions(_journal(*after, chosen="detour", failure=BLOCKED), "adaptive", MISSION)
    assert [each.came_true for each in found] == came_true


@pytest.mark.parametrize(
    ("after", "came_true"),
    [
        ([("wait", "search", "waited"), ("search", "select", "never_seen")], [True]),
        ([("wait", "search", "way_clear"), ("search", "finished", "time_up")], [True]),
        ([("wait", "select", "blocked_long")], [False]),
        ([("wait", "finished", "time_up")], []),
    ],
)
def test_a_wait_comes_true_when_what_blocked_the_path_has_left(after, came_true):
    found = predictions(_journal(*after, chosen="wait", failure=BLOCKED), "adaptive", MISSION)
    assert [each.came_true for each in found] == came_true


@pytest.mark.parametrize(
    ("after", "came_true"),
    [
        ([("search", "arrive", "sighted", "b"), ("arrive", "reached", "within_reach", "b")], [True]),
        ([("search", "arrive", "sighted", "b"), ("arrive", "select", "target_lost", "b")], [True]),
        ([("search", "arrive", "sighted", "b"), ("arrive", "select", "uncertain", "b")], [False]),
        ([("search", "arrive", "sighted", "a"), ("arrive", "select", "target_lost", "a")], [False]),
        ([("search", "select", "never_seen", "b")], [False]),
        ([("search", "finished", "time_up", "b")], []),
    ],
)
def test_another_target_comes_true_when_it_is_seen_and_the_same_failure_does_not_follow(after, came_true):
    left = ("left", "search", "", "b")
    found = predictions(_journal(left, *after, chosen="change_target", failure=ELSEWHERE), "adaptive", MISSION)
    assert [each.came_true for each in found] == came_true


def test_a_choice_that_this_version_does_not_know_has_no_outcome():
    choice, *moves = _journal(("rescan", "select", "never_seen"))
    unknown = replace(choice, data={**choice.data, "choice": "dance"})
    assert predictions([unknown, *moves], "adaptive", MISSION) == []


def _results(chance, share, number=50):
    return [
        mission_result(chances=[Prediction("wait", "obstacle_ahead", chance, came_true=i < share * number)])
        for i in range(number)
    ]


def test_chances_that_are_true_have_no_error_and_others_what_they_are_wrong_by():
    assert calibration_error(_results(0.5, 0.5)).mean == pytest.approx(0.0, abs=1e-9)
    mixed = calibration_error([*_results(0.1, 0.4), *_results(0.9, 0.8)])
    assert mixed.mean == pytest.approx(0.2)
    assert mixed.low < 0.2 < mixed.high
    assert calibration_error([mission_result(agent="thesis")]).number == 0


@pytest.mark.parametrize("number", [50, 200, 800])
def test_even_true_chances_show_an_error_and_the_smaller_the_more_choices_there_are(number):
    # of one bin: the mean distance of a share from its chance
    expected = math.sqrt(2 / math.pi * 0.5 * 0.5 / number)
    assert error_of_true_chances(_results(0.5, 1.0, number)) == pytest.approx(expected, rel=0.1)
    assert math.isnan(error_of_true_chances([mission_result(agent="thesis")]))


def test_bins_hold_every_chance_from_none_to_certainty():
    bins = reliability(np.array([[0.0, 0.0], [0.05, 1.0], [0.1, 1.0], [1.0, 1.0]]))
    assert [(each.number, each.came_true) for each in bins] == [(2, 0.5), (1, 1.0), (1, 1.0)]
    assert len(pairs(_results(0.5, 0.5), "detour")) == 0


def test_tables_show_the_error_and_a_bar_for_each_bin():
    results = _results(0.25, 0.5)
    ((agent, error, true, wait, *_),) = calibration_rows(results)
    assert (agent, error[:5], wait) == ("adaptive", "0.250", "0.25 / 0.50 (50)")
    assert 0.03 < float(true) < 0.07
    ((*_, bar),) = chance_rows(results)
    assert bar == "#####|####..........."
