"""A second look points the camera at where the target was, however the camera is mounted."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from random_ports import two_targets
from staged_ports import Stage, adaptive_profile

from behaviors.adaptive.target_memory import TargetEstimate
from behaviors.adaptive.wait_rescan import RescanSkill
from behaviors.angles import wrapped_deg
from behaviors.events import Event
from behaviors.ports import Glimpse, Pose

HALF_VIEW_DEG = 8.0


class NarrowView(Stage):
    """A camera that shows its target, far ahead of the start, only when it points there."""

    def __init__(self, bearing_deg: float, yaw_deg: float) -> None:
        super().__init__([(60.0, yaw_deg, 1000.0, None)])
        self._bearing_deg, self._yaw_deg = bearing_deg, yaw_deg

    def glance(self, targets: Sequence[str]) -> Glimpse:
        glimpse = super().glance(targets)
        off_deg = wrapped_deg(self._bearing_deg - self._yaw_deg - self.pose().heading_deg)
        return glimpse if abs(off_deg) <= HALF_VIEW_DEG else Glimpse(glimpse.time_s, {})


@pytest.mark.parametrize("yaw_deg", [-40.0, 0.0, 40.0])
@pytest.mark.parametrize("bearing_deg", [0.0, 90.0, -170.0])
def test_it_finds_a_target_that_is_still_there(yaw_deg, bearing_deg):
    robot, mission = NarrowView(bearing_deg, yaw_deg), two_targets()
    camera = mission.camera.model_copy(update={"yaw_deg": yaw_deg})
    profile = adaptive_profile(robot, mission.model_copy(update={"camera": camera}))
    place = robot.pose().ahead(1000.0, bearing_deg)
    profile.world.targets.known["a"] = TargetEstimate(place, 0.0, 1000.0, Pose())
    assert RescanSkill(profile._perception).call().event is Event.TARGET_SEEN
    assert abs(robot.pose().heading_deg) <= 180.0
