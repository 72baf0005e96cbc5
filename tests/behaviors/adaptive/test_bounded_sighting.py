"""Estimates of a target whose size is not in view."""

import pytest

from behaviors.adaptive.bounded_sighting import estimated
from behaviors.ports import Cut, Sighting


def _sighting(cut, bearing_deg=0.0, distance_mm=480.0, *, bound=True):
    return Sighting("box", bearing_deg, distance_mm, 1.0, 0.0, (100, 180, 120, 60), cut, bound)


def _place(sighting):
    return sighting.bearing_deg, sighting.distance_mm, sighting.bound


def test_a_measured_sighting_is_believed():
    sighting = _sighting(Cut.BOTTOM, bound=False)
    assert estimated(sighting, 200.0, (5.0, 300.0)) is sighting


def test_the_echo_is_of_what_continues_below_the_frame():
    assert _place(estimated(_sighting(Cut.BOTTOM), 250.0, None)) == (0.0, 250.0, False)
    assert _place(estimated(_sighting(Cut.BOTTOM), 250.0, (0.0, 400.0))) == (0.0, 250.0, False)


@pytest.mark.parametrize(
    ("cut", "bearing_deg", "echo_ahead_mm"),
    [(Cut.TOP, 0.0, 250.0), (Cut.BOTTOM | Cut.LEFT, -25.0, 250.0), (Cut.BOTTOM, 0.0, None)],
)
def test_without_an_echo_of_it_a_target_never_seen_whole_stays_bounded(cut, bearing_deg, echo_ahead_mm):
    assert _place(estimated(_sighting(cut, bearing_deg), echo_ahead_mm, None)) == (bearing_deg, 480.0, True)


def test_an_echo_from_behind_does_not_move_it_away():
    assert estimated(_sighting(Cut.BOTTOM), 900.0, None).distance_mm == 480.0


@pytest.mark.parametrize(("remembered_mm", "believed_mm"), [(300.0, 300.0), (700.0, 480.0)])
def test_it_is_where_it_was_unless_it_must_be_nearer(remembered_mm, believed_mm):
    assert _place(estimated(_sighting(Cut.TOP), None, (0.0, remembered_mm))) == (0.0, believed_mm, False)


@pytest.mark.parametrize(
    ("cut", "remembered_deg", "believed_deg"),
    [
        (Cut.BOTTOM | Cut.LEFT, -32.0, -32.0),
        (Cut.BOTTOM | Cut.LEFT, -10.0, -25.0),
        (Cut.BOTTOM | Cut.RIGHT, -32.0, -25.0),
        (Cut.BOTTOM | Cut.RIGHT, -10.0, -10.0),
        (Cut.BOTTOM, -32.0, -25.0),
    ],
)
def test_its_middle_may_be_farther_out_only_where_it_is_cut_off(cut, remembered_deg, believed_deg):
    assert estimated(_sighting(cut, -25.0), None, (remembered_deg, 400.0)).bearing_deg == believed_deg
