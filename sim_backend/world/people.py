"""People who walk into the room, stay for a while and leave."""

from __future__ import annotations

import math

import pymunk

from sim_backend.camera.scene import Panel, standing_panels
from sim_backend.world.objects import WAIT_GAP_MM, blocked_by
from sim_backend.world.toml_types import Point
from sim_backend.world.world_file import Person


class PersonObject:
    """A person: an upright cylinder that walks straight from the door to a place and back.

    Attributes:
        name: As in the world file.
        height_mm: Height of the body.
        texture: Name of the clothes in the texture library.
        absorbs: Whether the clothes absorb ultrasound.
        present: Whether the person is in the room.
        walking: Whether the person is on the move.
        shapes: Outline in the physics.
    """

    def __init__(self, space: pymunk.Space, person: Person) -> None:
        self.name, self.height_mm, self._person = person.name, person.height_mm, person
        self.radius_mm, self.texture, self.absorbs = person.radius_mm, person.texture, person.absorbs
        self.present = self.walking = False
        self._space = space
        self._body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self._body.position = person.enters_from_mm
        shape = pymunk.Circle(self._body, person.radius_mm)
        shape.friction = 0.5
        self.shapes: tuple[pymunk.Shape, ...] = (shape,)
        self._goal = person.enters_from_mm
        self._stays_ms: int | None = None
        self._leaves_at_ms: int | None = None
        self._leaving = False

    @property
    def at_mm(self) -> Point:
        """Position on the map."""
        return float(self._body.position.x), float(self._body.position.y)

    def come(self, to_mm: Point, stays_ms: int | None) -> None:
        """Walk to a place and stay there for `stays_ms`, or indefinitely if it is None."""
        if not self.present:
            self._body.position = self._person.enters_from_mm
            self._space.add(self._body, *self.shapes)
        self.present = self.walking = True
        self._goal, self._stays_ms, self._leaves_at_ms, self._leaving = to_mm, stays_ms, None, False

    def stand(self, at_mm: Point) -> None:
        """Appear at a place at once, and stay."""
        self.vanish()
        self._body.position, self._body.velocity = at_mm, (0.0, 0.0)
        self._space.add(self._body, *self.shapes)
        self.present, self._leaves_at_ms = True, None

    def vanish(self) -> None:
        """Disappear at once."""
        if self.present:
            self._space.remove(self._body, *self.shapes)
        self.present = self.walking = False

    def leave(self) -> None:
        """Walk back to the door and leave the room."""
        if self.present:
            self._goal, self._leaves_at_ms = self._person.enters_from_mm, None
            self._leaving = self.walking = True

    def decide(self, now_ms: int) -> None:
        """Start to leave when the stay is over."""
        if self._leaves_at_ms is not None and now_ms >= self._leaves_at_ms:
            self.leave()

    def walk(self, now_ms: int, duration_s: float, robot_mm: Point, robot_radius_mm: float) -> None:
        """Set the velocity for the next `duration_s`: walk on, arrive, or wait for the robot to pass."""
        x, y = self.at_mm
        dx, dy = self._goal[0] - x, self._goal[1] - y
        distance = math.hypot(dx, dy)
        if distance <= self._person.speed_mm_s * duration_s:
            self._arrive(now_ms)
            return
        pace = self._person.speed_mm_s / distance
        waits = blocked_by(robot_mm, (x, y), self._goal, self.radius_mm + robot_radius_mm + WAIT_GAP_MM)
        self._body.velocity = (0.0, 0.0) if waits else (dx * pace, dy * pace)

    def _arrive(self, now_ms: int) -> None:
        self._body.position, self._body.velocity = self._goal, (0.0, 0.0)
        self.walking = False
        if self._leaving:
            self.vanish()
            return
        self._space.reindex_shapes_for_body(self._body)
        if self._stays_ms is not None:
            self._leaves_at_ms = now_ms + self._stays_ms

    def panels(self) -> list[Panel]:
        """Return six upright sides."""
        if not self.present:
            return []
        x, y = self.at_mm
        angles = [math.radians(60 * side) for side in range(6)]
        corners = [(x + self.radius_mm * math.cos(a), y + self.radius_mm * math.sin(a)) for a in angles]
        return standing_panels(corners, self.height_mm, self._person.texture)
