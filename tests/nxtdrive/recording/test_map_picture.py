"""The map of a run, its legend and its notes, for runs of every kind."""

from __future__ import annotations

import math
import random
from itertools import combinations
from typing import ClassVar

import numpy as np
import pytest

from behaviors.evidence import Evidence
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.recoveries import RECOVERIES, WAIT, Choice
from nxtdrive.drawing.floor_view import FloorView
from nxtdrive.drawing.label_placement import overlap
from nxtdrive.drawing.page import place_tags
from nxtdrive.drawing.sheet import Sheet
from nxtdrive.mission.files import read_mission_file
from nxtdrive.recording.map.events import LAST, MAX_NUMBERS, numbering
from nxtdrive.recording.map.map_drawing import draw_map, map_page
from nxtdrive.recording.map.scene import gather
from nxtdrive.recording.map.style import PATHS
from nxtdrive.recording.progress_lines import ProgressLines
from tests.small_mission import with_table

SIGHTING = {"bearing_deg": 90.0, "distance_mm": 1000.0, "confidence": 1.0, "box": [0, 0, 10, 10]}
START = Record(
    0.0, RecordKind.START, "search", "lena", {"format": 2, "mission": "find Bär, Αθήνα, Жук", "targets": ["lena"]}
)
END = Record(
    90.0, RecordKind.END, "finished", "lena", {"ending": "achieved", "targets": {"lena": "reached"}, "error": ""}
)


def _look(time_s, state, pose, *, sighting=None, range_mm=None, target="lena"):
    return Record(time_s, RecordKind.LOOK, state, target, {"pose": pose, "range_mm": range_mm, "sighting": sighting})


def _transition(time_s, source, to, event, target="lena", **data):
    return Record(time_s, RecordKind.TRANSITION, to, target, {"source": source, "to": to, "event": event, **data})


def _failure(time_s, reason="target_lost", recovery=WAIT, target="lena"):
    """The records of a failure and of the choice that follows."""
    choice = Choice(recovery, "it was seen a moment ago", wait_s=4.0)
    known = Evidence(target, reason, seen_since_search=True, researches=0).known()
    yield Record(time_s, RecordKind.CHOICE, "arrive", target, {**choice.record(), "evidence": known})
    yield _transition(time_s, "arrive", "select", "arrive_failed", target, reason=reason, evidence={})


def _seen(time_s, target="lena"):
    return _transition(
        time_s, "search", "arrive", "target_seen", target, reason="sighted", evidence={"sighting": SIGHTING}
    )


def _reached(time_s, target="lena"):
    return _transition(
        time_s, "arrive", "reached", "arrived", target, reason="within_reach", evidence={"sighting": SIGHTING}
    )


STORY = [
    START,
    _look(0.5, "search", [0.0, 0.0, 0.0], range_mm=500.0),
    _seen(0.9),
    _look(1.0, "arrive", [300.0, 0.0, 0.0], sighting=SIGHTING),
    *_failure(2.0),
    _look(3.0, "wait", [300.0, 0.0, 0.0]),
    _look(4.0, "arrive", [900.0, 200.0, 10.0]),
    _reached(5.0),
    END,
]


def _long_run(events, seed=1):
    """A run of many failures of several kinds all over a room."""
    random_ = random.Random(seed)
    reasons = ["target_lost", "never_seen", "blocked_short", "no_progress", "lost_behind"]
    yield START
    for i in range(events):
        at = [random_.uniform(0, 4000), random_.uniform(-2000, 2000), random_.uniform(0, 3600)]
        target = random_.choice(["lena", "rilakkuma"])
        yield _look(2.0 * i + 1, "arrive", at, target=target, range_mm=random_.uniform(100, 2500))
        yield from _failure(2.0 * i + 2, random_.choice(reasons), random_.choice(list(RECOVERIES.values())), target)
    yield _reached(2.0 * events + 3)
    yield END


def _legend(records, **options):
    return [key.text for key in map_page(records, **options).keys]


def test_the_map_also_shows_echoes_between_slow_looks():
    echo = Record(1.0, RecordKind.ECHO, "search", "lena", {"pose": [0.0, 0.0, 30.0], "range_mm": 700.0})
    scene = gather([START, echo, END])
    assert len(scene.echoes) == 1
    assert scene.floor.log_odds.max() > 0.0 > scene.floor.log_odds.min()


def test_the_view_is_drawn_from_the_lens_and_where_it_looks():
    def drawn(**camera):
        marker = {"mission": {"targets": ["tag"]}, "target": {"tag": {"detector": "marker", "id": 7}}}
        return np.asarray(draw_map(STORY, Mission.model_validate({**marker, "camera": camera})))

    assert (drawn() == drawn(hfov_deg=60.0)).all()
    assert (drawn() != drawn(yaw_deg=40.0)).any()
    assert (drawn() != drawn(right_mm=150.0)).any()


