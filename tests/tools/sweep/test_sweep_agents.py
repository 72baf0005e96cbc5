"""Every agent ends a mission, and is evaluated by the ground truth."""

from dataclasses import replace

import pytest

from behaviors.executive import Ending
from behaviors.journal import RecordKind
from nxtdrive.recording.progress_lines import lines_of
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.tools.sweep.agents import ABLATIONS, ALL_NAMES, NAMES
from nxtdrive.tools.sweep.task import run_episode


def _limited(scenario, limit_s):
    table = scenario.mission.mission.model_copy(update={"time_limit_s": limit_s})
    return replace(scenario, mission=scenario.mission.model_copy(update={"mission": table}))


@pytest.mark.slow
@pytest.mark.parametrize(
    "agent", [pytest.param(name, marks=pytest.mark.nightly) if name in ABLATIONS else name for name in ALL_NAMES]
)
def test_every_agent_ends_a_mission_with_the_robot_at_rest(agent):
    trace, recorder = run_episode(_limited(generate_scenario("absent", 100), 40.0), agent, "geometric")
    assert trace.ending in (Ending.TIME_UP, Ending.GIVEN_UP)
    assert trace.duration_s <= 43.0
    assert [record.kind for record in (recorder.records[0], recorder.records[-1])] == [RecordKind.START, RecordKind.END]
    assert trace.entries[-1].record.kind is RecordKind.END


@pytest.mark.slow
def test_nav2s_list_recovers_in_turn_and_gives_up_after_six():
    _, recorder = run_episode(generate_scenario("absent", 101), "nav2-list", "geometric")
    first = recorder.records[0].data["targets"][0]
    choices = [r.data["choice"] for r in recorder.records if r.kind is RecordKind.CHOICE and r.target == first]
    assert choices == ["rescan", "wait", "back_up"] * 2 + ["change_target"]
    done = [line.partition("-> ")[2] for _, line in lines_of(recorder.records) if "->" in line]
    words = [
        "look again from here: next in the list",
        "wait up to 5.0 s: next in the list",
        "back up: next in the list",
    ]
    assert done[:7] == [*words, *words, "leave this target: recovered 6 times"]


@pytest.mark.parametrize("agent", NAMES)
@pytest.mark.parametrize("kind", ["link", "camera_loss"])
def test_outages_suspend_a_mission_which_then_continues(kind, agent):
    _, recorder = run_episode(_limited(generate_scenario(kind, 100), 60.0), agent, "geometric")
    went = [record.data["to"] for record in recorder.records if record.kind is RecordKind.TRANSITION]
    if kind == "camera_loss" and agent == "oracle":
        assert "suspended" not in went, "it needs no camera"
        return
    assert "suspended" in went
    assert went[went.index("suspended") + 1] != "finished"


def test_the_oracle_outlasts_outages_of_the_link():
    scenario = generate_scenario("link", 100)
    assert scenario.conditions.faults.silent_ms
    trace, _ = run_episode(scenario, "oracle", "geometric")
    assert trace.ending is Ending.ACHIEVED


@pytest.mark.slow
def test_rendered_frames_show_the_same_scenario():
    trace, recorder = run_episode(_limited(generate_scenario("camera_loss", 101), 12.0), "thesis", "camera")
    assert trace.ending is Ending.TIME_UP
    assert any(record.kind is RecordKind.LOOK for record in recorder.records)
