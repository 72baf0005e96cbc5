"""What the chart hears of the safety stop."""

from __future__ import annotations

import pytest
from random_ports import RandomPorts

from behaviors.obstacle_watch import ObstacleWatch
from behaviors.ports import StopReason

OBSTACLE, CONTACT = StopReason.OBSTACLE, StopReason.CONTACT


class Ahead(RandomPorts):
    """A robot in front of something; counts how often its sonar is read."""

    readings = 0

    def __init__(self) -> None:
        super().__init__(0)

    def range_mm(self) -> float:
        self.readings += 1
        return 120.0


@pytest.mark.parametrize(
    ("stops", "events"),
    [
        ([None, StopReason.DONE, StopReason.STALLED, StopReason.TIMEOUT, None], []),
        ([OBSTACLE, OBSTACLE, None, None], ["obstacle", "obstacle_gone"]),
        ([OBSTACLE, StopReason.STALLED, OBSTACLE], ["obstacle", "obstacle_gone", "obstacle"]),
        ([CONTACT, CONTACT, StopReason.DONE], ["obstacle", "contact", "obstacle_gone"]),
        ([OBSTACLE, CONTACT, OBSTACLE, CONTACT], ["obstacle", "contact", "contact"]),
    ],
)
def test_what_holds_the_robot_is_reported_once_until_it_is_gone(stops, events):
    reported = []
    watch = ObstacleWatch(Ahead(), lambda fact: reported.append(fact.event))
    for stop in stops:
        watch.update(stop)
    assert reported == events


def test_the_sensors_ahead_are_read_when_something_newly_holds_the_robot_unless_their_values_are_given():
    robot, reported = Ahead(), []
    watch = ObstacleWatch(robot, reported.append)
    watch.update(OBSTACLE)
    watch.update(CONTACT)
    watch.update(None)
    watch.update(OBSTACLE, {})
    assert robot.readings == 1
    measured = [fact.measured for fact in reported if fact.event == "obstacle"]
    assert measured == [{"stop": "obstacle", "range_mm": 120.0, "touching": False}, {"stop": "obstacle"}]
