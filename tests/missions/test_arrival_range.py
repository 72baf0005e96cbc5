"""An arrival counts when the sonar agrees with the distance that the target's size gives."""

from __future__ import annotations

import pytest

from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import RecordKind
from behaviors.mission import Mission
from tests.small_mission import with_table

TRUE_HEIGHT_MM = 297.0
LENS_FORWARD_MM = 60.0


def _mission(
    mission: Mission, height_mm: float, profile: str = "adaptive", time_limit_s: float = 20.0, **adaptive: object
) -> Mission:
    table = mission.mission.model_copy(update={"profile": profile, "time_limit_s": time_limit_s})
    target = {name: each.model_copy(update={"height_mm": height_mm}) for name, each in mission.target.items()}
    update = {"mission": table, "target": target, "adaptive": mission.adaptive.model_copy(update=adaptive)}
    return mission.model_copy(update=update)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("height_mm", "geometric"),
    [(12.0, True), (20.0, True), (30.0, True), pytest.param(60.0, False, marks=pytest.mark.nightly)],
)
def test_a_target_that_is_higher_than_its_mission_says_is_not_reached_from_afar(
    perform, mission_for, height_mm, geometric
):
    done = perform("open", _mission(mission_for("lena"), height_mm), geometric=geometric)
    assert done.report.ending is Ending.TIME_UP
    failures = [record.data["evidence"] for record in done.of(RecordKind.TRANSITION, reason=Reason.RANGE_MISMATCH)]
    assert failures
    assert failures[0]["range_mm"] > failures[0]["distance_mm"] + 250


@pytest.mark.slow
@pytest.mark.parametrize(
    ("height_mm", "geometric"),
    [
        (120.0, True),
        (150.0, True),
        pytest.param(150.0, False, marks=pytest.mark.nightly),
        (2 * TRUE_HEIGHT_MM, True),
    ],
)
def test_a_stop_before_a_target_of_another_height_is_at_the_target(perform, mission_for, height_mm, geometric):
    done = perform("open", _mission(mission_for("lena"), height_mm, time_limit_s=60.0), geometric=geometric)
    assert done.report.achieved
    x_mm = done.track[-1][1].x_mm
    assert 2400.0 - 500.0 < x_mm + LENS_FORWARD_MM < 2400.0 - 200.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "geometric"), [(0.8, True), pytest.param(1.0, False, marks=pytest.mark.nightly), (1.2, True)]
)
def test_a_height_that_is_measured_roughly_will_do(perform, mission_for, share, geometric):
    done = perform("open", _mission(mission_for("lena"), share * TRUE_HEIGHT_MM), geometric=geometric)
    assert done.report.achieved
    assert done.of(RecordKind.TRANSITION, to="reached")[0].data["evidence"]["range_mm"] < 600


@pytest.mark.slow
def test_a_mission_may_tolerate_an_echo_from_behind_the_target(perform, mission_for):
    done = perform("open", _mission(mission_for("lena"), 100.0, sonar_tolerance_mm=2000.0), geometric=True)
    assert done.report.achieved


@pytest.mark.slow
def test_the_thesis_arrives_by_apparent_size_alone(perform, mission_for):
    assert perform("open", _mission(mission_for("lena"), 20.0, "thesis")).report.achieved


@pytest.mark.nightly
def test_a_print_that_fills_the_frame_is_reached_without_a_sonar(perform, mission_for):
    mission = _mission(mission_for("lena"), TRUE_HEIGHT_MM, time_limit_s=60.0)
    mission = with_table(mission, "robot", ultrasonic=0)
    done = perform("open", mission)
    assert done.report.achieved
    assert 2400.0 - 500.0 < done.track[-1][1].x_mm + LENS_FORWARD_MM < 2400.0 - 200.0
