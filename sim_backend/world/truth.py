"""Ground truth of the world, for tests, reports and displays; never for a program that drives the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from firmware_protocol.errors import ConfigError
from sim_backend.world.objects import BoxObject, PictureObject, PlacedObject
from sim_backend.world.people import PersonObject
from sim_backend.world.sensing import FRAME_ASPECT
from sim_backend.world.world import World

if TYPE_CHECKING:
    from sim_backend.camera.textures import Image, TextureLibrary


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
        """Return the distance between the centres of the robot and a picture, box or person.

        Raises:
            ConfigError: Nothing has this name; so do the other methods that take one.
        """
        self._object(name)
        return self._world.robot_distance_mm(name)

    def build(self) -> dict[str, tuple[str | float, ...]]:
        """Return how the robot is built, by the keys of a mission's [robot]: the values that describe it, if any.

        Ports, of sensors all that have one of that kind; diameter of the wheels and track in mm.
        """
        file, robot = self._world.file, self._world.file.robot
        own = {"ultrasonic": robot.ultrasonic_port, "touch": robot.touch_port}
        more = {kind: [each.port for each in file.sensors if each.kind == kind] for kind in own}
        return {
            "left": (robot.left_port,),
            "right": (robot.right_port,),
            **{kind: tuple(port for port in (port, *more[kind]) if port) for kind, port in own.items()},
            "wheel_diameter_mm": (robot.wheel_diameter_mm,),
            "axle_track_mm": (robot.track_mm,),
        }

    def in_view(self, picture: str) -> bool:
        """Return whether the camera could recognise the picture now."""
        if picture not in self._world.pictures:
            known = ", ".join(self._world.pictures) or "none"
            raise ConfigError(f"there is no picture {picture!r} here; known: {known}.")
        return self._world.in_view(picture)

    def outlines(self) -> list[tuple[float, float, float, float]]:
        """Return the sides of walls and present objects on the floor: x0_mm, y0_mm, x1_mm, y1_mm of each."""
        return [(side.x0_mm, side.y0_mm, side.x1_mm, side.y1_mm) for side in self._world.panels()]

    def front_images(self) -> dict[str, Image]:
        """Return the front image of each picture, box and person, present or absent, by name."""
        return {name: self._textures[each.texture].pixels for name, each in self._objects().items()}

    def lens_distance_mm(self, name: str) -> float:
        """Return the distance between the camera's lens and a picture's centre, or the surface of a box or person."""
        eye, obj = self._world.viewpoint(), self._object(name)
        if name in self._world.pictures:
            return math.dist((eye.x_mm, eye.y_mm), obj.at_mm)
        return float(obj.shapes[0].point_query((eye.x_mm, eye.y_mm)).distance)

    def whole_from_mm(self, name: str) -> float:
        """Return how far away the camera's lens must be for the frame to show the whole height of a picture.

        0 for a box or a person, of which a part is enough; infinity for what is above or below every frame.
        """
        picture, camera = self._object(name), self._world.file.camera
        if not isinstance(picture, PictureObject):
            return 0.0
        half = math.atan(math.tan(math.radians(camera.hfov_deg / 2)) * FRAME_ASPECT)
        tilt = math.radians(camera.tilt_deg)
        farther = [
            math.inf if edge <= 0 else beyond_mm / math.tan(edge)
            for beyond_mm, edge in (
                (picture.height_mm - camera.height_mm, half + tilt),
                (camera.height_mm - picture.bottom_mm, half - tilt),
            )
            if beyond_mm > 0
        ]
        return max(farther, default=0.0)

    def in_front_of_camera(self, name: str) -> bool:
        """Return whether the camera points at a picture's front, a box or a person, and nothing hides it."""
        return self._world.sees(self._object(name))

    def _object(self, name: str) -> PictureObject | BoxObject | PersonObject:
        objects = self._objects()
        if name not in objects:
            raise ConfigError(f"there is no {name!r} here; known: {', '.join(objects) or 'nothing'}.")
        return objects[name]

    def _objects(self) -> dict[str, PictureObject | BoxObject | PersonObject]:
        return {**self._world.pictures, **self._world.boxes, **self._world.people}

    @cached_property
    def _textures(self) -> TextureLibrary:
        from sim_backend.camera.textures import TextureLibrary

        return TextureLibrary(self._world.seed)


def _poses(objects: Mapping[str, PlacedObject]) -> dict[str, TruePose]:
    return {name: TruePose(*each.at_mm, each.facing_deg) for name, each in objects.items() if each.present}
