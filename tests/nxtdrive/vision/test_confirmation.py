"""When a target counts as confirmed, and for how long."""

import pytest

from behaviors.ports import Sighting
from nxtdrive.vision.confirmation import Confirmation

FRAME_S = 0.1


def seen(bearing_deg=0.0, distance_mm=1000.0, *, bound=False):
    return Sighting("lena", bearing_deg, distance_mm, 0.9, 0.0, (0, 0, 10, 10), bound=bound)


def run(confirmation, frames):
    """The bearing of what was confirmed in each frame, or None."""
    results = (confirmation.update(i * FRAME_S, frame) for i, frame in enumerate(frames))
    return [result and result.bearing_deg for result in results]


def test_one_detection_is_not_enough():
    assert run(Confirmation(), [[seen()]]) == [None]


def test_the_second_agreeing_detection_confirms():
    assert run(Confirmation(), [[seen(4)], [seen(5)]]) == [None, 5]


def test_a_frame_without_detection_between_them_is_allowed():
    assert run(Confirmation(), [[seen(4)], [], [seen(5)]]) == [None, None, 5]


def test_two_frames_without_detection_start_over():
    assert run(Confirmation(), [[seen(4)], [], [], [seen(5)]]) == [None] * 4


@pytest.mark.parametrize("other", [seen(15), seen(-15), seen(0, 1500), seen(0, 600)])
def test_detections_in_different_places_do_not_confirm(other):
    assert run(Confirmation(), [[seen()], [other]]) == [None, None]


@pytest.mark.parametrize(("far_is_cut_off", "near_is_cut_off"), [(True, False), (False, True)])
def test_what_is_cut_off_may_be_nearer_than_it_looks_but_not_farther_away(far_is_cut_off, near_is_cut_off):
    far, near = seen(0, 1500, bound=far_is_cut_off), seen(0, 1000, bound=near_is_cut_off)
    for frames in ([[far], [near]], [[near], [far]]):
        assert (run(Confirmation(), frames)[1] is not None) is far_is_cut_off


@pytest.mark.parametrize(("pause_s", "confirmed"), [(0.1, True), (1.9, True), (2.1, False)])
def test_only_recent_detections_confirm_at_any_time_of_a_mission(pause_s, confirmed):
    confirmation = Confirmation()
    confirmation.update(300.0, [seen()])
    assert (confirmation.update(300.0 + pause_s, [seen()]) is not None) is confirmed


def test_a_flickering_false_alarm_beside_a_steady_target_is_passed_over():
    frames = [[seen(20), seen(1)], [seen(-12), seen(2)], [seen(-25), seen(3)]]
    assert run(Confirmation(), frames) == [None, 2, 3]


def test_once_confirmed_drop_outs_lose_nothing():
    assert run(Confirmation(), [[seen()], [seen()], [], [], [], [], [seen(3)]]) == [None, 0, None, None, None, None, 3]


def test_once_confirmed_it_stays_with_its_place_though_another_scores_better():
    assert run(Confirmation(), [[seen()], [seen()], [seen(25), seen(1)]]) == [None, 0, 1]


def test_a_sighting_elsewhere_must_be_confirmed_anew():
    assert run(Confirmation(), [[seen()], [seen()], [seen(25)], [seen(25)]]) == [None, 0, None, 25]


def test_after_its_memory_it_must_be_confirmed_anew():
    confirmation = Confirmation()
    run(confirmation, [[seen()], [seen()]])
    assert confirmation.track(2.0) is not None
    assert confirmation.track(2.2) is None
    assert confirmation.update(2.2, [seen()]) is None


def test_it_follows_a_target_that_moves_slowly():
    frames = [[seen(5 * i, 2000 - 100 * i)] for i in range(12)]
    assert run(Confirmation(), frames) == [None, *(5 * i for i in range(1, 12))]