@pytest.mark.parametrize("radius_mm", [130.0, 300.0])
def test_the_robot_has_the_size_that_the_mission_gives(radius_mm):
    class Circles(Sheet):
        drawn: ClassVar[list[float]] = []

        def circle(self, centre, radius, *style):
            self.drawn.append(radius)

    marker = {"mission": {"targets": ["tag"]}, "target": {"tag": {"detector": "marker", "id": 7}}}
    page = map_page(STORY, Mission.model_validate({**marker, "robot": {"radius_mm": radius_mm}}))
    view = FloorView(Circles(900, 900), page.area, page.axes, (0, 0), (860, 860))
    page.paint(view)
    # at its start and at its end
    assert Circles.drawn.count(pytest.approx(radius_mm * view.scale)) == 2


@pytest.mark.parametrize("evidence", [None, [], "seen", {"sighting": []}])
def test_a_record_of_an_unknown_form_is_no_event(evidence):
    data = {"to": "arrive", "event": "target_seen", "evidence": evidence}
    assert gather([Record(1.0, RecordKind.TRANSITION, "arrive", "lena", data)]).events == []


def test_sightings_and_echoes_are_where_the_robot_saw_them():
    scene = gather(STORY)
    # the sonar is 100 mm ahead of the axle
    assert scene.echoes == [(600.0, 0.0)]
    # 90 degrees to the right of a robot that looks along x is along y
    assert scene.sightings["lena"] == [pytest.approx((300.0, 1000.0))]


def test_a_sonar_that_does_not_answer_shows_no_free_floor():
    mute, answers = (
        Record(0.1, RecordKind.SENSOR, "search", "lena", {"sensor": "sonar", "answers": answers, "error": ""})
        for answers in (False, True)
    )
    look = _look(0.5, "search", [0.0, 0.0, 0.0])
    heard = gather([START, look]).cells(-math.inf, -0.1)
    footprint = gather([START, mute, look]).cells(-math.inf, -0.1)
    assert len(footprint) < len(heard), "only where the robot stood"
    assert max(x_mm for x_mm, _ in footprint) < 200.0
    assert gather([START, mute, answers, look]).cells(-math.inf, -0.1) == heard
    mission = with_table(read_mission_file(None), "robot", ultrasonic=0)
    assert gather([START, look], mission).cells(-math.inf, -0.1) == footprint


def test_a_single_false_sighting_far_away_does_not_make_the_room_small():
    far = _look(0.7, "search", [0.0, 0.0, 0.0], sighting={**SIGHTING, "distance_mm": 30000.0})
    near = [_look(3.0 + i, "arrive", [300.0, 0.0, 0.0], sighting=SIGHTING) for i in range(3)]
    assert map_page([*STORY[:3], far, *near, END]).area == map_page([*STORY[:3], *near, END]).area


def test_the_notes_are_the_lines_that_were_printed_with_number_and_time():
    printed: list[str] = []
    progress = ProgressLines(printed.append)
    for record in STORY:
        progress(record)
    notes = map_page(STORY).notes
    assert [note.badge for note in notes] == ["1", "2", "3"]
    assert notes[1].head == "2.0 s · lena: it went out of view on the way there"
    assert notes[1].lines == ("→ wait up to 4.0 s: it was seen a moment ago",)
    said = " ".join(line.replace("->", "→") for line in printed)
    for note in notes:
        assert note.head.partition(" · ")[2] in said
        assert all(line in said for line in note.lines)


def test_the_title_says_mission_profile_result_and_seconds():
    page = map_page(STORY, read_mission_file(None))
    assert page.title == "find Bär, Αθήνα, Жук"
    assert page.subtitle == "profile thesis; achieved after 90.0 s; lena: reached at 5.0 s"


def test_a_record_without_an_end_says_where_it_stops():
    assert "the record stops at 5.0 s" in map_page(STORY[:-1]).subtitle


def test_the_legend_has_what_occurs_and_nothing_else():
    legend = _legend(STORY)
    assert {"path: drive to a target", "failed, then: wait", "target reached", "echo of the sonar"} <= set(legend)
    assert "lena, where the camera saw it" in legend
    assert len(legend) == len(set(legend))
    for absent in ("path: search", "path: wait", "path: go round", "failed, then: leave it", "outage", "true room"):
        assert not any(text.startswith(absent) for text in legend), absent


def test_the_path_has_the_colour_of_its_state():
    drawn = np.asarray(draw_map(STORY))
    assert np.any(np.all(drawn == np.array(PATHS["arrive"].color, np.uint8), axis=2))


