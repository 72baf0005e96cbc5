"""The adaptive rule, on plain evidence: what it chooses, what it never chooses, and that a journal replays it."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.chances import Chances
from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.events import Reason
from behaviors.evidence import AlternativeTarget, Detour, Evidence, Viewpoint, evidence_from
from behaviors.failures import Blocker
from behaviors.journal import plain
from behaviors.mission import AdaptiveParameters
from behaviors.recoveries import CHANGE_TARGET, DETOUR, MOVE_TO, RECOVERIES, RESCAN, WAIT, Choice

POLICY = AdaptivePolicy(chances=Chances({}))
"""The rule alone: a chance is that of the world model."""
ROUTE = ((300.0, 400.0), (900.0, 100.0))
LOW = Blocker(400.0, 0.0, moving=False, hides=False)
PERSON = Blocker(400.0, 0.0, moving=True, hides=True)
FURNITURE = Blocker(400.0, 300.0, moving=False, hides=True)
HERE, NOT_HERE = Viewpoint(0.0, 8.0, 0.6), Viewpoint(0.0, 8.0, 0.05)
GOOD, POOR = Viewpoint(6.0, 7.0, 0.5, ROUTE), Viewpoint(12.0, 7.0, 0.1, ((0.0, 900.0),))
NEAR, FAR = AlternativeTarget("rilakkuma", 8.0, 5.0, 0.9), AlternativeTarget("rilakkuma", 40.0, 5.0, 0.9)
LONG = 3600.0
"""A search that has lasted longer than any budget."""


def _evidence(**known: object) -> Evidence:
    return replace(Evidence("lena", Reason.NEVER_SEEN, seen_since_search=False, researches=0), **known)


def _blocked(blocker: Blocker, extra_s: float | None, unknown_mm: float = 0.0, **known: object) -> Evidence:
    detour = None if extra_s is None else Detour(extra_s, ROUTE, unknown_mm)
    return _evidence(reason=Reason.BLOCKED_SHORT, seen_since_search=True, blocker=blocker, detour=detour, **known)


@pytest.mark.parametrize(
    ("evidence", "kind"),
    [
        pytest.param(_blocked(LOW, 8.0), DETOUR, id="what can be looked over is gone round"),
        pytest.param(_blocked(FURNITURE, 20.0), DETOUR, id="what never left is gone round"),
        pytest.param(_blocked(PERSON, 2.0), DETOUR, id="a short way round is gone at once"),
        pytest.param(_blocked(PERSON, 25.0), WAIT, id="a person may leave sooner than a long detour takes"),
        pytest.param(_blocked(PERSON, None), WAIT, id="without a way round it waits"),
        pytest.param(_blocked(PERSON, 4.0, unknown_mm=600.0), WAIT, id="beside a person in a door there is a wall"),
        pytest.param(_blocked(LOW, 4.0, unknown_mm=600.0), DETOUR, id="beside furniture there is floor"),
        pytest.param(_blocked(PERSON, 25.0, targets_left=2, spent_s=LONG), WAIT, id="what was found is not given up"),
        pytest.param(_blocked(PERSON, 25.0, repeats={WAIT.name: 2}), DETOUR, id="waiting did not help twice"),
        pytest.param(
            _blocked(PERSON, 25.0, repeats={WAIT.name: 2, DETOUR.name: 2}, viewpoints=(GOOD,)),
            MOVE_TO,
            id="nothing led past it, so it is looked for from elsewhere",
        ),
        pytest.param(_evidence(here=HERE, viewpoints=(GOOD,)), RESCAN, id="it was probably missed here"),
        pytest.param(_evidence(here=NOT_HERE, viewpoints=(GOOD, POOR)), MOVE_TO, id="it is probably elsewhere"),
        pytest.param(
            _evidence(here=HERE, viewpoints=(POOR,), repeats={RESCAN.name: 2}),
            MOVE_TO,
            id="looking again did not help twice",
        ),
        pytest.param(_evidence(here=NOT_HERE), RESCAN, id="there is nowhere else to look from"),
        pytest.param(
            _evidence(here=HERE, viewpoints=(GOOD,), targets_left=2, spent_s=LONG),
            CHANGE_TARGET,
            id="the budget is spent and another target waits",
        ),
        pytest.param(
            _evidence(here=HERE, viewpoints=(GOOD,), targets_left=1, spent_s=LONG),
            RESCAN,
            id="the budget is spent but no other target waits",
        ),
        pytest.param(_evidence(), CHANGE_TARGET, id="nothing is left to do"),
        pytest.param(
            _evidence(here=NOT_HERE, viewpoints=(POOR,), targets_left=2, others=(NEAR,)),
            CHANGE_TARGET,
            id="another target can be had sooner",
        ),
        pytest.param(
            _evidence(here=NOT_HERE, viewpoints=(GOOD,), targets_left=2, others=(FAR,)),
            MOVE_TO,
            id="another target is farther than what a look costs",
        ),
        pytest.param(
            _evidence(here=NOT_HERE, viewpoints=(GOOD,), targets_left=2, others=(replace(NEAR, chance=0.1),)),
            MOVE_TO,
            id="another target has most likely gone",
        ),
        pytest.param(
            _blocked(PERSON, None, targets_left=2, others=(NEAR,)),
            CHANGE_TARGET,
            id="the way is shut, and that to another target is not",
        ),
        pytest.param(_blocked(LOW, 4.0, targets_left=2, others=(NEAR,)), DETOUR, id="going round takes less than that"),
        pytest.param(
            _blocked(PERSON, None, blocked=GOOD, viewpoints=(POOR,)),
            WAIT,
            id="the place beyond a person is worth the wait",
        ),
        pytest.param(
            _blocked(PERSON, None, blocked=POOR, viewpoints=(GOOD,)),
            MOVE_TO,
            id="another place promises more than the one beyond a person",
        ),
    ],
)
def test_what_is_chosen(evidence, kind):
    choice = POLICY.select(evidence)
    assert choice.kind is kind
    assert choice.why


def test_a_detour_is_justified_by_how_much_longer_than_the_straight_path_it_takes():
    choice = AdaptivePolicy().select(_blocked(LOW, 4.0))
    assert choice.kind is DETOUR
    assert "4 s longer" in choice.why


def test_it_moves_to_the_place_that_promises_most_for_its_time():
    for viewpoints in ((GOOD, POOR), (POOR, GOOD)):
        assert POLICY.select(_evidence(here=NOT_HERE, viewpoints=viewpoints)).route == ROUTE


def test_a_detour_goes_along_its_way_and_a_wait_has_its_time():
    assert POLICY.select(_blocked(LOW, 8.0)).route == ROUTE
    assert POLICY.select(_blocked(PERSON, 25.0)).wait_s > 0.0


def test_after_a_wait_for_a_way_to_a_place_comes_the_look_round_there():
    (plain_wait,) = POLICY.candidates(_blocked(PERSON, None))
    (wait,) = POLICY.candidates(_blocked(PERSON, None, blocked=GOOD))
    assert (wait.seconds, wait.chance) == (plain_wait.seconds, plain_wait.chance)
    assert wait.expected_s == pytest.approx(plain_wait.expected_s + GOOD.seconds / GOOD.chance)


def test_it_names_the_target_that_can_be_had_soonest():
    others = FAR, replace(NEAR, target="box"), replace(NEAR, target="fox", travel_s=9.0)
    assert POLICY.select(_evidence(others=others, targets_left=4)).instead == "box"


def test_a_fixed_wait_has_the_given_length():
    assert AdaptivePolicy(AdaptiveParameters(fixed_wait_s=15.0)).select(_blocked(PERSON, None)).wait_s == 15.0


def _thousandths(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers as the journal writes them."""
    return st.integers(round(low * 1000), round(high * 1000)).map(lambda value: value / 1000)


