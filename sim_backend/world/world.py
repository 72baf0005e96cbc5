"""The world of the simulated robot: the floor, the objects and people on it, and the events."""

from __future__ import annotations

import math
from random import Random

import pymunk

from sim_backend.camera.scene import Panel, Viewpoint
from sim_backend.world.disturbances import Disturbances
from sim_backend.world.event_tables import Event
from sim_backend.world.objects import (
    WAIT_GAP_MM,
    BoxObject,
    PictureObject,
    PlacedObject,
    RoomObject,
    WallObject,
    WorldObject,
)
from sim_backend.world.people import PersonObject
from sim_backend.world.robot import RobotBody
from sim_backend.world.scheduler import INTERVAL_MS, EventScheduler
from sim_backend.world.sensing import LinesOfSight, RayCaster, UltrasonicBeam
from sim_backend.world.sensor_tables import EchoSettings
from sim_backend.world.surroundings import LocalConditions
from sim_backend.world.toml_types import Point
from sim_backend.world.world_file import Box, Person, Picture, WorldFile

STEP_MS = 10
_STEP_S = STEP_MS / 1000.0
LIFTED_MM = 300.0
"""How high the robot is held while it is carried. A guess."""
BLOCKING_GAP_MM = 100.0
"""A person or box that blocks the view keeps at least this distance from the robot."""


