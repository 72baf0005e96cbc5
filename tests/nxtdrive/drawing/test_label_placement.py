"""No label covers another, and none leaves the picture, wherever the points are."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from nxtdrive.drawing.label_placement import overlap, place_boxes

FRAME = (50.0, 40.0, 650.0, 440.0)
SIZE = (32.0, 26.0)


def _scattered(number, seed, spread):
    """Points around the middle; far spread, many are at the edges and outside."""
    points = np.random.default_rng(seed).normal((350, 240), spread, (number, 2))
    return [(float(x), float(y)) for x, y in points]


@pytest.mark.parametrize("spread", [0.0, 2.0, 60.0, 400.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_boxes_neither_overlap_nor_leave_the_frame(seed, spread):
    points = _scattered(24, seed, spread)
    boxes = place_boxes(points, [SIZE] * len(points), FRAME, avoid=_scattered(200, seed, 80.0))
    assert all(box is not None for box in boxes)
    assert not any(overlap(one, other) for one, other in combinations(boxes, 2))
    assert all(FRAME[0] <= box[0] and FRAME[1] <= box[1] and box[2] <= FRAME[2] and box[3] <= FRAME[3] for box in boxes)


def test_boxes_without_room_are_left_out():
    boxes = place_boxes([(60.0, 50.0)] * 5, [SIZE] * 5, (50.0, 40.0, 50 + 2 * 34.0, 40 + 28.0))
    placed = [box for box in boxes if box]
    assert 1 <= len(placed) < 5
    assert not any(overlap(one, other) for one, other in combinations(placed, 2))


def test_a_box_stands_near_its_point_and_not_on_the_path():
    point, path = (300.0, 200.0), [(300.0 + i, 200.0) for i in range(0, 60, 2)]
    (box,) = place_boxes([point], [SIZE], FRAME, avoid=path)
    assert np.hypot((box[0] + box[2]) / 2 - 300, (box[1] + box[3]) / 2 - 200) < 60
    assert not any(box[0] < x < box[2] and box[1] < y < box[3] for x, y in path)


def test_taken_places_stay_free():
    taken = [(250.0, 150.0, 350.0, 250.0)]
    (box,) = place_boxes([(300.0, 200.0)], [SIZE], FRAME, taken=taken)
    assert not overlap(box, taken[0])
