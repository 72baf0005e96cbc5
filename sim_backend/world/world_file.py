"""World files: a room, what stands in it, and what happens there.

A world file is TOML. Lengths are millimetres, angles degrees clockwise, times seconds; the map has x to the right and y
down, heading 0 along +x. The bundled worlds in `sim_backend/worlds/` show every table. Unknown keys are mistakes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sim_backend.world.sensor_tables import Magnet, Mount, Patch, Sound, Surroundings, Ultrasonic
from sim_backend.world.toml_types import PAINTS, Duration, Length, Name, Paint, Percent, Point, Seconds, Table

SensorPort = Annotated[int, Field(ge=0, le=4)]


class Floor(Table):
    """The room: its floor from (0, 0) to `size_mm`, closed by four walls.

    Attributes:
        color: What light and colour sensors see where no patch lies.
    """

    size_mm: tuple[Length, Length]
    color: Paint = PAINTS["grey"]
    wall_height_mm: Length = 600.0
    wall_texture: Name = "wall"


class Light(Table):
    """How bright the room is.

    Attributes:
        exposure: Factor on the camera's brightness; 1 is a well-lit room, 0.25 is dusk.
        ambient_percent: What a light sensor that looks ahead with its lamp off reads.
    """

    exposure: Annotated[float, Field(gt=0, le=4)] = 1.0
    ambient_percent: Percent = 50.0


class Slip(Table):
    """How far the wheels' counts and the true motion differ.

    Attributes:
        distance_percent: Part of the driven distance that is lost.
        turn_percent: Part of each turn that is lost.
        veer_deg_per_m: Turn (positive right) for each metre driven.
        jitter_percent: Standard deviation of a random loss or gain, drawn for each wheel and each 10 ms.
    """

    distance_percent: Annotated[float, Field(gt=-50, lt=100)] = 0.0
    turn_percent: Annotated[float, Field(gt=-50, lt=100)] = 0.0
    veer_deg_per_m: float = 0.0
    jitter_percent: Annotated[float, Field(ge=0, le=100)] = 1.0


class Robot(Table):
    """Where the robot starts, how it is built and plugged.

    Attributes:
        start_mm: Middle of the wheel axle at the start.
        heading_deg: Where it looks at the start.
        radius_mm: Radius of the body, a disc around the middle of the axle.
        wheel_diameter_mm: The tyre of the standard set by default.
        track_mm: Distance between the wheels.
        mass_kg: With brick and batteries.
        grip: Coefficient of friction between tyres and floor.
        motor_mismatch_percent: How much faster the right motor turns than the left at the same power.
        battery_mv: Battery voltage; the motors' speed is proportional to it.
        left_port: Output port of the left wheel.
        right_port: Output port of the right wheel.
        touch_port: Input port of the front bumper, or 0 for none.
        ultrasonic_port: Input port of the ultrasonic sensor, or 0 for none.
        slip: How far counts and true motion differ.
    """

    start_mm: Point
    heading_deg: float = 0.0
    radius_mm: Length = 115.0
    wheel_diameter_mm: Length = 56.0
    track_mm: Length = 112.0
    mass_kg: Length = 0.75
    grip: Length = 0.9
    motor_mismatch_percent: Annotated[float, Field(ge=-50, le=50)] = 1.5
    battery_mv: Annotated[int, Field(ge=5000, le=10000)] = 8000
    left_port: Literal["A", "B", "C"] = "B"
    right_port: Literal["A", "B", "C"] = "C"
    touch_port: SensorPort = 1
    ultrasonic_port: SensorPort = 4
    slip: Slip = Slip()

    @model_validator(mode="after")
    def _ports_differ(self) -> Self:
        if self.left_port == self.right_port:
            raise ValueError(f"left_port and right_port are both {self.left_port}; give each motor its own port")
        if self.touch_port == self.ultrasonic_port != 0:
            raise ValueError(f"touch_port and ultrasonic_port are both {self.touch_port}; give each sensor its own")
        return self


class Camera(Table):
    """The webcam on the robot.

    Attributes:
        hfov_deg: Horizontal angle of view.
        height_mm: Lens above the floor.
        forward_mm: Lens in front of the axle.
        fps: Frames per second.
    """

    hfov_deg: Annotated[float, Field(ge=20, le=120)] = 60.0
    height_mm: Length = 200.0
    forward_mm: float = 60.0
    fps: Annotated[int, Field(ge=1, le=60)] = 10


class Wall(Table):
    """An inner wall."""

    from_mm: Point
    to_mm: Point
    height_mm: Length = 600.0
    thickness_mm: Length = 20.0
    texture: Name = "wall"


class Box(Table):
    """A box on the floor; low ones stop the robot but hide no picture.

    Attributes:
        at_mm: Middle of the box.
        size_mm: Depth along its facing, and width.
        facing_deg: Direction of its front.
        mass_kg: If given, the robot can push it; else it stands fast.
        present: Whether it is there at the start.
    """

    name: Name
    at_mm: Point
    size_mm: tuple[Length, Length]
    height_mm: Length
    facing_deg: float = 0.0
    mass_kg: Length | None = None
    texture: Name = "carton"
    present: bool = True


class Person(Table):
    """Somebody who comes and goes by events.

    Attributes:
        enters_from_mm: Where the person appears and disappears: a door.
        radius_mm: Half the width of the body.
        speed_mm_s: Walking speed.
    """

    name: Name
    enters_from_mm: Point
    radius_mm: Length = 180.0
    height_mm: Length = 1700.0
    speed_mm_s: Length = 800.0
    texture: Name = "person_blue"


class Picture(Table):
    """A picture on a stand.

    Attributes:
        name: What missions call it, and its name in the texture library unless `file` is given.
        at_mm: Middle of the picture.
        facing_deg: Direction the picture looks to; a viewer must stand there.
        file: Image file beside the world file.
        size_mm: Width and height; A4 unless said otherwise.
        centre_height_mm: Middle of the picture above the floor.
        present: Whether it is there at the start.
    """

    name: Name
    at_mm: Point
    facing_deg: float
    file: Path | None = None
    size_mm: tuple[Length, Length] = (210.0, 297.0)
    centre_height_mm: Length = 200.0
    present: bool = True

    @model_validator(mode="after")
    def _above_the_floor(self) -> Self:
        if self.centre_height_mm < self.size_mm[1] / 2:
            raise ValueError(f"the lower edge is below the floor; raise centre_height_mm to {self.size_mm[1] / 2:g}")
        return self


class When(Table):
    """When an event happens: as soon as everything given here holds at the same time.

    Attributes:
        at_s: This much time of the simulation has passed.
        after: The event of this name has begun.
        after_end_of: The event of this name is over (the person has left again).
        delay_s: And since then this much time has passed.
        sees: The picture of this name is in the camera's view now.
        for_s: And has been, in all, for this long since the event became possible.
        view_number: And this is at least the n-th time it came into view.
        of: What the robot's distance is measured from, a picture, box or person; the picture of `sees` by default.
        robot_within_mm: The robot's middle is nearer than this.
        robot_beyond_mm: The robot's middle is farther than this.
    """

    at_s: Seconds | None = None
    after: Name | None = None
    after_end_of: Name | None = None
    delay_s: Duration = (0.0, 0.0)
    sees: Name | None = None
    for_s: Duration = (0.0, 0.0)
    view_number: Annotated[int, Field(ge=1)] = 1
    of: Name | None = None
    robot_within_mm: Length | None = None
    robot_beyond_mm: Length | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if all(condition is None for condition in (self.at_s, self.after, self.after_end_of, self.sees, self.of)):
            raise ValueError("says nothing; give at_s, after, after_end_of, sees, or of with a distance")
        if self.after is not None and self.after_end_of is not None:
            raise ValueError("after and after_end_of exclude each other")
        near, far = self.robot_within_mm, self.robot_beyond_mm
        if (near is not None or far is not None) and self.of is None and self.sees is None:
            raise ValueError("robot_within_mm and robot_beyond_mm need `of` (or `sees`): the distance from what?")
        if near is not None and far is not None and near <= far:
            raise ValueError("robot_within_mm must be more than robot_beyond_mm")
        return self


class Event(Table):
    """Something that happens: a person comes or leaves, a picture or box moves, appears or disappears.

    Attributes:
        name: For other events to refer to.
        when: The trigger.
        times: How often at most; 0 for no limit.
        person: Who comes; with `to_mm` or `blocks`, and `stays_s`; or with `leaves`.
        picture: Which picture moves or (dis)appears.
        box: Which box moves or (dis)appears.
        to_mm: Where to.
        facing_deg: New facing of a picture or box.
        blocks: The person or box stands between the robot and this picture.
        blocks_at_mm: That far in front of the picture.
        stays_s: How long the person stays once there; without it, until an event says `leaves`.
        leaves: The person goes now.
        present: Whether the picture or box is there from now on.
    """

    name: Name
    when: When
    times: Annotated[int, Field(ge=0)] = 1
    person: Name | None = None
    picture: Name | None = None
    box: Name | None = None
    to_mm: Point | None = None
    facing_deg: float | None = None
    blocks: Name | None = None
    blocks_at_mm: Length = 600.0
    stays_s: Duration | None = None
    leaves: bool = False
    present: bool = True

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if sum(subject is not None for subject in (self.person, self.picture, self.box)) != 1:
            raise ValueError("must name exactly one of person, picture and box")
        if self.person is not None and (self.to_mm is not None or self.blocks is not None) == self.leaves:
            raise ValueError("a person needs exactly one of to_mm, blocks and leaves")
        if self.person is None and (self.leaves or self.stays_s is not None):
            raise ValueError("stays_s and leaves are for persons")
        if self.picture is not None and self.blocks is not None:
            raise ValueError("blocks is for persons and boxes")
        if self.to_mm is not None and self.blocks is not None:
            raise ValueError("to_mm and blocks exclude each other")
        return self

    @property
    def subject(self) -> str:
        """Name of the person, picture or box."""
        return self.person or self.picture or self.box or ""


class WorldFile(Table):
    """A whole world.

    Attributes:
        title: One line for people.
        sensors: On the robot, besides the bumper and the ultrasonic sensor that `robot` names the ports of.
    """

    title: str = ""
    floor: Floor
    robot: Robot
    light: Light = Light()
    camera: Camera = Camera()
    ultrasonic: Ultrasonic = Ultrasonic()
    surroundings: Surroundings = Surroundings()
    sensors: tuple[Mount, ...] = ()
    patches: tuple[Patch, ...] = ()
    sounds: tuple[Sound, ...] = ()
    magnets: tuple[Magnet, ...] = ()
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    people: tuple[Person, ...] = ()
    pictures: tuple[Picture, ...] = ()
    events: tuple[Event, ...] = ()