class World:
    """The state of a world, stepped every `STEP_MS`.

    Args:
        file: The world file.
        seed: Seeds all random draws: slip, sensor noise, durations of events.

    Attributes:
        file: As given.
        seed: As given.
        now_ms: Time since the start; a multiple of `STEP_MS`.
        robot: The robot's body.
        disturbances: Effects of events on the robot itself.
        boxes: By name.
        pictures: By name.
        people: By name.
        scheduler: The events.
        ultrasonic: The ultrasonic sensor.
        surroundings: What light, sound, temperature and compass sensors measure.
        generators: All random generators of the world.
        contact_count: How often the robot has come into contact with something.
    """

    def __init__(self, file: WorldFile, seed: int = 0) -> None:
        self.file, self.seed = file, seed
        self.now_ms = 0
        self.contact_count = 0
        self.generators: list[Random] = []
        self._space = space = pymunk.Space()
        # a separate stream for each purpose: reading a sensor must not change how the wheels slip
        self.robot = RobotBody(space, file.robot, self._random("wheels"), file.carpets)
        self.disturbances = Disturbances(self.robot)
        self.boxes = {box.name: BoxObject(space, box) for box in file.boxes}
        self.pictures = {picture.name: PictureObject(space, picture) for picture in file.pictures}
        self.people = {person.name: PersonObject(space, person) for person in file.people}
        walls: list[WorldObject] = [RoomObject(space, file.floor), *(WallObject(space, wall) for wall in file.walls)]
        self._objects: dict[str, BoxObject | PictureObject | PersonObject] = {
            **self.boxes,
            **self.pictures,
            **self.people,
        }
        self._rays = RayCaster(space, [*walls, *self._objects.values()])
        self._sight = LinesOfSight(self._rays, file.camera.hfov_deg)
        self.ultrasonic = self.beam(file.ultrasonic, (file.ultrasonic.forward_mm, 0.0), 0.0, "ultrasonic")
        self.surroundings = LocalConditions(file)
        # the purpose is part of the seed: under another name, every room with events would continue in another way
        self.scheduler = EventScheduler(file.events, self._random("story"))
        self._wall_panels = tuple(panel for wall in walls for panel in wall.panels())
        self._panels: tuple[Panel, ...] | None = None
        self._pushable = [box for box in self.boxes.values() if box.movable]
        self._riders = {self.pictures[each.picture] for each in file.events if each.speed_mm_s and each.picture}
        self._rearranged = False

    def beam(self, sensor: EchoSettings, at_mm: Point, direction_deg: float, name: str) -> UltrasonicBeam:
        """Make the beam of an ultrasonic sensor on the robot; `name` selects its own random stream."""
        return UltrasonicBeam(self._rays, sensor, self.robot, at_mm, direction_deg, self._random(name))

    def _random(self, purpose: str) -> Random:
        """Return a generator of its own for one purpose."""
        random = Random(f"{self.seed}/{purpose}")
        self.generators.append(random)
        return random

    @property
    def quiet(self) -> bool:
        """Whether nothing moves; then only events and the wheels can change anything."""
        return (
            self.robot.at_rest
            and not any(person.walking for person in self.people.values())
            and all(box.at_rest for box in self._pushable)
            and not any(picture.rides for picture in self._riders)
        )

    def step(self) -> None:
        """Advance the world by `STEP_MS`."""
        self.now_ms += STEP_MS
        if self._rearranged or not self.quiet:
            self._rearranged = False
            self._move()
        if self.now_ms % INTERVAL_MS == 0:
            self._run_events()

    def _move(self) -> None:
        robot = self.robot
        for person in self.people.values():
            if person.walking:
                person.walk(self.now_ms, _STEP_S, (robot.x_mm, robot.y_mm), self.file.robot.radius_mm)
                self._panels = None
        for picture in self._riders:
            if picture.rides:
                reach_mm = picture.radius_mm + self.file.robot.radius_mm + WAIT_GAP_MM
                picture.move_on(_STEP_S, reach_mm, (robot.x_mm, robot.y_mm))
                self._panels = None
        if robot.lifted:
            robot.carry(self.now_ms)
        touching = bool(robot.contact_bearings_deg)
        robot.drive(_STEP_S)
        self._space.step(_STEP_S)
        robot.update_contacts()
        self.contact_count += bool(robot.contact_bearings_deg) and not touching
        if not all(box.at_rest for box in self._pushable):
            self._panels = None

    def _run_events(self) -> None:
        self.disturbances.advance(self.now_ms)
        for person in self.people.values():
            person.decide(self.now_ms)
        self.scheduler.advance(self.now_ms, self)

    def panels(self) -> tuple[Panel, ...]:
        """Return all surfaces the camera could see; the same tuple until something other than the robot moves."""
        if self._panels is None:
            moving = (panel for obj in self._objects.values() for panel in obj.panels())
            self._panels = (*self._wall_panels, *moving)
        return self._panels

    def viewpoint(self) -> Viewpoint:
        """Return where the camera's lens is."""
        camera = self.file.camera
        x, y = self.robot.point_mm((camera.forward_mm, camera.right_mm))
        heading_deg = self.robot.heading_deg + camera.yaw_deg + self.disturbances.yaw_deg
        height_mm = camera.height_mm + (LIFTED_MM if self.robot.lifted else 0.0)
        return Viewpoint(x, y, heading_deg, height_mm, camera.tilt_deg, camera.roll_deg)

    def in_view(self, picture: str, viewpoint: Viewpoint | None = None) -> bool:
        """Return whether the robot's camera could see the picture now, or would if it were at `viewpoint`."""
        return self._sight.in_view(self.pictures[picture], viewpoint or self.viewpoint())

    def sees(self, obj: PictureObject | BoxObject | PersonObject) -> bool:
        """Return whether a picture's front, or the middle of a box or person, is in the robot's view and not hidden."""
        if isinstance(obj, PictureObject):
            return self._sight.shows(obj, self.viewpoint())
        return obj.present and self._sight.sees(obj, obj.at_mm, obj.height_mm / 2, self.viewpoint())

    def robot_distance_mm(self, name: str) -> float:
        """Return the distance between the centres of the robot and an object."""
        return math.dist((self.robot.x_mm, self.robot.y_mm), self._objects[name].at_mm)

    def add(self, table: Box | Picture | Person) -> None:
        """Add an object or person that is not in the world file.

        Raises:
            ValueError: The name is taken.
        """
        if table.name in self._objects:
            raise ValueError(f"the world already has a {table.name!r}")
        obj: PlacedObject | PersonObject
        match table:
            case Box():
                obj = self.boxes[table.name] = BoxObject(self._space, table)
                if obj.movable:
                    self._pushable.append(obj)
            case Picture():
                obj = self.pictures[table.name] = PictureObject(self._space, table)
            case Person():
                obj = self.people[table.name] = PersonObject(self._space, table)
        self._objects[table.name] = obj
        self._rays.add(obj)
        self._refresh()

    def place(self, name: str, at_mm: Point | None, facing_deg: float | None, *, present: bool) -> None:
        """Move an object or person at once, or remove it; None keeps position or facing. People have no facing."""
        obj = self._objects[name]
        if not isinstance(obj, PersonObject):
            obj.place(at_mm, facing_deg, present=present)
        elif present:
            obj.stand(obj.at_mm if at_mm is None else at_mm)
        else:
            obj.vanish()
        self._refresh()

    def place_robot(self, at_mm: Point, heading_deg: float) -> None:
        """Move the robot to another pose."""
        self.robot.place(at_mm, heading_deg)
        self._refresh()

    def _refresh(self) -> None:
        """Invalidate the panels and step the physics once: a moved object looks different and may touch others."""
        self._panels, self._rearranged = None, True

    def perform(self, event: Event, stays_ms: int | None) -> None:
        """Perform the event."""
        if not event.subject:
            self.disturbances.begin(event, stays_ms, self.now_ms)
            return
        self._panels = None
        obj = self._objects[event.subject]
        place = event.to_mm
        if event.blocks is not None:
            place = self._place_before(event.blocks, event.blocks_at_mm, obj.radius_mm)
        if not isinstance(obj, PersonObject):
            if event.speed_mm_s is not None and place is not None:
                obj.ride(place, event.facing_deg, event.speed_mm_s)
            else:
                obj.place(place, event.facing_deg, present=event.present)
        elif place is None:
            obj.leave()
        else:
            obj.come(place, stays_ms)

    def is_over(self, event: Event) -> bool:
        """Return whether the event's effect has ended; an instantaneous move is over at once."""
        if not event.subject:
            return self.disturbances.ended(event)
        if event.picture is not None:
            return not self.pictures[event.picture].rides
        return event.person is None or not self.people[event.person].present

    def _place_before(self, picture: str, distance_mm: float, radius_mm: float) -> Point:
        """Return the place `distance_mm` from a picture on the line to the robot, but clear of the robot."""
        x, y = self.pictures[picture].at_mm
        dx, dy = self.robot.x_mm - x, self.robot.y_mm - y
        apart_mm = math.hypot(dx, dy)
        room_mm = apart_mm - radius_mm - self.file.robot.radius_mm - BLOCKING_GAP_MM
        share = max(0.0, min(distance_mm, room_mm)) / max(apart_mm, 1.0)
        return x + share * dx, y + share * dy