ROUTES = st.lists(st.tuples(*[_thousandths(-7000.0, 7000.0)] * 2), min_size=1, max_size=4).map(tuple)
TIMES_S = _thousandths(0.0, 120.0)
CHANCES = _thousandths(0.0, 1.0)
COUNTS = st.integers(0, 5)
EVIDENCE = st.builds(
    Evidence,
    target=st.sampled_from(["lena", "rilakkuma"]),
    reason=st.sampled_from(list(Reason)),
    seen_since_search=st.booleans(),
    researches=COUNTS,
    round=st.integers(1, 5),
    targets_left=st.integers(1, 3),
    spent_s=TIMES_S,
    blocker=st.none()
    | st.builds(Blocker, _thousandths(0.0, 2550.0), _thousandths(0.0, 300.0), st.booleans(), st.booleans()),
    detour=st.none() | st.builds(Detour, _thousandths(0.5, 120.0), ROUTES),
    blocked=st.none() | st.builds(Viewpoint, TIMES_S, _thousandths(1.0, 20.0), CHANCES, ROUTES),
    here=st.none() | st.builds(Viewpoint, TIMES_S, _thousandths(1.0, 20.0), CHANCES),
    viewpoints=st.lists(st.builds(Viewpoint, TIMES_S, _thousandths(1.0, 20.0), CHANCES, ROUTES), max_size=3).map(tuple),
    others=st.lists(st.builds(AlternativeTarget, st.just("rilakkuma"), TIMES_S, TIMES_S, CHANCES), max_size=1).map(
        tuple
    ),
    repeats=st.dictionaries(st.sampled_from(list(RECOVERIES)), COUNTS),
    failures=COUNTS,
    run=COUNTS,
)


