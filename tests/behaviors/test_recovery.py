"""The thesis's rule."""

import pytest

from behaviors.events import Reason
from behaviors.recovery import Evidence, Recovery, ThesisPolicy


def _evidence(*, exist: bool, researches: int) -> Evidence:
    return Evidence("lena", Reason.TARGET_LOST, exist, researches)


@pytest.mark.parametrize("researches", [0, 1])
def test_seen_but_not_reached_waits_fifteen_seconds(researches):
    choice = ThesisPolicy().select(_evidence(exist=True, researches=researches))
    assert (choice.kind, choice.wait_s) == (Recovery.WAIT, 15.0)


@pytest.mark.parametrize("researches", [0, 1])
def test_not_seen_turns_ninety_degrees_right_and_moves_on(researches):
    choice = ThesisPolicy().select(_evidence(exist=False, researches=researches))
    assert (choice.kind, choice.turn_deg) == (Recovery.MOVE_TO, 90.0)


@pytest.mark.parametrize("exist", [True, False])
def test_after_two_researches_the_target_is_changed(exist):
    assert ThesisPolicy().select(_evidence(exist=exist, researches=2)).kind is Recovery.CHANGE_TARGET
