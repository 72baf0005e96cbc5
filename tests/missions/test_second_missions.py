"""Missions one after the other on one robot, as a server of the line protocol runs them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from behaviors.executive import Ending, Executive, Report
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.ports import Ports
from nxtdrive.brick import Brick
from nxtdrive.mission.body import MissionBody, MissionClock, build_body
from nxtdrive.mission.vision import geometric_vision
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation


class Robot:
    """A robot with a sonar and no bumper, in the world open.

    Attributes:
        simulation: Its world.
        body: The robot as its missions have it.
        records: The journals of all its missions.
    """

    def __init__(self, simulation: Simulation, brick: Brick, mission: Mission) -> None:
        self.simulation = simulation
        self.records: list[Record] = []
        robot = mission.robot.model_copy(update={"touch": 0})
        table = mission.mission.model_copy(update={"reconnect_timeout_s": 12.0})
        self._mission = mission.model_copy(update={"robot": robot, "mission": table})
        self.body: MissionBody = build_body(brick, self._mission)
        self._ports = Ports(self.body, geometric_vision(brick, self._mission), MissionClock(brick))
        self._sonar = simulation.brick.low_speed.channels[3].bus.sensor.device

    def pursue(self) -> Report:
        """Run the mission."""
        return Executive(self._mission, self._ports, [self.records.append]).run()

    def sonar_after(self, delay_s: float, *, works: bool) -> None:
        """Pull the sonar's cable out or plug it in, later."""
        sonar = self._sonar if works else None
        at_ms = self.simulation.now_ms + round(1000 * delay_s)
        self.simulation.at(at_ms, lambda: self.simulation.brick.attach_sensor(4, sonar))

    def of(self, kind: RecordKind) -> list[Record]:
        """Records of a kind."""
        return [record for record in self.records if record.kind is kind]


@pytest.fixture
def robot(mission_for: Callable[..., Mission]) -> Iterator[Robot]:
    simulation = Simulation("open", seed=1)
    with Brick(SimTransport(simulation)) as brick:
        yield Robot(simulation, brick, mission_for("lena", profile="adaptive"))


def test_a_failing_sensor_is_recorded_once_however_many_missions_the_robot_has_had(robot):
    for _ in range(3):
        assert robot.pursue().achieved
    robot.sonar_after(0.0, works=False)
    robot.pursue()
    assert [record.data["answers"] for record in robot.of(RecordKind.SENSOR)] == [False]


def test_a_mission_that_begins_without_its_only_safety_sensor_continues_when_that_answers_again(robot):
    robot.sonar_after(5.0, works=False)
    assert robot.pursue().ending is Ending.SENSOR_LOST
    robot.records.clear()
    robot.sonar_after(3.0, works=True)
    assert robot.pursue().achieved
    assert [record.data["answers"] for record in robot.of(RecordKind.SENSOR)] == [True]


def test_the_distrust_of_a_sonar_ends_with_the_mission(robot):
    robot.body.distrust_sonar("It measures 100 mm wherever the robot turns.")
    assert robot.pursue().ending is Ending.SENSOR_LOST
    assert robot.pursue().achieved
