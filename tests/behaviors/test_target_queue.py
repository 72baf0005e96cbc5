"""The order of targets, and what a second round tries again."""

import pytest

from behaviors.target_queue import TargetOutcome, TargetQueue


def _decide(queue: TargetQueue, outcome: TargetOutcome) -> None:
    queue.decide(outcome)
    if queue.more_targets:
        queue.next_target()


def test_targets_come_in_order_and_end():
    queue = TargetQueue(["lena", "rilakkuma"])
    assert queue.target == "lena"
    _decide(queue, TargetOutcome.GIVEN_UP)
    assert queue.target == "rilakkuma"
    queue.decide(TargetOutcome.REACHED)
    assert not queue.more_targets
    assert not queue.achieved


def test_a_second_round_tries_only_what_was_given_up():
    queue = TargetQueue(["a", "b", "c"], rounds=2)
    for outcome in (TargetOutcome.GIVEN_UP, TargetOutcome.REACHED, TargetOutcome.GIVEN_UP):
        _decide(queue, outcome)
    assert queue.target == "a"
    _decide(queue, TargetOutcome.REACHED)
    assert queue.target == "c"
    queue.decide(TargetOutcome.REACHED)
    assert not queue.more_targets
    assert queue.achieved


def test_a_target_that_is_tried_again_is_no_longer_given_up():
    queue = TargetQueue(["a", "b"], rounds=2)
    _decide(queue, TargetOutcome.GIVEN_UP)
    _decide(queue, TargetOutcome.REACHED)
    assert [each.outcome for each in queue.targets] == [TargetOutcome.PENDING, TargetOutcome.REACHED]
    queue.decide(TargetOutcome.GIVEN_UP)
    assert queue.targets[0].outcome is TargetOutcome.GIVEN_UP


def test_the_last_round_is_the_last():
    queue = TargetQueue(["a"], rounds=2)
    _decide(queue, TargetOutcome.GIVEN_UP)
    queue.decide(TargetOutcome.GIVEN_UP)
    assert not queue.more_targets


def test_a_target_may_be_preferred_to_the_next_in_order():
    queue = TargetQueue(["a", "b", "c"], rounds=2)
    queue.decide(TargetOutcome.GIVEN_UP)
    queue.next_target("c")
    assert queue.target == "c"
    _decide(queue, TargetOutcome.GIVEN_UP)
    assert (queue.target, queue.round) == ("b", 1)
    _decide(queue, TargetOutcome.GIVEN_UP)
    assert (queue.target, queue.round) == ("a", 2)


def test_no_target_is_preferred_to_those_with_fewer_rounds():
    queue = TargetQueue(["a", "b", "c"], rounds=2)
    queue.decide(TargetOutcome.GIVEN_UP)
    queue.next_target()
    assert queue.target == "b"
    assert queue.earlier == ["c"]
    queue.decide(TargetOutcome.GIVEN_UP)
    queue.next_target("a")
    assert queue.target == "c"
    assert queue.earlier == []


def test_those_whose_turns_are_over_do_not_come_later():
    queue = TargetQueue(["a", "b", "c"], rounds=1)
    assert queue.later == ["b", "c"]
    _decide(queue, TargetOutcome.GIVEN_UP)
    assert queue.later == ["c"]


def test_no_other_target_comes_before_the_last_turn_of_a_target():
    queue = TargetQueue(["a", "b"], rounds=1)
    assert queue.earlier == []


def test_what_is_reached_is_not_preferred():
    queue = TargetQueue(["a", "b"], rounds=2)
    _decide(queue, TargetOutcome.REACHED)
    queue.decide(TargetOutcome.GIVEN_UP)
    queue.next_target("a")
    assert queue.target == "b"


def test_a_target_that_is_due_comes_before_its_next_round():
    queue = TargetQueue(["a", "b", "c"], rounds=3)
    queue.due = lambda name: name == "a"
    queue.next_target("b")
    assert queue.earlier == ["a", "c"]
    queue.next_target("a")
    assert (queue.target, queue.round) == ("a", 2)
    queue.next_target("c")
    queue.due = lambda _: False
    assert queue.earlier == []
    queue.next_target("a")
    assert queue.target == "b"


def test_neither_the_target_at_hand_nor_one_without_another_round_is_ever_due():
    queue = TargetQueue(["a", "b"], rounds=2)
    queue.due = lambda _: True
    assert queue.earlier == ["b"]
    queue.next_target()
    assert queue.target == "b"
    queue.next_target()
    queue.next_target()
    assert (queue.target, queue.round) == ("b", 2)
    assert not queue.more_targets


def test_a_profile_may_set_which_target_is_next():
    queue = TargetQueue(["a", "b", "c"], rounds=2)
    offered: list[list[str]] = []

    def last(names):
        offered.append(list(names))
        return names[-1]

    queue.first_of = last
    queue.decide(TargetOutcome.REACHED)
    queue.next_target()
    queue.next_target("b")
    queue.next_target()
    assert queue.target == "c"
    assert offered == [["b", "c"], ["b", "c"]]


def test_continuing_when_nothing_is_left_is_an_error():
    queue = TargetQueue(["a"])
    queue.decide(TargetOutcome.REACHED)
    with pytest.raises(IndexError):
        queue.next_target()


@pytest.mark.parametrize(
    ("first", "again", "whole"),
    [
        (TargetOutcome.REACHED, TargetOutcome.REACHED, TargetOutcome.REACHED),
        (TargetOutcome.GIVEN_UP, TargetOutcome.REACHED, TargetOutcome.GIVEN_UP),
        (TargetOutcome.REACHED, TargetOutcome.GIVEN_UP, TargetOutcome.GIVEN_UP),
    ],
)
def test_a_target_that_is_listed_twice_is_reached_if_it_was_each_time(first, again, whole):
    queue = TargetQueue(["a", "b", "a"])
    _decide(queue, first)
    _decide(queue, TargetOutcome.REACHED)
    queue.decide(again)
    assert queue.outcomes == {"a": whole, "b": TargetOutcome.REACHED}
