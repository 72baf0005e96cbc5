"""Ray queries for the robot's sensors: ultrasonic echoes and lines of sight."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from random import Random

import pymunk

from sim_backend.camera.scene import Viewpoint, in_camera_frame
from sim_backend.plane import wrapped_deg
from sim_backend.world.objects import PictureObject, WorldObject
from sim_backend.world.robot import ROBOT_GROUP, RobotBody
from sim_backend.world.sensor_tables import EchoSettings
from sim_backend.world.toml_types import Point

CONE_DEG = 15.0
"""Half the angle of the ultrasonic beam."""
RAYS = 7
NEAREST_MM, FARTHEST_MM = 30.0, 2550.0
"""Range of the ultrasonic sensor; 255 cm means "no echo". Source: LEGO's hardware developer kit."""
VIEW_RANGE_MM = 3000.0
"""Pictures beyond this distance do not count as visible. Source: docs/ranges.md, A4 at 320 x 240."""
FRAME_ASPECT = 3 / 4
"""Height of a frame over its width."""
VIEW_ANGLE_DEG = 55.0
"""Pictures at a larger angle from their normal do not count as visible."""

_NOT_ROBOT = pymunk.ShapeFilter(group=ROBOT_GROUP)


class RayCaster:
    """Finds what rays over the floor meet, except the robot.

    Args:
        space: The physics.
        objects: All objects in it; those that are absent now are in no ray's way.
    """

    def __init__(self, space: pymunk.Space, objects: Iterable[WorldObject]) -> None:
        self._space = space
        self._objects: dict[pymunk.Shape, WorldObject] = {}
        for obj in objects:
            self.add(obj)

    def add(self, obj: WorldObject) -> None:
        """Add an object."""
        self._objects.update(dict.fromkeys(obj.shapes, obj))

    def cast(self, start: Point, end: Point) -> Iterator[tuple[WorldObject, pymunk.SegmentQueryInfo]]:
        """Yield the objects on the line between two points, nearest first, and where it meets them."""
        for hit in sorted(self._space.segment_query(start, end, 0.0, _NOT_ROBOT), key=lambda hit: hit.alpha):
            if hit.shape is not None:
                yield self._objects[hit.shape], hit


class UltrasonicBeam:
    """The beam of an ultrasonic sensor: the nearest echo in a cone.

    Args:
        rays: Finds the obstacles; those lower than the sensor give no echo.
        sensor: Parameters of the sensor.
        robot: The robot that carries it.
        at_mm: Position on the robot: (forward, right) of the middle of the axle.
        direction_deg: Direction of the beam, clockwise from the front.
        random: Random numbers for noise and dropouts.
    """

    def __init__(
        self,
        rays: RayCaster,
        sensor: EchoSettings,
        robot: RobotBody,
        at_mm: Point,
        direction_deg: float,
        random: Random,
    ) -> None:
        self._rays, self._sensor, self._robot, self._random = rays, sensor, robot, random
        self._at_mm, self._direction_deg = at_mm, direction_deg

    def distance_cm(self) -> int | None:
        """Return a new reading in whole centimetres, 3..254, or None without an echo."""
        distance_mm = self._nearest_mm()
        if distance_mm is None or self._random.random() < self._sensor.dropout:
            return None
        distance_mm = max(NEAREST_MM, distance_mm + self._random.gauss(0.0, self._sensor.noise_mm))
        return round(distance_mm / 10.0) if distance_mm < FARTHEST_MM - 5.0 else None

    def _nearest_mm(self) -> float | None:
        if self._robot.lifted:
            return None
        x, y = self._robot.point_mm(self._at_mm)
        heading = math.radians(self._robot.heading_deg + self._direction_deg)
        cone = math.radians(CONE_DEG)
        angles = (heading - cone + 2 * cone * ray / (RAYS - 1) for ray in range(RAYS))
        echoes = [echo for angle in angles if (echo := self._echo_mm(x, y, angle)) is not None]
        return min(echoes, default=None)

    def _echo_mm(self, x: float, y: float, angle: float) -> float | None:
        """Return the distance of the first hit of a ray; None without a hit or if the surface deflects the echo."""
        along_x, along_y = math.cos(angle), math.sin(angle)
        for obj, hit in self._rays.cast((x, y), (x + FARTHEST_MM * along_x, y + FARTHEST_MM * along_y)):
            if obj.height_mm < self._sensor.height_mm:
                continue
            if obj.absorbs:
                return None
            incidence_cosine = -(hit.normal.x * along_x + hit.normal.y * along_y)
            returns = incidence_cosine >= math.cos(math.radians(self._sensor.max_incidence_deg))
            return hit.alpha * FARTHEST_MM if returns else None
        return None


class LinesOfSight:
    """What the robot's camera could see.

    Args:
        rays: Finds the obstacles.
        hfov_deg: Horizontal field of view.
    """

    def __init__(self, rays: RayCaster, hfov_deg: float) -> None:
        self._rays, self._hfov_deg = rays, hfov_deg

    def in_view(self, picture: PictureObject, viewpoint: Viewpoint) -> bool:
        """Return whether a camera could recognise a picture: present, in front, near, not too oblique and not hidden.

        The middle half of the picture must be in the field of view.
        """
        away_mm = math.dist((viewpoint.x_mm, viewpoint.y_mm), picture.at_mm)
        return away_mm <= VIEW_RANGE_MM and self.shows(picture, viewpoint, VIEW_ANGLE_DEG)

    def shows(self, picture: PictureObject, viewpoint: Viewpoint, most_deg: float = 90.0) -> bool:
        """Return whether the front of a picture is in a camera's view, at most `most_deg` aslant, and not hidden."""
        back = _bearing_deg(picture.at_mm, (viewpoint.x_mm, viewpoint.y_mm))
        if not picture.present or abs(wrapped_deg(back - picture.facing_deg)) > most_deg:
            return False
        points, centre_mm = picture.edge_points(), picture.centre_height_mm
        return all(self.sees(picture, point, centre_mm, viewpoint) for point in points)

    def sees(self, obj: WorldObject, point: Point, height_mm: float, viewpoint: Viewpoint) -> bool:
        """Return whether a point of an object is in a camera's view and no other object hides it."""
        return self._in_frame(point, height_mm, viewpoint) and not self._hidden(obj, point, height_mm, viewpoint)

    def _in_frame(self, point: Point, height_mm: float, viewpoint: Viewpoint) -> bool:
        """Return whether a point is in a camera's field of view; vertically only for a tilted or rolled camera."""
        if viewpoint.level:
            bearing_deg = _bearing_deg((viewpoint.x_mm, viewpoint.y_mm), point) - viewpoint.heading_deg
            return abs(wrapped_deg(bearing_deg)) <= self._hfov_deg / 2
        right, down, depth = in_camera_frame(*point, height_mm, viewpoint)
        reach = depth * math.tan(math.radians(self._hfov_deg / 2))
        return abs(right) <= reach and abs(down) <= reach * FRAME_ASPECT

    def _hidden(self, obj: WorldObject, point: Point, height_mm: float, viewpoint: Viewpoint) -> bool:
        rise_mm = height_mm - viewpoint.height_mm
        return any(
            other is not obj and other.height_mm > viewpoint.height_mm + rise_mm * hit.alpha
            for other, hit in self._rays.cast((viewpoint.x_mm, viewpoint.y_mm), point)
        )


def _bearing_deg(start: Point, end: Point) -> float:
    return math.degrees(math.atan2(end[1] - start[1], end[0] - start[0]))
