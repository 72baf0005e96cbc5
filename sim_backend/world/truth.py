"""Where everything really is: for tests, reports and people, never for a program that drives the robot."""

from __future__ import annotations

from typing import NamedTuple

from sim_backend.world.world import World


class TruePose(NamedTuple):
    """A place on the map.

    Attributes:
        x_mm: To the right.
        y_mm: Down.
        heading_deg: Clockwise from +x; for the robot not wrapped, so that turns can be counted.
    """

    x_mm: float
    y_mm: float
    heading_deg: float


class GroundTruth:
    """Reads the world without sensors.

    Args:
        world: What to read.
    """

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def pose(self) -> TruePose:
        """The robot: middle of its axle."""
        robot = self._world.robot
        return TruePose(robot.x_mm, robot.y_mm, robot.heading_deg)

    @property
    def speed_mm_s(self) -> float:
        """Of the robot's middle."""
        return float(self._world.robot.body.velocity.length)

    @property
    def contacts(self) -> int:
        """How often the robot has come to touch something."""
        return self._world.contact_count

    @property
    def touching(self) -> bool:
        """Whether something touches the robot now, at any side."""
        return bool(self._world.robot.contact_bearings_deg)

    @property
    def pictures(self) -> dict[str, TruePose]:
        """Place and facing of the pictures that are there now."""
        pictures = self._world.pictures.values()
        return {thing.name: TruePose(*thing.at_mm, thing.facing_deg) for thing in pictures if thing.present}

    @property
    def people(self) -> dict[str, tuple[float, float]]:
        """Where the people are who are in the room now."""
        return {name: person.at_mm for name, person in self._world.people.items() if person.present}

    @property
    def boxes(self) -> dict[str, TruePose]:
        """Place and facing of the boxes that are there now."""
        boxes = self._world.boxes.values()
        return {thing.name: TruePose(*thing.at_mm, thing.facing_deg) for thing in boxes if thing.present}

    @property
    def events(self) -> list[tuple[float, str]]:
        """What has happened: (seconds, name of the event)."""
        return [(time_ms / 1000.0, name) for time_ms, name in self._world.story.log]

    def distance_mm(self, name: str) -> float:
        """From the robot's middle to the middle of a picture, box or person."""
        return self._world.robot_distance_mm(name)

    def in_view(self, picture: str) -> bool:
        """Whether the camera could recognise the picture now."""
        return self._world.in_view(picture)
