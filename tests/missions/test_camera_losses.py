"""A camera that delivers no frames, or always the same one, suspends the mission."""

from __future__ import annotations

import pytest

from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import RecordKind
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.tools.sweep.task import run_episode
from nxtdrive.vision.target_vision import GLANCE_TIMEOUT_S
from sim_backend.simulation import Simulation
from sim_backend.world.event_tables import Event

UNSEEING_TURN_S = 2.0
"""To where a scan begins the robot turns up to half round, without looking."""


@pytest.mark.slow
@pytest.mark.parametrize("vision", ["geometric", pytest.param("camera", marks=pytest.mark.nightly)])
def test_an_unplugged_camera_is_noticed_as_such_and_nothing_is_forgotten(vision):
    trace, recorder = run_episode(generate_scenario("camera_loss", 102), "adaptive", vision)
    lost = [record for record in recorder.records if record.data.get("to") == "down"]
    unplugged_s = [each.time_s for each in trace.disturbances]
    assert [record.data["reason"] for record in lost] == [Reason.CAMERA_LOST] * len(unplugged_s)
    for record, since_s in zip(lost, unplugged_s, strict=True):
        assert record.time_s - since_s <= UNSEEING_TURN_S + 2 * GLANCE_TIMEOUT_S
    assert not [record for record in recorder.records if record.kind is RecordKind.CHOICE], (
        "it goes on with what it was doing"
    )
    assert trace.ending is Ending.ACHIEVED


def stuck_camera(simulation: Simulation, stays_ms: int | None) -> None:
    """Let the camera repeat its frame from 4 s on."""
    event = Event(name="it", when={"at_s": 0}, camera=True, fault="stuck")
    simulation.at(4000, lambda: simulation.world.perform(event, stays_ms))


@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
def test_a_camera_that_hangs_ends_the_mission_at_rest_and_says_what_to_do(perform, mission_for, profile):
    mission = mission_for("lena", profile=profile)
    mission = mission.model_copy(update={"mission": mission.mission.model_copy(update={"reconnect_timeout_s": 3.0})})
    done = perform("open", mission, arrange=lambda simulation: stuck_camera(simulation, None))
    assert done.report.ending is Ending.CAMERA_LOST
    assert "repeats the same frame" in done.report.error
    lost = done.of(RecordKind.TRANSITION, to="down")[0]
    assert lost.data["evidence"]["error"] == done.report.error
    assert lost.time_s < 8.0
    assert all(speed_mm_s < 1.0 for _, _, speed_mm_s in done.between(lost.time_s + 0.5, 1e9))


def test_a_camera_that_hangs_for_a_while_only_suspends_the_mission(perform, mission_for):
    done = perform(
        "open", mission_for("lena", profile="adaptive"), arrange=lambda simulation: stuck_camera(simulation, 5000)
    )
    assert done.report.ending is Ending.ACHIEVED
    assert len(done.of(RecordKind.TRANSITION, to="down")) == 1
