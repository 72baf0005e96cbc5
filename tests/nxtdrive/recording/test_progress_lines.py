"""The lines that `nxtdrive run` prints while a mission runs."""

from __future__ import annotations

import pytest

from behaviors.journal import Record, RecordKind
from nxtdrive.recording.progress_lines import ProgressLines


def _lines(*records: Record) -> list[str]:
    lines: list[str] = []
    progress = ProgressLines(lines.append)
    for record in records:
        progress(record)
    return lines


def _transition(source: str, to: str, event: str | None = None, reason: str = "", **evidence: object) -> Record:
    data = {"source": source, "to": to, "event": event}
    return Record(
        57.72, RecordKind.TRANSITION, to, "lena", data | ({"reason": reason, "evidence": evidence} if event else {})
    )


@pytest.mark.parametrize(
    ("sighting", "where"),
    [
        ({"bearing_deg": 5.26, "distance_mm": 2361.6}, " 2.4 m away, 5° to the right"),
        ({"bearing_deg": -21.7, "distance_mm": 940.0}, " 0.9 m away, 22° to the left"),
        ({"bearing_deg": -0.2, "distance_mm": 1646.2}, " 1.6 m away, straight ahead"),
        (None, ""),
    ],
)
def test_a_sighting_says_where(sighting, where):
    seen = _transition("search", "arrive", "target_seen", "sighted", sighting=sighting)
    assert _lines(seen) == [f"   57.7 s  lena seen{where}; driving to it"]


def test_a_failure_is_followed_by_what_is_done_about_it_and_why():
    choice = Record(
        57.72, RecordKind.CHOICE, "select", "lena", {"choice": "wait", "why": "it may leave", "wait_s": 15.0}
    )
    lines = _lines(choice, _transition("arrive", "select", "arrive_failed", "target_lost"))
    assert lines == [
        "   57.7 s  lena: it went out of view on the way there",
        "           -> wait up to 15.0 s: it may leave",
    ]


def test_a_choice_that_this_version_does_not_know_is_named_and_not_taken_for_the_one_before():
    records = []
    for choice in ("wait", "back_up"):
        data = {"choice": choice, "why": "it may help", "wait_s": 15.0}
        records += [Record(57.72, RecordKind.CHOICE, "arrive", "lena", data)]
        records += [_transition("arrive", "select", "arrive_failed", "target_lost")]
    assert [line.strip() for line in _lines(*records)][1::2] == [
        "-> wait up to 15.0 s: it may help",
        "-> back up: it may help",
    ]


@pytest.mark.parametrize(
    ("evidence", "says"),
    [
        ({"too_near": True}, "it is too near for the camera to see all of it"),
        ({"oblique": True}, "it is seen from too far to the side to be sure that it is the target"),
        ({"too_near": False, "oblique": False}, "it went out of view on the way there"),
    ],
)
def test_a_target_that_is_seen_in_part_is_not_reported_to_be_out_of_view(evidence, says):
    failed = _transition("verify", "select", "arrive_failed", "target_lost", **evidence)
    assert _lines(failed)[0] == f"   57.7 s  lena: {says}"


def test_targets_that_are_searched_for_and_reached_are_named():
    lines = _lines(
        _transition("idle", "search", "start", "mission_started"), _transition("arrive", "reached", "arrived")
    )
    assert lines == ["   57.7 s  searching for lena", "   57.7 s  lena reached"]


@pytest.mark.parametrize(
    ("transition", "says"),
    [
        (
            ("arrive", "verify", "doubted", "doubtful"),
            "lena: standing in front of it to make sure that it is the target",
        ),
        (("arrive", "retreat", "backing_off", "contact"), "backing off: it touched something"),
        (("detour", "retreat", "backing_off", "stalled"), "backing off: something holds its wheels"),
        (("select", "gave_up"), "lena given up after the last round"),
        (
            ("trusted", "distrusted", "map_distrusted", "no_way"),
            "the map shows no path past the obstacle; relying on camera and sonar for now",
        ),
    ],
)
def test_transitions_with_a_meaning_of_their_own_are_printed(transition, says):
    assert _lines(_transition(*transition)) == [f"   57.7 s  {says}"]


@pytest.mark.parametrize(
    "transition",
    [
        ("select", "left"),
        ("held", "held", "contact", "contact"),
        ("clear", "held", "obstacle", "obstacle_ahead"),
        ("detour", "detour", "replanned", "path_renewed"),
        ("seeing", "blind", "camera_lost", "camera_lost"),
        ("verify", "arrive", "moved_off", "out_of_reach"),
    ],
)
def test_transitions_that_other_lines_report_are_not_printed(transition):
    assert _lines(_transition(*transition)) == []


def test_a_wheel_that_slips_is_named():
    slips = _transition(
        "gripping", "slipping", "wheel_slips", "frames_turned", wheel="left", lost_share=0.4, slipped_s=0.0
    )
    grips = _transition(
        "slipping", "gripping", "wheel_grips", "frames_turned", wheel="left", lost_share=0.4, slipped_s=12.3
    )
    assert _lines(slips, grips) == [
        "   57.7 s  the left wheel slips; going by what the camera shows",
        "   57.7 s  the left wheel grips again after 12 s",
    ]


def test_wrong_wiring_says_what_to_change():
    lines = _lines(_transition("clear", "tripped", "trip", "wrong_wiring", error='What it saw fits left = "C".'))
    assert lines == ['   57.7 s  What it saw fits left = "C".']


def test_an_outage_says_what_happened_and_the_seconds_left():
    lines = _lines(
        _transition("up", "down", "link_lost", "link_lost", error="The brick has gone away."),
        Record(57.72, RecordKind.OUTAGE, "suspended", "lena", {"part": "link", "left_s": 60.0}),
        _transition("active", "suspended"),
        Record(62.8, RecordKind.OUTAGE, "suspended", "lena", {"part": "link", "left_s": 54.9}),
        _transition("down", "up", "link_back", "link_back", silent_s=6.2),
        _transition("suspended", "search", "resume", ""),
    )
    assert lines == [
        "   57.7 s  The brick has gone away.",
        "   57.7 s  suspended: the link to the brick is lost; waiting for 60 s more",
        "   62.8 s  suspended: the link to the brick is lost; waiting for 55 s more",
        "   57.7 s  the brick answers again after 6.2 s; continuing",
    ]


@pytest.mark.parametrize(
    ("data", "line"),
    [
        ({"answers": False, "error": "no cable"}, "continuing without the sonar: no cable"),
        ({"answers": True, "error": ""}, "the sonar answers again"),
    ],
)
def test_a_sensor_that_fails_or_works_again_is_named(data, line):
    assert _lines(Record(1.0, RecordKind.SENSOR, "search", "lena", {"sensor": "sonar", **data})) == [
        f"    1.0 s  {line}"
    ]


def test_an_approach_that_continues_adds_nothing_new():
    assert _lines(_transition("arrive", "arrive", "continued", "driving_on")) == []
