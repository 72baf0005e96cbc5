"""Detections and sightings drawn into frames."""

from dataclasses import replace

import numpy as np
import pytest

from behaviors.ports import Sighting
from nxtdrive.vision.annotate import CONFIRMED, UNCONFIRMED, annotate, caption
from nxtdrive.vision.detection import Detection

SIGHTING = Sighting("lena", -12.4, 1434.0, 0.9, 3.0, (100, 80, 60, 90))


def has(image, color):
    return bool((image == np.array(color)).all(axis=2).any())


def test_a_sighting_in_one_line():
    assert caption(SIGHTING) == "lena L 12° 1.43 m"


def test_the_frame_itself_stays_as_it_is():
    frame = np.full((240, 320, 3), 90, np.uint8)
    drawn = annotate(frame, SIGHTING, [Detection((10, 20, 30, 40), 0.5)], "arrive")
    assert (frame == 90).all()
    assert has(drawn, CONFIRMED)
    assert has(drawn, UNCONFIRMED)
    assert (drawn[200:] != 90).any()


def test_nothing_seen_draws_nothing():
    frame = np.full((240, 320, 3), 90, np.uint8)
    assert (annotate(frame, None) == frame).all()


def test_an_unconfirmed_detection_is_not_drawn_as_a_sighting():
    drawn = annotate(np.zeros((240, 320, 3), np.uint8), None, [Detection((100, 80, 60, 90), 0.9)])
    assert has(drawn, UNCONFIRMED)
    assert not has(drawn, CONFIRMED)


def test_what_reaches_beyond_the_frame_is_drawn_as_far_as_it_goes():
    quad = ((-40.0, -30.0), (500.0, -20.0), (510.0, 400.0), (-30.0, 410.0))
    sighting = Sighting("lena", 0.0, 200.0, 0.9, 3.0, (-40, -30, 550, 440))
    drawn = annotate(np.zeros((240, 320, 3), np.uint8), sighting, [Detection(sighting.box, 0.9, quad)], "x" * 200)
    assert drawn.shape == (240, 320, 3)


@pytest.mark.parametrize(("name", "wrong"), [("Bär", "B??r"), ("Bär", "Bar"), ("Αθήνα", "??????????")])
def test_names_keep_the_letters_of_their_alphabet(name, wrong):
    def drawn(target):
        return annotate(np.zeros((240, 320, 3), np.uint8), replace(SIGHTING, target=target))

    assert not np.array_equal(drawn(name), drawn(wrong))


def test_a_caption_at_the_right_edge_moves_to_the_left_until_it_is_whole():
    at_edge, inside = (
        annotate(np.zeros((240, 320, 3), np.uint8), replace(SIGHTING, box=(left, 80, 10, 90))) for left in (300, 40)
    )
    assert (at_edge[60:76] == 255).any(axis=2).sum() == (inside[60:76] == 255).any(axis=2).sum() > 0


def test_what_is_drawn_into_a_photograph_of_a_phone_is_about_as_large_as_in_a_smaller_copy():
    def shares(times):
        """Of the picture: the height of the caption, and the area of the outline."""
        sighting = replace(SIGHTING, box=tuple(times * side for side in SIGHTING.box))
        drawn = annotate(np.zeros((240 * times, 320 * times, 3), np.uint8), sighting)
        rows = np.flatnonzero((drawn == 255).all(axis=2).any(axis=1))
        return np.array([np.ptp(rows) / len(drawn), (drawn == np.array(CONFIRMED)).all(axis=2).mean()])

    assert (shares(12) > 0.6 * shares(3)).all()  # OpenCV draws a line of two pixels with three
