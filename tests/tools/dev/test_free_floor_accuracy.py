"""The measurement of the free floor: its truth agrees with the detector in a plain room."""

import numpy as np
import pytest

from nxtdrive.tools.dev.free_floor_accuracy import CONDITIONS, Ray, alike, free_ahead_mm, make_room, measure, row


def plain_room():
    """The first room whose textures differ from its floor's."""
    rooms = (make_room(number, 2, 5) for number in range(80))
    return next(one for one in rooms if (one.floor, one.wall, one.box) == ("carpet", "bricks", "green_box"))


def test_rooms_are_learned_from_where_no_echo_is_near():
    room = make_room(3, 2, 5)
    assert room == make_room(3, 2, 5)
    assert len(room.learned_from) == 10
    assert len(room.places) == 2
    assert all(free_ahead_mm(room.panels, place) > 700.0 for place in room.learned_from)


@pytest.mark.slow
@pytest.mark.parametrize(
    "condition",
    ["tilted by -10 deg", *(pytest.param(each, marks=pytest.mark.nightly) for each in ("plain", "640x480"))],
)
def test_in_a_plain_room_the_floor_ends_where_it_does(condition):
    rays = list(measure(plain_room(), CONDITIONS[condition], 1))
    errors = np.array([ray.error_px for ray in rays])
    assert len(rays) > 20
    assert abs(np.median(errors)) < 0.8
    assert (np.abs(errors) < 2.5).mean() > 0.9
    assert rays == list(measure(plain_room(), CONDITIONS[condition], 1))


def test_the_table_counts_what_is_right_too_far_and_too_near():
    seen = [150.0, 150.5, 149.5, 100.0, None]
    rays = [Ray("floor", "crate", 150.0, None, row_px, goes_on=False, tall=False) for row_px in seen]
    assert row("plain", rays) == "| plain | 5 | 80.0 % | -0.25 | 9.64 | 75.0 % | 25.0 % | 0.0 % |"
    assert next(iter(alike(rays))) == "crate on floor: 40 % of 5 rays overlook it, distinguished"
    assert row("plain", rays[4:]) == "| plain | 1 | 0 % | - | - | - | - | - |"


def test_the_remarks_count_the_results_at_what_looks_like_the_floor():
    results = [(99.0, False, False), (None, False, False), (99.0, False, True), (None, True, True)]
    rays = [Ray("floor", "crate", 150.0, None, *each) for each in results]
    rays += [Ray("floor", "red_box", 150.0, None, 150.0, goes_on=False, tall=True)] * 4
    *_, pairs, higher, lower, others = alike(rays)
    assert pairs == "1 of 2 pairs cannot be distinguished"
    assert higher == "of 2 rays to those higher than the lens 50 % end, 50 % go on above the horizon"
    assert lower == "of 2 rays to those lower than the lens 50 % end, 0 % go on above the horizon"
    assert others == "of 4 rays to others 0.0 % go on above the horizon"
