"""Motions that an outage cuts short."""

from __future__ import annotations

import pytest
from random_ports import RandomPorts

from behaviors.motions import ResumableStraight, ResumableTurn
from behaviors.ports import MotionResult, Pose, RobotUnreachable, StopReason

BEGIN = Pose(100.0, 200.0, 90.0)
DONE_SHARE = 0.25
"""The part of a motion that is done when the link is lost."""


class CutShort(RandomPorts):
    """A robot whose link is lost in its first motions.

    Args:
        losses: In how many.

    Attributes:
        commanded: All motions that were commanded.
    """

    def __init__(self, losses: int) -> None:
        super().__init__(0)
        self._pose, self._losses = BEGIN, losses
        self.commanded: list[float] = []

    def _go(self, distance_mm: float, angle_deg: float) -> MotionResult:
        self.commanded.append(distance_mm + angle_deg)
        share = DONE_SHARE if len(self.commanded) <= self._losses else 1.0
        x_mm, y_mm = self._pose.ahead(share * distance_mm)
        self._pose = Pose(x_mm, y_mm, self._pose.heading_deg + share * angle_deg)
        if share < 1.0:
            raise RobotUnreachable("the brick does not answer")
        return MotionResult(StopReason.DONE, distance_mm, angle_deg)


@pytest.mark.parametrize("amount", [200.0, -80.0])
@pytest.mark.parametrize(
    ("make", "attribute"), [(ResumableTurn, "turned_deg"), (ResumableStraight, "distance_mm")], ids=["turn", "straight"]
)
def test_a_motion_that_is_called_again_completes_the_rest_and_tells_the_whole(make, attribute, amount):
    robot = CutShort(2)
    motion = make(robot, amount, BEGIN)
    for _ in range(2):
        with pytest.raises(RobotUnreachable):
            motion.call()
    assert getattr(motion.call(), attribute) == pytest.approx(amount)
    left = 1 - DONE_SHARE
    assert robot.commanded == pytest.approx([amount, left * amount, left**2 * amount])


def test_a_turn_is_done_when_it_is_over():
    turn = ResumableTurn(CutShort(1), 90.0, BEGIN)
    with pytest.raises(RobotUnreachable):
        turn.call()
    assert not turn.done
    turn.call()
    assert turn.done
