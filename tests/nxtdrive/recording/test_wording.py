"""What explanations say of measurements."""

import pytest

from nxtdrive.recording.wording import measured_words


@pytest.mark.parametrize(
    ("measured", "words"),
    [
        ({"looks": 12}, "12 looks"),
        ({"unseen_s": 2.0, "range_mm": 70.4, "touching": False}, "not seen for 2.0 s, sonar 70 mm"),
        ({"range_mm": None, "hides": True}, "hides the target"),
        ({"turned_deg": 12.3, "odds": 1.5}, "turned 12 deg, odds 1.5"),
        ({}, ""),
    ],
)
def test_measurements_are_written_without_names_of_the_journal(measured, words):
    assert measured_words(measured) == words
