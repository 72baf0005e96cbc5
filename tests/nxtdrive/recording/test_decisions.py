"""Decisions read from a journal: which of the candidates was chosen."""

from __future__ import annotations

from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.journal import Record, RecordKind
from nxtdrive.recording.decisions import DecisionResult, decisions, replay, same, weighed_by

BEFORE = {
    "reason": "never_seen",
    "seen_since_search": False,
    "researches": 3,
    "here": {"travel_s": 0.0, "scan_s": 8.0, "chance": 0.03, "route": []},
    "others": [
        {"target": "box", "travel_s": 9.0, "age_s": 3.0, "chance": 0.9},
        {"target": "cup", "travel_s": 3.0, "age_s": 3.0, "chance": 0.9},
    ],
}


def _decision(**chosen):
    record = Record(1.0, RecordKind.CHOICE, "select", "lena", {"choice": "change_target", "why": "", **chosen})
    (decision,) = decisions([record])
    return decision


def _chosen(**chosen):
    decision = _decision(**chosen, evidence=BEFORE)
    return [each for each in weighed_by(AdaptivePolicy(), decision) if same(each.choice, decision.choice)]


def test_of_several_other_targets_the_chosen_one_is_found():
    (cup,) = _chosen(instead="cup")
    assert cup.choice.instead == "cup"
    assert cup.weighed.seconds == 3.0


def test_leaving_a_target_for_the_next_in_order_is_not_going_for_one_that_was_seen():
    (left,) = _chosen()
    assert left.choice.instead == ""
    assert left.weighed is None


def test_a_policy_that_goes_for_another_target_chooses_differently():
    policy = AdaptivePolicy()
    assert not replay(policy, _decision(instead="cup", evidence=BEFORE)).differs
    assert replay(policy, _decision(instead="box", evidence=BEFORE)).differs


def test_the_steps_of_an_outcome_are_the_states_until_the_next_failure_each_once():
    choice = Record(1.0, RecordKind.CHOICE, "select", "lena", {"choice": "move_to", "why": ""})
    moves = [
        ("search", "select", "never_seen"),
        ("select", "move_to", ""),
        ("move_to", "move_to", "path_renewed"),
        ("move_to", "search", "there"),
        ("search", "select", "never_seen"),
        ("select", "wait", ""),
    ]
    records = [
        Record(2.0 * i, RecordKind.TRANSITION, to, "lena", {"source": source, "to": to, "reason": reason})
        for i, (source, to, reason) in enumerate(moves, 1)
    ]
    (decision,) = decisions([choice, *records])
    assert decision.outcome.result is DecisionResult.FAILED
    assert decision.outcome.detail == "never_seen"
    steps = [(step.state, step.seconds, step.reason) for step in decision.outcome.steps]
    assert steps == [("move_to", 4.0, "there"), ("search", 2.0, "never_seen")]
