"""The operator has the last word; choices and evidence can be read back from the journal."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.events import Reason
from behaviors.evidence import AlternativeTarget, Detour, Evidence, Viewpoint, evidence_from
from behaviors.failures import Blocker
from behaviors.journal import Record, RecordKind, plain
from behaviors.mission import ThesisParameters
from behaviors.operator import OPERATOR_CHOSE, ConfirmedPolicy, Question, question
from behaviors.recoveries import CHANGE_TARGET, DETOUR, MOVE_TO, RECOVERIES, WAIT, Choice, choice_from
from behaviors.thesis.policy import ThesisPolicy

ODD = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3) | st.just([]) | st.just({})
NUMBERS = st.integers(0, 10**6).map(lambda n: n / 1000)
POINTS = st.tuples(NUMBERS, NUMBERS)
ROUTES = st.lists(POINTS, max_size=3).map(tuple)
CHANCES = st.sampled_from([0.0, 0.25, 1.0])
VIEWPOINTS = st.builds(Viewpoint, NUMBERS, NUMBERS, CHANCES, ROUTES)
EVIDENCE = st.builds(
    Evidence,
    target=st.just("lena"),
    reason=st.sampled_from(Reason),
    seen_since_search=st.booleans(),
    researches=st.integers(0, 5),
    round=st.integers(1, 5),
    targets_left=st.integers(1, 3),
    spent_s=NUMBERS,
    blocker=st.none() | st.builds(Blocker, NUMBERS, NUMBERS, st.booleans(), st.booleans()),
    detour=st.none() | st.builds(Detour, NUMBERS, ROUTES),
    here=st.none() | VIEWPOINTS,
    viewpoints=st.lists(VIEWPOINTS, max_size=2).map(tuple),
    others=st.lists(
        st.builds(AlternativeTarget, st.sampled_from(["fox", "box"]), NUMBERS, NUMBERS, CHANCES), max_size=2
    ).map(tuple),
    repeats=st.dictionaries(st.sampled_from(list(RECOVERIES)), st.integers(1, 9)),
)
HEAD = ("t", "kind", "state", "target")
SIMPLE = st.builds(
    Choice, st.sampled_from(list(RECOVERIES.values())), st.text(), NUMBERS, NUMBERS, ROUTES, st.text(), st.booleans()
)
CHOICES = SIMPLE | st.builds(lambda choice, other: Choice(choice.kind, choice.why, proposed=other), SIMPLE, SIMPLE)

BLOCKED = Evidence(
    "lena",
    Reason.BLOCKED_SHORT,
    seen_since_search=True,
    researches=0,
    blocker=Blocker(300.0, 0.0, moving=True, hides=True),
    detour=Detour(20.0, ((500.0, 500.0),)),
)
UNSEEN = Evidence("lena", Reason.NEVER_SEEN, seen_since_search=False, researches=0)


def _journaled(value: object) -> dict:
    return json.loads(json.dumps(plain(value)))


@given(EVIDENCE)
def test_the_journal_keeps_all_of_the_evidence(evidence):
    assert evidence_from("lena", _journaled(evidence.known())) == evidence


@given(CHOICES)
def test_the_journal_keeps_all_of_a_choice(choice):
    assert choice_from(_journaled(choice.record())) == choice


@pytest.mark.parametrize(
    "known",
    [{}, {"reason": "never_seen"}, {"reason": "bored", "exist": True, "researches": 0}, {"here": 3}],
)
def test_anything_that_is_not_evidence_is_refused(known):
    with pytest.raises(ValueError, match="Evidence"):
        evidence_from("lena", known)


@given(
    st.sampled_from(RecordKind), st.dictionaries(st.text().filter(lambda key: key not in HEAD), st.text() | st.none())
)
def test_a_record_is_read_as_it_was_written(kind, data):
    record = Record(1.5, kind, "search", "lena", data)
    assert Record.from_json(record.to_json()) == record


@pytest.mark.parametrize("time_s", ["-0.001", "1.1e9", "1e308", "null", "1e999"])
def test_a_record_of_a_time_that_no_mission_has_is_refused(time_s):
    with pytest.raises(ValueError, match=r"time|record|finite"):
        Record.from_json(f'{{"t": {time_s}, "kind": "end", "state": "", "target": ""}}')


@given(st.text())
def test_a_line_of_anything_else_is_refused_with_a_reason(line):
    with pytest.raises(ValueError, match=r"."):
        Record.from_json(line)


@given(
    st.fixed_dictionaries(
        {
            "t": st.sampled_from([0, 1.5]) | ODD,
            "kind": st.sampled_from([kind.value for kind in RecordKind]) | ODD,
            "state": st.just("search") | ODD,
            "target": st.just("lena") | ODD,
        },
        optional={"choice": ODD},
    )
)
def test_a_record_with_odd_values_is_refused_or_read_as_it_was_written(values):
    try:
        record = Record.from_json(json.dumps(values))
    except ValueError:
        return
    assert record.values() == values
    assert {type(record.time_s), type(record.state), type(record.target)} == {float, str}


def test_the_thesiss_candidates_are_its_two_recoveries_and_another_target():
    due = question(ThesisPolicy(ThesisParameters(wait_s=3.0)), UNSEEN)
    assert [each.choice.kind for each in due.candidates] == [MOVE_TO, WAIT, CHANGE_TARGET]
    assert due.candidates[1].choice.wait_s == 3.0
    assert all(each.weighed is None for each in due.candidates)


def test_any_policy_that_lists_its_recoveries_offers_them():
    class Patient:
        def select(self, evidence):
            return self.recoveries()[0]

        def recoveries(self):
            return [Choice(WAIT, "people need their time", wait_s=20.0), Choice(DETOUR, "it does not leave")]

    assert [each.choice.kind for each in question(Patient(), UNSEEN).candidates] == [WAIT, DETOUR, CHANGE_TARGET]


def test_what_the_thesis_does_not_propose_claims_nothing_about_the_target():
    asked = question(ThesisPolicy(), UNSEEN)
    proposed, *others = (each.choice.why for each in asked.candidates)
    assert proposed == "the target was not recognised"
    assert set(others) == {"possible, though the profile does not propose it"}


def test_the_adaptive_candidates_come_with_what_is_expected_of_them_the_proposed_one_first():
    policy = AdaptivePolicy()
    due = question(policy, BLOCKED)
    assert due.candidates[0].choice == due.proposed == policy.select(BLOCKED)
    weighed = [each.weighed for each in due.candidates if each.weighed]
    assert {option.choice.kind for option in weighed} == {WAIT, DETOUR}
    assert due.candidates[-1].choice.kind is CHANGE_TARGET


def test_giving_up_is_offered_once():
    due = question(ThesisPolicy(), Evidence("lena", Reason.TARGET_LOST, seen_since_search=True, researches=2))
    kinds = [each.choice.kind for each in due.candidates]
    assert kinds == [CHANGE_TARGET, WAIT, MOVE_TO]


def test_a_confirmed_choice_is_the_policys_and_says_who_confirmed_it():
    choice = ConfirmedPolicy(ThesisPolicy(), lambda due: due.proposed).select(UNSEEN)
    assert choice.record() == {"choice": "move_to", "why": choice.why, "turn_deg": 90.0, "operator": True}
    assert choice.why == "the target was not recognised"


def test_an_overridden_choice_says_what_was_proposed():
    choice = ConfirmedPolicy(ThesisPolicy(), lambda due: due.candidates[1].choice).select(UNSEEN)
    assert (choice.kind, choice.why) == (WAIT, OPERATOR_CHOSE)
    assert choice.record()["operator"] is True
    assert choice.record()["proposed"]["choice"] == "move_to"


def test_without_an_operator_the_journal_has_nothing_new():
    assert "operator" not in ThesisPolicy().select(UNSEEN).record()


def test_an_operator_who_leaves_takes_the_mission_along():
    def leave(_: Question) -> Choice:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ConfirmedPolicy(ThesisPolicy(), leave).select(UNSEEN)
