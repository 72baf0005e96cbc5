"""Agreement between the sonar and the apparent size of a target."""

import pytest

from behaviors.plausibility import TOLERANCE_MM, contradicts


@pytest.mark.parametrize(
    ("range_mm", "distance_mm", "contradiction"),
    [
        (380.0, 420.0, False),
        (420.0 + TOLERANCE_MM, 420.0, False),
        (420.0 + TOLERANCE_MM + 1, 420.0, True),
        (1300.0, 130.0, True),
        (None, 130.0, False),
        (1350.0, 2000.0, False),
        (1300.0, 2000.0, True),
        (2700.0, 2000.0, True),
    ],
)
def test_an_echo_from_elsewhere_contradicts_the_distance_by_size(range_mm, distance_mm, contradiction):
    assert contradicts(range_mm, distance_mm) is contradiction


def test_a_mission_may_tolerate_more():
    assert not contradicts(1300.0, 420.0, tolerance_mm=1000.0)
