"""The order of targets, and what a second round tries again."""

import pytest

from behaviors.agenda import Agenda, Fate


def _decide(agenda: Agenda, fate: Fate) -> None:
    agenda.decide(fate)
    if agenda.more_targets:
        agenda.next_target()


def test_targets_come_in_order_and_end():
    agenda = Agenda(["lena", "rilakkuma"])
    assert agenda.target == "lena"
    _decide(agenda, Fate.GIVEN_UP)
    assert agenda.target == "rilakkuma"
    agenda.decide(Fate.REACHED)
    assert not agenda.more_targets
    assert not agenda.achieved


def test_a_second_round_tries_only_what_was_given_up():
    agenda = Agenda(["a", "b", "c"], rounds=2)
    for fate in (Fate.GIVEN_UP, Fate.REACHED, Fate.GIVEN_UP):
        _decide(agenda, fate)
    assert agenda.target == "a"
    _decide(agenda, Fate.REACHED)
    assert agenda.target == "c"
    agenda.decide(Fate.REACHED)
    assert not agenda.more_targets
    assert agenda.achieved


def test_the_last_round_is_the_last():
    agenda = Agenda(["a"], rounds=2)
    _decide(agenda, Fate.GIVEN_UP)
    agenda.decide(Fate.GIVEN_UP)
    assert not agenda.more_targets


def test_a_target_may_be_preferred_to_the_next_in_order():
    agenda = Agenda(["a", "b", "c"], rounds=2)
    agenda.decide(Fate.GIVEN_UP)
    agenda.next_target("c")
    assert agenda.target == "c"
    _decide(agenda, Fate.GIVEN_UP)
    assert (agenda.target, agenda.round) == ("b", 1)
    _decide(agenda, Fate.GIVEN_UP)
    assert (agenda.target, agenda.round) == ("a", 2)


def test_nobody_is_preferred_to_those_whose_turn_has_come_less_often():
    agenda = Agenda(["a", "b", "c"], rounds=2)
    agenda.decide(Fate.GIVEN_UP)
    agenda.next_target()
    assert agenda.target == "b"
    assert agenda.earlier == ["c"]
    agenda.decide(Fate.GIVEN_UP)
    agenda.next_target("a")
    assert agenda.target == "c"
    assert agenda.earlier == []


def test_those_whose_turns_are_over_do_not_come_later():
    agenda = Agenda(["a", "b", "c"], rounds=1)
    assert agenda.later == ["b", "c"]
    _decide(agenda, Fate.GIVEN_UP)
    assert agenda.later == ["c"]


def test_nobody_comes_before_the_last_turn_of_a_target():
    agenda = Agenda(["a", "b"], rounds=1)
    assert agenda.earlier == []


def test_what_is_reached_is_not_preferred():
    agenda = Agenda(["a", "b"], rounds=2)
    _decide(agenda, Fate.REACHED)
    agenda.decide(Fate.GIVEN_UP)
    agenda.next_target("a")
    assert agenda.target == "b"


def test_going_on_when_nothing_is_left_is_an_error():
    agenda = Agenda(["a"])
    agenda.decide(Fate.REACHED)
    with pytest.raises(IndexError):
        agenda.next_target()
