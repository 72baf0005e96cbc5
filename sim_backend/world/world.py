"""The world of the simulated robot: a floor, what stands and walks on it, and what happens."""

from __future__ import annotations

import math
from random import Random

import pymunk

from sim_backend.camera.scene import Panel, Viewpoint
from sim_backend.world.people import PersonThing
from sim_backend.world.robot import RobotBody
from sim_backend.world.sensing import UltrasonicBeam, in_view
from sim_backend.world.sensor_tables import Echo
from sim_backend.world.story import INTERVAL_MS, Story
from sim_backend.world.surroundings import Surroundings
from sim_backend.world.tables import Point
from sim_backend.world.things import BoxThing, PictureThing, RoomThing, Thing, WallThing
from sim_backend.world.world_file import Box, Event, Person, Picture, WorldFile

STEP_MS = 10
_STEP_S = STEP_MS / 1000.0
BLOCKING_GAP_MM = 100.0
"""A person who blocks the robot's view leaves at least this gap."""


class World:
    """The state of a world, stepped every `STEP_MS`.

    Args:
        file: What the world consists of.
        seed: Seeds everything that is drawn: slip, sensor noise, durations of events.

    Attributes:
        file: As given.
        seed: As given.
        now_ms: Time since the start; a multiple of `STEP_MS`.
        robot: The robot's body.
        boxes: By name.
        pictures: By name.
        people: By name.
        story: The events.
        ultrasonic: The ultrasonic sensor.
        surroundings: What sensors without eyes perceive.
        contact_count: How often the robot has run into something or was run into.
    """

    def __init__(self, file: WorldFile, seed: int = 0) -> None:
        self.file, self.seed = file, seed
        self.now_ms = 0
        self.contact_count = 0
        self._space = space = pymunk.Space()
        # a stream of its own for each purpose: reading a sensor must not change how the wheels slip
        self.robot = RobotBody(space, file.robot, Random(f"{seed}/wheels"))
        self.boxes = {box.name: BoxThing(space, box) for box in file.boxes}
        self.pictures = {picture.name: PictureThing(space, picture) for picture in file.pictures}
        self.people = {person.name: PersonThing(space, person) for person in file.people}
        walls: list[Thing] = [RoomThing(space, file.floor), *(WallThing(space, wall) for wall in file.walls)]
        self._things: dict[str, BoxThing | PictureThing | PersonThing] = {**self.boxes, **self.pictures, **self.people}
        everything: list[Thing] = [*walls, *self._things.values()]
        self._heights_mm = {shape: thing.height_mm for thing in everything for shape in thing.shapes}
        self.ultrasonic = self.beam(file.ultrasonic, (file.ultrasonic.forward_mm, 0.0), 0.0, "ultrasonic")
        self.surroundings = Surroundings(file)
        self.story = Story(file.events, Random(f"{seed}/story"))
        self._wall_panels = tuple(panel for wall in walls for panel in wall.panels())
        self._panels: tuple[Panel, ...] | None = None
        self._pushable = [box for box in self.boxes.values() if box.movable]
        self._stirred = False

    def beam(self, sensor: Echo, at_mm: Point, direction_deg: float, name: str) -> UltrasonicBeam:
        """What an ultrasonic sensor somewhere on the robot hears; `name` keeps its luck apart from the others'."""
        random = Random(f"{self.seed}/{name}")
        return UltrasonicBeam(self._space, sensor, self.robot, at_mm, direction_deg, self._heights_mm, random)

    @property
    def quiet(self) -> bool:
        """Whether nothing moves; then only the story and the wheels can change anything."""
        return (
            self.robot.at_rest
            and not any(person.walking for person in self.people.values())
            and all(box.at_rest for box in self._pushable)
        )

    def step(self) -> None:
        """Let `STEP_MS` pass."""
        self.now_ms += STEP_MS
        if self._stirred or not self.quiet:
            self._stirred = False
            self._move()
        if self.now_ms % INTERVAL_MS == 0:
            self._tell_story()

    def _move(self) -> None:
        robot = self.robot
        for person in self.people.values():
            if person.walking:
                person.walk(self.now_ms, _STEP_S, (robot.x_mm, robot.y_mm), self.file.robot.radius_mm)
                self._panels = None
        touching = bool(robot.contact_bearings_deg)
        robot.drive(_STEP_S)
        self._space.step(_STEP_S)
        robot.settle()
        self.contact_count += bool(robot.contact_bearings_deg) and not touching
        if not all(box.at_rest for box in self._pushable):
            self._panels = None

    def _tell_story(self) -> None:
        for person in self.people.values():
            person.decide(self.now_ms)
        self.story.advance(self.now_ms, self)

    def panels(self) -> tuple[Panel, ...]:
        """Everything the camera could see; the same tuple as long as nothing but the robot moves."""
        if self._panels is None:
            moving = (panel for thing in self._things.values() for panel in thing.panels())
            self._panels = (*self._wall_panels, *moving)
        return self._panels

    def viewpoint(self) -> Viewpoint:
        """Where the camera's lens is."""
        camera = self.file.camera
        x, y = self.robot.point_mm((camera.forward_mm, 0.0))
        return Viewpoint(x, y, self.robot.heading_deg, camera.height_mm)

    def in_view(self, picture: str) -> bool:
        """Whether the robot's camera could see the picture now."""
        camera = self.file.camera
        return in_view(self._space, self.pictures[picture], self.viewpoint(), camera.hfov_deg, self._heights_mm)

    def robot_distance_mm(self, name: str) -> float:
        """From the robot's middle to the middle of a thing."""
        return math.dist((self.robot.x_mm, self.robot.y_mm), self._things[name].at_mm)

    def add(self, table: Box | Picture | Person) -> None:
        """Bring in something that the world file does not have; its name must be free.

        Raises:
            ValueError: The name is taken.
        """
        if table.name in self._things:
            raise ValueError(f"there is a {table.name!r} in the world already")
        thing: BoxThing | PictureThing | PersonThing
        match table:
            case Box():
                thing = self.boxes[table.name] = BoxThing(self._space, table)
                if thing.movable:
                    self._pushable.append(thing)
            case Picture():
                thing = self.pictures[table.name] = PictureThing(self._space, table)
            case Person():
                thing = self.people[table.name] = PersonThing(self._space, table)
        self._things[table.name] = thing
        self._heights_mm.update(dict.fromkeys(thing.shapes, thing.height_mm))
        self._stir()

    def place(self, name: str, at_mm: Point | None, facing_deg: float | None, *, present: bool) -> None:
        """Have a thing be somewhere at once, or be gone; None keeps place or facing, people have no facing."""
        thing = self._things[name]
        if not isinstance(thing, PersonThing):
            thing.place(at_mm, facing_deg, present=present)
        elif present:
            thing.stand(thing.at_mm if at_mm is None else at_mm)
        else:
            thing.vanish()
        self._stir()

    def place_robot(self, at_mm: Point, heading_deg: float) -> None:
        """Put the robot down elsewhere."""
        self.robot.place(at_mm, heading_deg)
        self._stir()

    def _stir(self) -> None:
        """Something was moved by hand: it looks different, and may touch what it did not touch before."""
        self._panels, self._stirred = None, True

    def perform(self, event: Event, stays_ms: int | None) -> None:
        """Do what the event says."""
        self._panels = None
        thing = self._things[event.subject]
        place = event.to_mm
        if event.blocks is not None:
            place = self._place_before(event.blocks, event.blocks_at_mm, thing.radius_mm)
        if not isinstance(thing, PersonThing):
            thing.place(place, event.facing_deg, present=event.present)
        elif place is None:
            thing.leave()
        else:
            thing.come(place, stays_ms)

    def is_over(self, event: Event) -> bool:
        """Whether the person of a performed event has gone again; other events are over at once."""
        return event.person is None or not self.people[event.person].present

    def _place_before(self, picture: str, distance_mm: float, radius_mm: float) -> Point:
        """On the line from a picture to the robot, `distance_mm` from the picture, but not on the robot."""
        x, y = self.pictures[picture].at_mm
        way_x, way_y = self.robot.x_mm - x, self.robot.y_mm - y
        way_mm = math.hypot(way_x, way_y)
        room_mm = way_mm - radius_mm - self.file.robot.radius_mm - BLOCKING_GAP_MM
        share = max(0.0, min(distance_mm, room_mm)) / max(way_mm, 1.0)
        return x + share * way_x, y + share * way_y
