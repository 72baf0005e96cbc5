"""Figures of missions built by hand, with known results."""

import math

import pytest

from behaviors.executive import Ending
from behaviors.journal import Record, RecordKind
from nxtdrive.tools.sweep.causes import FailureCause, evaluate_choices, longest_run, recognition_s, soonest_s
from nxtdrive.tools.sweep.metrics import evaluate_target
from nxtdrive.tools.sweep.truth_recorder import (
    Disturbance,
    EpisodeTrace,
    RecordWithTruth,
    TruthRecorder,
    TruthSample,
)
from sim_backend.evaluation import Scene, stop_counts
from sim_backend.scenarios.floor_plan import FloorPlan, Goal, Obstacle
from sim_backend.simulation import Simulation
from sim_backend.world.truth import TruePose
from sim_backend.world.world_file import Camera

LENA = Goal("lena", (3800.0, 1500.0), 180.0)
PERSON = Obstacle("anna", (2600.0, 1500.0), radius_mm=200.0)
BEHIND = (2900.0, 1500.0)
WALLS = (
    Obstacle("left of the door", (2000.0, 550.0), (20.0, 1100.0)),
    Obstacle("right", (2000.0, 2450.0), (20.0, 1100.0)),
)
IN_THE_DOOR = Obstacle("anna", (2000.0, 1500.0), radius_mm=250.0)


def _scene(*obstacles, goals=(LENA,)):
    return Scene(FloorPlan((4000.0, 3000.0), tuple(obstacles)), {goal.name: goal for goal in goals})


@pytest.mark.parametrize(("forward_mm", "counts"), [(60.0, True), (-60.0, False)])
def test_a_stop_counts_by_where_the_camera_is_mounted(forward_mm, counts):
    here = TruePose(LENA.at_mm[0] - 540.0, LENA.at_mm[1], 0.0)  # 480 mm in front with the usual camera
    scene = Scene(FloorPlan((4000.0, 3000.0), (), Camera(forward_mm=forward_mm)), {"lena": LENA})
    assert stop_counts(here, scene, "lena") is counts


class EpisodeBuilder:
    """Builds the trace of a mission sample by sample."""

    def __init__(self, *, scene=None, late_objects=()):
        self.scene = scene or _scene()
        self.late_objects = frozenset(late_objects)
        self.samples, self.entries, self.disturbances = [], [], []
        self.time_s, self.at, self.heading_deg = 0.0, (500.0, 1500.0), 0.0
        self._sample()

    def _sample(self):
        self.samples.append(TruthSample(self.time_s, TruePose(*self.at, self.heading_deg), 0, self.scene))
        return self.samples[-1]

    def drive(self, x_mm, y_mm, seconds):
        begin = self.at
        for i in range(1, 11):
            self.time_s += seconds / 10
            self.at = tuple(a + (b - a) * i / 10 for a, b in zip(begin, (x_mm, y_mm), strict=True))
            self._sample()
        return self

    def note(self, kind, target="lena", **data):
        self.entries.append(RecordWithTruth(Record(self.time_s, kind, "search", target, data), self._sample()))
        return self

    def enter(self, state, target="lena"):
        return self.note(RecordKind.TRANSITION, target, source="", to=state)

    def choose(self, choice, target="lena", reason="blocked_long"):
        return self.note(RecordKind.CHOICE, target, choice=choice, why="", evidence={"reason": reason})

    def disturb(self, blocker="", target="lena"):
        self.disturbances.append(Disturbance(self.time_s, target, blocker))
        return self

    def end(self):
        self.note(RecordKind.END)
        return EpisodeTrace(
            ["lena"],
            self.samples,
            self.entries,
            self.disturbances,
            self.late_objects,
            3000.0,
            Ending.GIVEN_UP,
            self.time_s,
        )


def test_a_straight_drive_is_as_good_as_can_be():
    result = evaluate_target(EpisodeBuilder().enter("search").drive(3260, 1500, 14.6).enter("reached").end(), "lena")
    assert result.success
    assert result.spl == pytest.approx(1.0, abs=0.02)
    assert result.sct == pytest.approx((2740 / 200 + 0.5) / 14.6, abs=0.03)
    assert result.time_s == pytest.approx(14.6)
    assert result.path_mm == pytest.approx(2760)


def test_a_detour_lowers_the_path_efficiency():
    episode = EpisodeBuilder().enter("search").drive(500, 2700, 6).drive(500, 1500, 6).drive(3260, 1500, 14)
    result = evaluate_target(episode.enter("reached").end(), "lena")
    assert result.spl == pytest.approx(2740 / (2760 + 2400), abs=0.02)
    assert result.soft_spl == result.spl


@pytest.mark.parametrize("place", [(3200.0, 1500.0), (3750.0, 1200.0)])
def test_a_stop_that_is_too_far_or_too_much_from_the_side_is_a_wrong_stop(place):
    result = evaluate_target(EpisodeBuilder().enter("search").drive(*place, 14).enter("reached").end(), "lena")
    assert (result.success, result.wrong_stops, result.spl, result.sct) == (False, 1, 0.0, 0.0)
    assert result.soft_spl > 0.7


