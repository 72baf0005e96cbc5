"""Ground truth of the world, for tests, reports and displays; never for a program that drives the robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from sim_backend.world.objects import PlacedObject
from sim_backend.world.world import World


class TruePose(NamedTuple):
    """A pose on the map.

    Attributes:
        x_mm: Positive to the right.
        y_mm: Positive down.
        heading_deg: Clockwise from +x; unwrapped for the robot, so that turns can be counted.
    """

    x_mm: float
    y_mm: float
    heading_deg: float


class GroundTruth:
    """Reads the state of a world directly, not through sensors.

    Args:
        world: The world to read.
    """

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def pose(self) -> TruePose:
        """Pose of the robot, at the middle of its axle."""
        robot = self._world.robot
        return TruePose(robot.x_mm, robot.y_mm, robot.heading_deg)

    @property
    def speed_mm_s(self) -> float:
        """Speed of the middle of the axle."""
        return float(self._world.robot.body.velocity.length)

    @property
    def contacts(self) -> int:
        """How often the robot has come into contact with something."""
        return self._world.contact_count

    @property
    def touching(self) -> bool:
        """Whether the robot is in contact with something now, on any side."""
        return bool(self._world.robot.contact_bearings_deg)

    @property
    def pictures(self) -> dict[str, TruePose]:
        """Poses of the pictures that are present, by name."""
        return _poses(self._world.pictures)

    @property
    def people(self) -> dict[str, tuple[float, float]]:
        """Positions of the people who are in the room, by name."""
        return {name: person.at_mm for name, person in self._world.people.items() if person.present}

    @property
    def boxes(self) -> dict[str, TruePose]:
        """Poses of the boxes that are present, by name."""
        return _poses(self._world.boxes)

    @property
    def events(self) -> list[tuple[float, str]]:
        """Events so far: (time in seconds, name)."""
        return [(time_ms / 1000.0, name) for time_ms, name in self._world.scheduler.log]

    def distance_mm(self, name: str) -> float:
        """Distance between the centers of the robot and a picture, box or person."""
        return self._world.robot_distance_mm(name)

    def in_view(self, picture: str) -> bool:
        """Whether the camera could recognise the picture now."""
        return self._world.in_view(picture)


def _poses(objects: Mapping[str, PlacedObject]) -> dict[str, TruePose]:
    return {name: TruePose(*each.at_mm, each.facing_deg) for name, each in objects.items() if each.present}
