"""The thesis's figures, reproduced: the console of figures 1 and 7, the true path of figures 5 and 6."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest

from behaviors.journal import RecordKind

SAMPLE_MS = 50
"""As in conftest."""

CONSOLE = Path(__file__).parents[1] / "golden" / "console"
FIGURE_1, FIGURE_7 = (
    (CONSOLE / name).read_text(encoding="utf-8").splitlines() for name in ("figure1.txt", "figure7.txt")
)


@pytest.mark.slow
def test_figure_1_an_arrival_fails(perform, mission_for):
    done = perform("figure1", mission_for("lena", max_researches=0))
    assert done.lines == FIGURE_1


@pytest.mark.nightly
def test_figure_7_the_target_is_changed(perform, mission_for):
    done = perform("figure7", mission_for("lena", "rilakkuma"))
    at = done.lines.index("[client2] change target!")
    assert done.lines[at - 2 : at + 3] == FIGURE_7
    assert done.lines[:at].count("[client2] Failed") == 3, "one search and two re-searches"
    assert [progress.outcome for progress in done.report.targets] == ["given_up", "reached"]
    assert done.simulation.truth.distance_mm("rilakkuma") < 500


@pytest.mark.slow
def test_figure_5_not_recognised_turns_right_by_ninety_degrees_and_advances_ten_times(perform, mission_for):
    done = perform("figure5", mission_for("lena"), geometric=True)
    assert done.report.achieved
    ((begun_s, ended_s),) = done.in_state("move_to")
    (start, *_, end) = [pose for _, pose, _ in done.between(begun_s, ended_s)]
    assert end.heading_deg - start.heading_deg == pytest.approx(90, abs=3)
    assert math.hypot(end.x_mm - start.x_mm, end.y_mm - start.y_mm) == pytest.approx(1500, abs=50)
    assert math.degrees(math.atan2(end.y_mm - start.y_mm, end.x_mm - start.x_mm)) == pytest.approx(90, abs=4)
    steps = [record.time_s for record in done.of(RecordKind.STEP, what="advance")]
    halts = [done.between(time_s, time_s + SAMPLE_MS / 1000)[0] for time_s in steps]
    assert len(halts) == 10
    assert all(speed < 10 for _, _, speed in halts), "the robot halts after each advance"
    lengths = [math.dist(one[:2], other[:2]) for (_, one, _), (_, other, _) in pairwise(halts)]
    assert lengths == pytest.approx([150] * 9, abs=15)


@pytest.mark.slow
def test_figure_5_is_eleven_calls_of_move_to(perform, mission_for):
    done = perform("figure5", mission_for("lena"), geometric=True)
    replies = [record.data["value"] for record in done.of(RecordKind.REPLY, verb="move_to")]
    assert replies == [0] * 10 + [1]
    assert len(done.of(RecordKind.STEP, what="turn")) == 1
    assert len(done.of(RecordKind.STEP, what="advance")) == 10


@pytest.mark.slow
def test_figure_6_recognised_but_not_reached_waits_fifteen_seconds_at_rest(perform, mission_for):
    done = perform("figure6", mission_for("lena"), geometric=True)
    assert done.report.achieved
    ((begun_s, ended_s),) = done.in_state("wait")
    assert ended_s - begun_s == pytest.approx(15.0, abs=0.1)
    # half a second for the robot to come to rest after the approach that failed
    poses = [pose for _, pose, _ in done.between(begun_s + 0.5, ended_s)]
    assert max(math.dist(pose[:2], poses[0][:2]) for pose in poses) < 1.0
    assert max(abs(pose.heading_deg - poses[0].heading_deg) for pose in poses) < 0.5
    assert done.simulation.truth.distance_mm("lena") < 500


def test_figure_6_select_answers_that_the_target_exists(perform, mission_for):
    done = perform("figure6", mission_for("lena"), geometric=True)
    assert [record.data["value"] for record in done.of(RecordKind.REPLY, verb="select")] == [1]
    assert [record.data["choice"] for record in done.of(RecordKind.CHOICE)] == ["wait"]
