"""A camera that gives no picture is told from a target that is gone, with real frames too."""

from __future__ import annotations

import pytest

from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import Kind
from nxtdrive.tools.sweep.performance import perform
from nxtdrive.tools.sweep.scenarios import draw_scenario
from nxtdrive.vision.eyes import GLANCE_TIMEOUT_S

LOST_AFTER_S = 0.6
"""The adaptive profile misses pictures after half of its `lost_after_s`."""


@pytest.mark.slow
@pytest.mark.parametrize("eyes", ["geometric", "camera"])
def test_an_unplugged_camera_is_noticed_as_such_and_nothing_is_forgotten(eyes):
    trace, referee = perform(draw_scenario("camera_loss", 102), "adaptive", eyes)
    choices = [record for record in referee.records if record.kind is Kind.CHOICE]
    assert [choice.data["evidence"]["reason"] for choice in choices] == [Reason.CAMERA_LOST]
    unplugged_s = max(each.time_s for each in trace.disturbances if each.time_s < choices[0].time_s)
    assert choices[0].time_s - unplugged_s <= LOST_AFTER_S + 2 * GLANCE_TIMEOUT_S
    assert trace.ending is Ending.ACHIEVED