def test_paths_of_different_states_differ_also_in_grey():
    from nxtdrive.recording.map.style import path_style

    styles = [path_style(state) for state in (*PATHS, *RECOVERIES)]
    for one, other in combinations(styles, 2):
        assert (one.width, one.dash) != (other.width, other.dash) or one.text.endswith("leave it"), (one, other)


@pytest.mark.parametrize("recovery", sorted(RECOVERIES))
def test_every_recovery_is_explained(recovery):
    records = [START, *_failure(2.0, recovery=RECOVERIES[recovery])]
    assert f"failed, then: {RECOVERIES[recovery].label}" in _legend(records)


def test_the_true_room_is_in_the_legend_only_where_it_is_shown():
    wall, far, new = (800.0, -500.0, 800.0, 500.0), (9e4, 0.0, 9e4, 500.0), (-500.0, 0.0, -500.0, 300.0)
    legend = _legend(STORY, room=[wall, far], room_at_end=[wall, far, new])
    assert {"true room (simulated)", "moved or new in it at the end"} <= set(legend)
    assert "true room (simulated)" not in _legend(STORY, room=[far])
    assert "moved or new in it at the end" not in _legend(STORY, room=[wall], room_at_end=[wall])
    area = map_page(STORY, room=[wall, far]).area
    assert area.width < 4000
    assert area.height < 4000


@pytest.mark.parametrize(
    "records",
    [
        [],
        [START],
        [START, END],
        STORY[:2],
        [START, _seen(1.0), *_failure(2.0), END],
        [
            START,
            _look(1.0, "search", [float("nan"), 0.0, 0.0]),
            _look(2.0, "search", [1e300, 0.0, 0.0], range_mm=float("inf")),
        ],
        [START, _look(1.0, "search", [5e5, -5e5, 0.0]), _look(2.0, "arrive", [0.0, 3.0, 0.0])],
        [
            START,
            Record(1.0, RecordKind.TRANSITION, "reached", "lena", {"to": "reached"}),
            Record(1.0, RecordKind.CHOICE, "select", "", {}),
        ],
        [START, Record(1.0, RecordKind.LOOK, "search", "lena", {"pose": ["a"], "range_mm": "b", "sighting": {"x": 1}})],
    ],
    ids=["nothing", "begun", "ended", "one-point", "no-poses", "not-finite", "far", "other-version", "damaged"],
)
def test_a_run_of_any_kind_has_a_map(records):
    drawn = np.asarray(draw_map(records))
    assert drawn.ndim == 3
    assert drawn.min() < 100


def test_a_few_events_all_have_numbers_in_the_order_of_time():
    records = [START, *(record for i in range(MAX_NUMBERS) for record in _failure(float(i + 1)))]
    shown = numbering(gather(records).events)
    assert [group.first.time_s for group in shown.numbered] == [float(i + 1) for i in range(MAX_NUMBERS)]
    assert shown.rest == ()


@pytest.mark.parametrize("seed", [1, 2])
def test_hundreds_of_events_are_summarised(seed):
    records = list(_long_run(300, seed))
    shown = numbering(gather(records).events)
    assert len(shown.numbered) == MAX_NUMBERS
    counted = sum(len(group.events) for group in shown.numbered) + sum(count for _, count in shown.rest)
    assert counted == 301
    assert any(group.first.kind == "reached" for group in shown.numbered)
    kinds = [group.first.same for group in shown.numbered]
    assert len(set(kinds)) >= MAX_NUMBERS - LAST, "the first of a kind comes before the second of another"
    numbered = [event for group in shown.numbered for event in group.events]
    assert all(event in numbered for event in gather(records).events[-LAST:]), "they show how the run ended"
    rest = map_page(records).notes[-1]
    assert rest.head == f"and {301 - sum(len(group.events) for group in shown.numbered)} more, without numbers:"
    assert len(rest.lines) < 10


def test_what_repeats_at_one_place_shares_a_number():
    records = [START, *(record for i in range(300) for record in (_seen(2.0 * i), *_failure(2.0 * i + 1)))]
    shown = numbering(gather(records).events)
    assert [len(group.events) for group in shown.numbered] == [300, 300]
    assert shown.numbered[1].when == "1.0 s to 599.0 s, 300 times"
    assert shown.rest == ()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_numbers_and_names_neither_cover_each_other_nor_leave_the_map(seed):
    page = map_page(list(_long_run(300, seed)))
    view = FloorView(Sheet(900, 900), page.area, page.axes, (0, 0), (860, 860))
    boxes = place_tags(view, page)
    assert None not in boxes
    assert not any(overlap(one, other) for one, other in combinations(boxes, 2))
