"""In a scenario of the sweep, a camera that delivers no frames suspends the mission, with real frames too."""

from __future__ import annotations

import pytest

from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import RecordKind
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.tools.sweep.task import run_episode
from nxtdrive.vision.target_vision import GLANCE_TIMEOUT_S

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
