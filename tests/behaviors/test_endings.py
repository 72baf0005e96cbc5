"""However a mission ends, the robot stands, and report and journal say why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest
from random_ports import RandomPorts, two_targets

from behaviors.executive import Ending, Executive
from behaviors.journal import Record, RecordKind
from behaviors.ports import CameraLost, Glimpse, Ports, RobotUnreachable, Sighting
from behaviors.wiring import WrongWiring

TIMEOUT_S, LIMIT_S = 3.0, 8.0
START_S = 1000.0


class Driving(RandomPorts):
    """A robot that sees its target always, far ahead, until an error comes while it drives.

    Args:
        error: Raised for each picture from then on.

    Attributes:
        drove: Whether it drove then.
        trusted: How often the sonar was trusted anew.
    """

    def __init__(self, error: BaseException | None) -> None:
        super().__init__(0)
        self._finds, self._hinders, self._breaks, self._moves = 1.0, 0.0, 0.0, 0.0
        self._error, self._now_s = error, START_S
        self.drove = False
        self.trusted = 0

    def glance(self, targets: Sequence[str]) -> Glimpse:
        self.drove |= not self.at_rest
        if self._error and self.drove:
            raise self._error
        return super().glance(targets)

    def _sighting(self, target: str) -> Sighting:
        return replace(super()._sighting(target), distance_mm=1500.0)

    def range_mm(self) -> float | None:
        return None

    def trust_sonar(self) -> None:
        self.trusted += 1


PROFILES = pytest.mark.parametrize("profile", ["adaptive", "thesis"])


def perform(robot: Driving, profile: str) -> tuple[Executive, list[Record], list[bool]]:
    """Return the mission, its journal, and whether the robot stood when each record was written."""
    records: list[Record] = []
    stood: list[bool] = []
    mission = two_targets(profile=profile, reconnect_timeout_s=TIMEOUT_S, time_limit_s=LIMIT_S)
    observers = [records.append, lambda _: stood.append(robot.at_rest)]
    return Executive(mission, Ports(robot, robot, robot), observers), records, stood


@PROFILES
@pytest.mark.parametrize(
    ("error", "ending", "reason"),
    [
        (RobotUnreachable("the brick does not answer"), Ending.LINK_LOST, "link_lost"),
        (RobotUnreachable("the brick refuses", refused=True), Ending.LINK_LOST, "link_lost"),
        (CameraLost("no pictures"), Ending.CAMERA_LOST, "camera_lost"),
        (WrongWiring("the motors are exchanged"), Ending.WRONG_WIRING, "wrong_wiring"),
        (KeyboardInterrupt(), Ending.INTERRUPTED, "operator_stop"),
        (None, Ending.TIME_UP, "time_up"),
    ],
)
def test_the_robot_stands_and_the_chart_ends_for_the_reason_of_the_ending(profile, error, ending, reason):
    robot = Driving(error)
    executive, records, stood = perform(robot, profile)
    report = executive.run()
    assert robot.drove
    assert robot.at_rest
    assert robot.trusted == 1, "the next mission checks the sonar afresh"
    assert report.ending is ending
    assert (report.path[:2], report.path[-1]) == (["search", "arrive"], "finished")
    assert report.refused == getattr(error, "refused", False)
    assert report.error == (str(error) if error else "")
    assert report.duration_s == pytest.approx(records[-1].time_s, abs=0.001)
    assert report.duration_s < LIMIT_S + 1.0
    end = max(i for i, record in enumerate(records) if "reason" in record.data)
    assert records[end].data["reason"] == reason
    assert all(stood[end:]), "it stops before the reason is reported"
    assert records[-1].data["ending"] == ending


@PROFILES
def test_an_error_of_a_skill_is_raised_with_the_robot_at_rest(profile):
    robot = Driving(ZeroDivisionError("a mistake"))
    executive, records, _ = perform(robot, profile)
    with pytest.raises(ZeroDivisionError):
        executive.run()
    assert robot.drove
    assert robot.at_rest
    assert robot.trusted == 1
    assert (records[-1].kind, records[-1].data["ending"]) == (RecordKind.END, Ending.BROKEN)
    assert records[-1].data["error"] == "a mistake"
