"""How long to wait: at most twice the cost for an observer who knows when the obstacle leaves."""

from __future__ import annotations

import math
from random import Random

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from behaviors.adaptive.dwell_time import (
    COST_BOUND,
    LONGEST_S,
    NEGLIGIBLE_CHANCE,
    BlockerHypothesis,
    best_wait_s,
    cost_s,
    hypotheses,
)
from behaviors.failures import Blocker

ROUNDS_S = st.floats(0.1, 120.0)
AGES_S = st.floats(0.0, 600.0)
BLOCKERS = st.builds(Blocker, st.just(500.0), AGES_S, st.booleans(), st.booleans())
SLACK = 1e-6


@st.composite
def mixtures(draw: st.DrawFn) -> list[BlockerHypothesis]:
    """Any set of hypotheses, with weights that add up to 1."""
    stays_s = draw(st.lists(st.floats(0.2, 3600.0) | st.just(math.inf), min_size=1, max_size=5))
    shares = draw(st.lists(st.floats(0.01, 1.0), min_size=len(stays_s), max_size=len(stays_s)))
    return [BlockerHypothesis(stay_s, share / sum(shares)) for stay_s, share in zip(stays_s, shares, strict=True)]


def _ratio(kind: BlockerHypothesis, wait_s: float, round_s: float) -> float:
    return kind.cost_s(wait_s, round_s) / kind.foresight_s(round_s)


def _cost_s(leaves_s: float, wait_s: float, round_s: float) -> float:
    """What one try costs when the thing leaves at that time."""
    return leaves_s if leaves_s <= wait_s else wait_s + round_s


def _wait_s(round_s: float, age_s: float = 0.0, *, moving: bool) -> float:
    """The wait for something that hides the target."""
    return best_wait_s(hypotheses(Blocker(500.0, age_s, moving, hides=True)), round_s)


@given(mixture=mixtures(), round_s=ROUNDS_S)
def test_no_kind_of_thing_costs_more_than_twice_what_it_costs_with_foresight(mixture, round_s):
    """Beyond `LONGEST_S` the cap on a single wait may break the bound: going round is then paid after too short a
    wait, which costs at most (wait + round) / wait times that."""
    wait_s = best_wait_s(mixture, round_s)
    bound = max(COST_BOUND, 1.0 + round_s / LONGEST_S)
    assert all(_ratio(kind, wait_s, round_s) <= bound + SLACK for kind in mixture if kind.weight >= NEGLIGIBLE_CHANCE)


@given(blocker=BLOCKERS, round_s=st.floats(0.1, LONGEST_S))
def test_the_bound_holds_for_what_blockers_may_be_at_any_age(blocker, round_s):
    mixture = hypotheses(blocker)
    assert sum(kind.weight for kind in mixture) == pytest.approx(1.0)
    wait_s = best_wait_s(mixture, round_s)
    assert all(
        _ratio(kind, wait_s, round_s) <= COST_BOUND + SLACK for kind in mixture if kind.weight >= NEGLIGIBLE_CHANCE
    )


@given(round_s=st.floats(0.1, LONGEST_S), moving=st.booleans(), still_moving=st.booleans())
def test_deciding_again_after_a_wait_in_vain_keeps_the_bound(round_s, moving, still_moving):
    mixture = hypotheses(Blocker(500.0, 0.0, moving, hides=True))
    first_s = _wait_s(round_s, moving=moving)
    second_s = _wait_s(round_s, first_s, moving=still_moving)
    assert all(_ratio(kind, first_s + second_s, round_s) <= COST_BOUND + SLACK for kind in mixture)


@given(mixture=mixtures(), round_s=ROUNDS_S)
@example(mixture=[BlockerHypothesis(100.0, 1 / 6), BlockerHypothesis(5.0, 5 / 6)], round_s=73.0)
@example(mixture=[BlockerHypothesis(15.0, 0.94), BlockerHypothesis(math.inf, 0.06)], round_s=29.0)
def test_neither_going_at_once_nor_waiting_as_long_as_that_takes_costs_less(mixture, round_s):
    wait_s = best_wait_s(mixture, round_s)
    assert 0.0 <= wait_s <= LONGEST_S
    sound = all(kind.weight < NEGLIGIBLE_CHANCE or kind.stays_s == math.inf for kind in mixture)
    others = [min(round_s, LONGEST_S)] + [0.0] * sound
    assert all(cost_s(mixture, wait_s, round_s) <= cost_s(mixture, other_s, round_s) + SLACK for other_s in others)


@given(mixture=mixtures())
def test_without_a_way_round_it_waits_as_long_as_it_may_and_expects_a_finite_cost(mixture):
    assert best_wait_s(mixture, math.inf) == LONGEST_S
    assert 0.0 < cost_s(mixture, LONGEST_S, math.inf) < math.inf


@given(age_s=AGES_S, round_s=st.floats(0.1, LONGEST_S))
def test_what_can_be_looked_over_and_stands_still_is_not_waited_for(age_s, round_s):
    mixture = hypotheses(Blocker(500.0, age_s, moving=False, hides=False))
    assert best_wait_s(mixture, round_s) == 0.0
    assert cost_s(mixture, 0.0, round_s) == pytest.approx(round_s)


@given(age_s=AGES_S, hides=st.booleans())
def test_what_moves_is_most_likely_a_person_wherever_it_stands(age_s, hides):
    assert hypotheses(Blocker(500.0, age_s, moving=True, hides=hides)) == hypotheses(
        Blocker(500.0, age_s, moving=True, hides=True)
    )


@given(age_s=st.floats(0.0, 5.0), round_s=ROUNDS_S)
def test_what_moves_is_waited_for_at_least_as_long_as_what_stands_still(age_s, round_s):
    moving_s, still_s = (_wait_s(round_s, age_s, moving=moving) for moving in (True, False))
    assert moving_s >= still_s


def test_what_moves_is_waited_for_longer_when_the_path_round_is_long():
    assert _wait_s(25.0, moving=True) > _wait_s(25.0, moving=False) > 0.0


@given(moving=st.booleans(), ages_s=st.tuples(AGES_S, AGES_S))
def test_the_longer_something_stays_the_more_it_is_furniture(moving, ages_s):
    young, old = (hypotheses(Blocker(500.0, age_s, moving, hides=True)) for age_s in sorted(ages_s))
    assert old[-1].stays_s == math.inf
    assert old[-1].weight >= young[-1].weight - SLACK


def _leaves_s(random: Random, boxes: float) -> float:
    """When something leaves; people's stays as the sweep's scenarios draw them, see docs/evaluation.md."""
    if random.random() < boxes:
        return math.inf
    return random.uniform(2.0, 6.0) if random.random() < 0.5 else min(60.0, 4.0 + random.expovariate(1 / 18))


@pytest.mark.parametrize("round_s", [6.0, 12.0, 25.0])
@pytest.mark.parametrize("boxes", [0.0, 0.5, 0.8], ids=["people only", "half boxes", "mostly boxes"])
@pytest.mark.parametrize("moving", [True, False])
def test_on_average_it_is_within_twice_also_for_stays_that_are_not_exponential(boxes, round_s, moving):
    random = Random(f"{boxes}/{round_s}")
    wait_s = _wait_s(round_s, moving=moving)
    leave_s = [_leaves_s(random, boxes) for _ in range(20_000)]
    mean_s = sum(_cost_s(each, wait_s, round_s) for each in leave_s)
    assert mean_s < COST_BOUND * sum(min(each, round_s) for each in leave_s)
