"""What explanations say of measurements."""

import pytest

from behaviors.events import Reason
from behaviors.evidence import Detour, Evidence, Viewpoint
from behaviors.failures import Blocker
from nxtdrive.recording.wording import evidence_lines, measured_words, reason_words


@pytest.mark.parametrize(
    ("measured", "words"),
    [
        ({"looks": 12}, "12 looks"),
        ({"unseen_s": 2.0, "range_mm": 70.4, "touching": False}, "not seen for 2.0 s, sonar 70 mm"),
        ({"range_mm": None, "hides": True}, "hides the target"),
        ({"turned_deg": 12.3, "odds": 1.5}, "turned 12 deg, odds 1.5"),
        ({"rescan_s": 5.25}, "looked again for 5.2 s"),
        ({"range_mm": 70.4, "touched": True, "hides": False}, "sonar 70 mm, the robot touched it"),
        ({}, ""),
    ],
)
def test_measurements_are_written_without_names_of_the_journal(measured, words):
    assert measured_words(measured) == words


def test_chances_by_the_map_alone_are_distinguished_from_those_of_the_candidates():
    here, there = Viewpoint(0.0, 8.0, 0.0), Viewpoint(4.0, 8.0, 0.11)
    evidence = Evidence("lena", Reason.NEVER_SEEN, False, 0, spent_s=7.5, here=here, viewpoints=(there,))
    lines = list(evidence_lines(evidence))
    assert "another look from here: 8 s, 0% chance by the map alone" in lines
    assert "1 other place to look from: nearest in 4 s, at best 11% chance by the map alone" in lines
    assert lines[-1] == "the candidates' chances are corrected by the outcomes of earlier missions"
    assert "pursued for 8 s without a sighting that still counts" in lines
    assert "chance" not in " ".join(evidence_lines(Evidence("lena", Reason.NEVER_SEEN, False, 0)))


def test_a_reason_that_the_evidence_says_more_precisely_is_not_reported_twice():
    evidence = {"range_mm": 230.0, "too_near": True, "oblique": False}
    assert reason_words("target_lost", evidence) == "it is too near for the camera to see all of it"
    assert measured_words(evidence) == "sonar 230 mm"


@pytest.mark.parametrize(
    ("bearing_deg", "unknown_mm", "where", "around"),
    [
        (0.0, 0.0, "300 mm away, straight ahead", "takes 4 s longer"),
        (-85.4, 640.0, "300 mm away, 85° to the left", "takes 4 s longer and crosses 600 mm of unknown floor"),
    ],
)
def test_a_blocker_and_the_path_around_it_are_described(bearing_deg, unknown_mm, where, around):
    blocker = Blocker(300.0, 5.0, moving=True, hides=True, bearing_deg=bearing_deg)
    detour = Detour(4.0, ((0.0, 900.0),), unknown_mm)
    lines = list(evidence_lines(Evidence("lena", Reason.NO_WAY, True, 0, blocker=blocker, detour=detour)))
    assert f"in the way, {where}: known for 5 s, moves, hides the target" in lines
    assert f"a path around it {around}" in lines
