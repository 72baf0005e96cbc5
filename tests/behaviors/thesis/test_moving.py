"""The state move_to when the brick stops answering during it."""

from __future__ import annotations

import pytest
from random_ports import RandomPorts

from behaviors.mission import ThesisParameters
from behaviors.ports import MotionResult, RobotUnreachable
from behaviors.skills import SkillContext
from behaviors.thesis.skills import ThesisMoveSkill


class SilentOnce(RandomPorts):
    """A robot that fails at its third advance, once."""

    advances = 0

    def __init__(self) -> None:
        super().__init__(0)
        self._hinders = self._breaks = 0.0

    def straight(self, distance_mm: float) -> MotionResult:
        self.advances += 1
        if self.advances == 3:
            raise RobotUnreachable("the brick does not answer")
        return super().straight(distance_mm)


def test_all_calls_of_the_service_count_also_those_before_an_outage():
    robot, thesis = SilentOnce(), ThesisParameters(advances=10)
    skill = ThesisMoveSkill(SkillContext(robot, robot, robot, thesis, lambda *_, **__: None, lambda _: None), 90.0)
    with pytest.raises(RobotUnreachable):
        skill.call()
    assert skill.call().measured["calls"] == 11