def _is_new(choice: Choice, evidence: Evidence) -> bool:
    """Whether it has not been chosen twice here; a place that was tried from here is no option, so moving is new."""
    return bool(choice.kind is MOVE_TO and choice.route) or evidence.repeats.get(choice.kind, 0) < 2


@given(evidence=EVIDENCE)
def test_no_recovery_is_chosen_a_third_time_at_one_place(evidence):
    choice = POLICY.select(evidence)
    assert choice.kind is CHANGE_TARGET or _is_new(choice, evidence)


@given(evidence=EVIDENCE)
def test_the_second_recovery_after_one_kind_of_failure_leads_away_and_the_third_to_another_target(evidence):
    choice = POLICY.select(evidence)
    if evidence.failures >= 2 or evidence.run >= 3:
        assert choice.kind in (MOVE_TO, DETOUR, CHANGE_TARGET)
    if evidence.run >= 3:
        assert choice.kind is CHANGE_TARGET


@given(evidence=EVIDENCE)
def test_the_last_target_is_not_given_up_while_something_can_be_done(evidence):
    evidence = replace(evidence, targets_left=1, others=())
    given_up = POLICY.select(evidence).kind is CHANGE_TARGET
    assert given_up == (not POLICY.candidates(evidence))


@given(evidence=EVIDENCE)
def test_what_is_chosen_is_possible(evidence):
    choice = POLICY.select(evidence)
    match choice.kind.name:
        case "wait":
            assert evidence.blocker is not None
            assert choice.wait_s > 0.0
        case "detour":
            assert evidence.detour is not None
            assert choice.route == evidence.detour.route
        case "move_to":
            assert choice.route in [each.route for each in evidence.viewpoints]
        case "rescan":
            assert evidence.here is not None
        case _:
            assert not choice.route


@given(evidence=EVIDENCE)
def test_the_evidence_in_a_journal_leads_to_the_same_choice(evidence):
    line = json.dumps(plain(evidence.known()))
    read = evidence_from(evidence.target, json.loads(line))
    assert read == evidence
    assert POLICY.select(read) == POLICY.select(evidence)


@given(evidence=EVIDENCE)
def test_the_choice_depends_on_the_evidence_alone(evidence):
    assert (
        AdaptivePolicy(chances=Chances({})).select(evidence)
        == POLICY.select(evidence)
        == POLICY.select(replace(evidence))
    )
