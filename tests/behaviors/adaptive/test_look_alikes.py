"""Detections that are not taken for a target, and those that may be it in poor light."""

from __future__ import annotations

import pytest

from behaviors.adaptive.look_alikes import REJECTED_S, LookAlikes
from behaviors.ports import Sighting

PLACE, BESIDE, ELSEWHERE = (1000.0, 0.0), (1200.0, 0.0), (1000.0, 900.0)
BOX = (100, 80, 40, 60)


def _sighting(target="fox", distance_mm=1000.0, *, time_s=1.0, box=BOX):
    return Sighting(target, 0.0, distance_mm, 1.0, time_s, box)


@pytest.mark.parametrize("doubtful", [False, True])
def test_a_look_alike_is_rejected_for_some_time_and_only_for_its_target(doubtful):
    look_alikes = LookAlikes()
    look_alikes.reject("fox", PLACE, 5.0, doubtful=doubtful)
    assert look_alikes.rejected("fox", BESIDE, 6.0)
    assert not look_alikes.rejected("fox", ELSEWHERE, 6.0)
    assert not look_alikes.rejected("lena", PLACE, 6.0)
    assert not look_alikes.rejected("fox", PLACE, 5.1 + REJECTED_S)


def test_a_doubtful_one_may_be_the_target_after_looks_from_several_places():
    look_alikes = LookAlikes()
    look_alikes.seen(_sighting(), PLACE)
    look_alikes.seen(_sighting(), ELSEWHERE)
    look_alikes.reject("fox", PLACE, 0.0, doubtful=True)
    assert look_alikes.looked_round("fox", (0.0, 0.0)) is None
    assert look_alikes.looked_round("fox", (100.0, 0.0)) is None, "from the same place"
    assert not look_alikes.accepts("fox", PLACE)
    assert look_alikes.looked_round("fox", (800.0, 0.0)) == PLACE
    assert look_alikes.accepts("fox", BESIDE)
    assert not look_alikes.rejected("fox", PLACE, 1.0)


def test_one_look_round_is_enough_where_nothing_else_was_taken_for_the_target():
    look_alikes = LookAlikes()
    look_alikes.seen(_sighting(), PLACE)
    look_alikes.seen(_sighting(), BESIDE)
    look_alikes.seen(_sighting(distance_mm=4000.0), (1500.0, 0.0))  # as exact as a sighting from there can be
    look_alikes.reject("fox", PLACE, 0.0, doubtful=True)
    assert look_alikes.rejected("fox", PLACE, 1.0)
    assert look_alikes.looked_round("fox", (0.0, 0.0)) == PLACE
    assert look_alikes.accepts("fox", PLACE)


def test_a_look_alike_that_was_clearly_none_stays_rejected_however_often_it_is_looked_for():
    look_alikes = LookAlikes()
    look_alikes.reject("fox", PLACE, 0.0, doubtful=False)
    for i in range(10):
        assert look_alikes.looked_round("fox", (1000.0 * i, 0.0)) is None
    assert look_alikes.rejected("fox", PLACE, 1.0)
    assert not look_alikes.accepts("fox", PLACE)


def test_an_unsteady_arrival_at_one_target_counts_for_the_others():
    look_alikes = LookAlikes()
    look_alikes.arrived(steady=False)
    look_alikes.seen(_sighting("lena"), PLACE)
    assert look_alikes.accepts("lena", PLACE), "in poor light no target is found steadily"
    look_alikes.seen(_sighting("lena"), ELSEWHERE)
    assert not look_alikes.accepts("lena", PLACE), "but one of two things is a look-alike"
    look_alikes.arrived(steady=True)
    assert not look_alikes.accepts("lena", PLACE)
    look_alikes.arrived(steady=False)
    assert not look_alikes.accepts("lena", PLACE)


def test_what_one_frame_shows_as_two_targets_is_not_taken_for_either_unless_it_is_found_steadily():
    look_alikes = LookAlikes()
    look_alikes.arrived(steady=False)
    look_alikes.seen(_sighting("fox"), PLACE)
    look_alikes.seen(_sighting("lena", box=(95, 85, 44, 58)), BESIDE)
    assert not look_alikes.accepts("fox", PLACE)
    assert not look_alikes.accepts("lena", PLACE)


@pytest.mark.parametrize(
    "other",
    [{"time_s": 2.0}, {"box": (145, 80, 40, 60)}, {"box": (100, 145, 40, 60)}],
    ids=["later", "beside", "below"],
)
def test_targets_side_by_side_or_in_different_frames_are_two_things(other):
    look_alikes = LookAlikes()
    look_alikes.arrived(steady=False)
    look_alikes.seen(_sighting("fox"), PLACE)
    look_alikes.seen(_sighting("lena", **other), PLACE)
    assert look_alikes.accepts("fox", PLACE)
    assert look_alikes.accepts("lena", PLACE)