def test_a_stop_before_something_that_hides_the_picture_is_a_wrong_stop():
    episode = EpisodeBuilder(scene=_scene(Obstacle("screen", (3600.0, 1500.0), (20.0, 400.0)))).enter("search")
    result = evaluate_target(episode.drive(3400, 1500, 14).enter("reached").end(), "lena")
    assert result.wrong_stops == 1


def test_a_path_that_opens_later_is_measured_by_the_map_of_the_arrival():
    """A person stands in the only door when the pursuit begins."""
    episode = EpisodeBuilder(late_objects=["anna"], scene=_scene(*WALLS, IN_THE_DOOR)).enter("search")
    episode.drive(500, 1500, 5).scene = _scene(*WALLS)
    result = evaluate_target(episode.drive(3260, 1500, 14).enter("reached").end(), "lena")
    assert result.success
    assert result.spl == pytest.approx(1.0, abs=0.02)
    assert result.sct == pytest.approx(13.7 / 19.0, abs=0.05)


def test_half_of_the_path_gives_half_of_the_soft_figure():
    result = evaluate_target(EpisodeBuilder().enter("search").drive(1900, 1500, 7).enter("gave_up").end(), "lena")
    assert result.soft_spl == pytest.approx(0.5, abs=0.02)
    assert result.given_up_s == pytest.approx(7.0)


def test_a_target_that_is_not_there_is_not_reachable():
    result = evaluate_target(EpisodeBuilder(scene=_scene(goals=())).enter("search").enter("gave_up").end(), "lena")
    assert (result.reachable, result.success, result.shortest_mm) == (False, False, None)


def test_recognition_time_starts_when_a_person_blocks_the_path():
    episode = (
        EpisodeBuilder(late_objects=["anna"]).enter("arrive").drive(1000, 1500, 2).disturb("anna").drive(1200, 1500, 1)
    )
    episode.scene = _scene(PERSON)
    trace = episode.drive(1400, 1500, 2).choose("wait").end()
    # the first sample that shows her is 0.2 s after she has come
    assert recognition_s(trace) == [pytest.approx(1.8)]


def test_a_dead_camera_is_noticed_when_the_mission_is_suspended():
    episode = EpisodeBuilder().enter("arrive").drive(1000, 1500, 2).disturb(target="")
    episode.drive(1000, 1500, 0.5).enter("suspended").drive(1000, 1500, 4).enter("arrive").choose("rescan")
    assert recognition_s(episode.end()) == [pytest.approx(0.5)]


def _blocked(stays_s, choice, waits_s):
    episode = EpisodeBuilder(late_objects=["anna"]).enter("arrive")
    episode.at, episode.scene = (1800.0, 1500.0), _scene(PERSON)
    episode.choose(choice).drive(1800, 1500, min(stays_s, waits_s))
    if stays_s <= waits_s:
        episode.scene = _scene()
    trace = episode.drive(1800, 1500, max(0.1, waits_s - stays_s)).enter("search").end()
    (evaluation,) = evaluate_choices(trace)
    return evaluation


def test_to_wait_fits_when_the_way_is_free_sooner_than_a_detour_takes():
    evaluation = _blocked(stays_s=1.0, choice="wait", waits_s=1.1)
    assert (evaluation.cause, evaluation.fits) == (FailureCause.BLOCKED_SHORT, True)
    assert evaluation.regret_s == pytest.approx(0.1, abs=0.15)


def test_a_long_wait_for_a_person_who_stays_has_regret():
    evaluation = _blocked(stays_s=math.inf, choice="wait", waits_s=15.0)
    assert (evaluation.cause, evaluation.fits) == (FailureCause.BLOCKED_LONG, False)
    assert evaluation.regret_s == pytest.approx(15.0, abs=0.2)
    assert _blocked(stays_s=math.inf, choice="detour", waits_s=5.0).regret_s == 0.0


def test_what_could_have_been_seen_was_missed_and_the_rest_is_elsewhere():
    near = EpisodeBuilder().enter("search").drive(1500, 1500, 4).choose("move_to").end()
    far = EpisodeBuilder(scene=_scene(Obstacle("cupboard", (2000.0, 1500.0), (200.0, 1500.0)))).enter("search")
    assert [each.cause for each in evaluate_choices(near)] == [FailureCause.MISSED]
    assert [each.cause for each in evaluate_choices(far.choose("move_to").end())] == [FailureCause.ELSEWHERE]


def test_a_run_is_of_recoveries_at_one_place_after_one_kind_of_failure_whatever_was_chosen():
    episode = EpisodeBuilder().choose("wait").choose("rescan").drive(1500, 1500, 5).choose("wait").choose("detour")
    episode.choose("wait").choose("move_to", reason="no_way").choose("wait").choose("change_target")
    assert longest_run(episode.end()) == 3


def test_the_time_between_decisions_is_at_one_place():
    episode = EpisodeBuilder().choose("wait").drive(1500, 1500, 0.3).choose("wait").drive(1500, 1500, 2.0)
    assert soonest_s(episode.choose("rescan").end()) == pytest.approx(2.0)
    assert soonest_s(EpisodeBuilder().choose("wait").end()) is None


def test_a_camera_that_is_unplugged_already_is_not_unplugged_again():
    simulation = Simulation()
    simulation.webcam.unplugged_ms = ((1000, 5000), (3000, 6000), (8000, 9000))
    recorder = TruthRecorder(simulation)
    assert [each.time_s for each in recorder.disturbances()] == [1.0, 8.0]
