"""World files: a room, its objects and people, and its events.

A world file is TOML. Lengths are in millimetres, angles in degrees clockwise, times in seconds; the map has x to the
right and y down, heading 0 along +x. The bundled worlds in `sim_backend/worlds/` show every table.
Unknown keys are mistakes.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, Strict, field_validator, model_validator

from input_files.plain import at_home
from sim_backend.world.event_tables import Event
from sim_backend.world.sensor_tables import Magnet, Mount, Patch, Sound, Surroundings, Ultrasonic
from sim_backend.world.toml_types import (
    PAINTS,
    ROOM_M,
    Direction,
    Entries,
    Length,
    Name,
    Offset,
    Paint,
    Percent,
    Point,
    Positive,
    Size,
    Table,
    in_other_unit,
)

Degrees = Annotated[float, Field(ge=-180, le=180)]
SensorPort = Annotated[int, Field(ge=0, le=4)]

MIN_RADIUS_MM = 50
"""Of the robot's body."""
TINY_ROOM_MM = 1000.0
"""A room with no side longer than this is tiny."""
FRAME_DIAGONAL = 1.25
"""Diagonal of a 4:3 frame over its width."""
STEEPEST_DEG = 84.0
"""Largest elevation at the corner of a tilted camera's frame: the renderer cannot draw the zenith."""
STRONGEST_BARREL = 4 / 27
"""Largest -k1 r² of a corner at the distance r from the axis that r' (1 + k1 r'²) reaches for some r'."""


class Floor(Table):
    """The room: its floor from (0, 0) to `size_mm`, closed by four walls.

    Attributes:
        size_mm: Width and depth.
        color: Colour of the floor outside all patches, for light and colour sensors.
        wall_height_mm: Height of the four walls.
        wall_texture: Image file, or a built-in texture.
    """

    size_mm: Size
    color: Paint = PAINTS["grey"]
    wall_height_mm: Length = 600.0
    wall_texture: Name = "wall"

    @property
    def is_tiny(self) -> bool:
        """Whether it is too small to drive in; its size was probably meant in another unit."""
        return max(self.size_mm) <= TINY_ROOM_MM

    @field_validator("size_mm")
    @classmethod
    def _holds_a_robot(cls, size_mm: tuple[float, float]) -> tuple[float, float]:
        if min(size_mm) < 2 * MIN_RADIUS_MM:
            raise ValueError(f"no robot fits in; if that is {in_other_unit(size_mm, ROOM_M)}")
        return size_mm


class Light(Table):
    """Brightness of the room.

    Attributes:
        exposure: Factor on the camera's brightness; 1 is a well-lit room, 0.25 is dusk.
        drift_percent: How much the brightness for the camera rises and falls over time.
        drift_s: How long one rise and fall takes.
        ambient_percent: Reading of a light sensor that looks ahead with its lamp off.
    """

    exposure: Annotated[float, Field(gt=0, le=4)] = 1.0
    drift_percent: Annotated[float, Field(ge=0, le=95)] = 0.0
    drift_s: Annotated[float, Field(ge=0.1, le=86400)] = 60.0
    ambient_percent: Percent = 50.0


class Shade(Table):
    """A place where the camera's pictures are brighter or darker, such as before a window.

    Attributes:
        at_mm: Centre.
        radius_mm: Distance from the centre at which the effect ends; in between it falls linearly.
        exposure: Factor on the brightness at the centre.
    """

    at_mm: Point
    radius_mm: Length
    exposure: Annotated[float, Field(gt=0, le=20)]


class Computer(Table):
    """The computer that looks for the targets.

    Attributes:
        look_s: Computing time of each look, while the robot drives on.
    """

    look_s: Annotated[float, Field(ge=0, le=5)] = 0.0


class Slip(Table):
    """Differences between the wheels' counts and the true motion.

    Attributes:
        distance_percent: Share of the driven distance that is lost.
        turn_percent: Share of each turn that is lost.
        veer_deg_per_m: Turn per metre driven, positive right.
        jitter_percent: Standard deviation of a random factor, drawn per wheel every 10 ms.
    """

    distance_percent: Annotated[float, Field(gt=-50, lt=100)] = 0.0
    turn_percent: Annotated[float, Field(gt=-50, lt=100)] = 0.0
    veer_deg_per_m: Annotated[float, Field(ge=-3600, le=3600)] = 0.0
    jitter_percent: Annotated[float, Field(ge=0, le=100)] = 1.0


class Carpet(Table):
    """A rectangle of another floor, on which the wheels grip and slip in another way. Later ones cover earlier ones.

    Attributes:
        at_mm: Centre.
        size_mm: Extent along and across its facing.
        facing_deg: Direction of its length.
        grip: Coefficient of friction between tyres and carpet.
        drag_nm: Torque at each wheel that the pile costs.
        slip: Differences between counts and true motion there.
    """

    at_mm: Point
    size_mm: Size
    facing_deg: Direction = 0.0
    grip: Positive = 0.9
    drag_nm: Annotated[float, Field(ge=0, le=0.2)] = 0.0
    slip: Slip = Slip()


class Robot(Table):
    """Start pose, dimensions and ports of the robot.

    Attributes:
        start_mm: Middle of the wheel axle at the start.
        heading_deg: Heading at the start.
        radius_mm: Radius of the body, a disc around the middle of the axle.
        wheel_diameter_mm: By default, the tyre of the NXT set.
        track_mm: Distance between the wheels.
        mass_kg: Mass with brick and batteries.
        grip: Coefficient of friction between tyres and floor.
        motor_mismatch_percent: How much faster the right motor turns than the left at the same power.
        battery_mv: Battery voltage at rest; the motors' speed is proportional to it.
        battery_ohm: Internal resistance of the battery; the current of the motors lowers the voltage by it.
        battery_drain_mv_per_min: How fast the battery's voltage at rest falls.
        dead_zone_percent: Power below which friction holds the motors.
        backlash_deg: Play of the gears: how far a motor turns after a reversal before its wheel follows.
        left_port: Output port of the left wheel.
        right_port: Output port of the right wheel.
        touch_port: Input port of the front bumper, or 0 for none.
        ultrasonic_port: Input port of the ultrasonic sensor, or 0 for none.
        slip: Differences between counts and true motion.
    """

    start_mm: Point
    heading_deg: Direction = 0.0
    radius_mm: Annotated[float, Field(ge=MIN_RADIUS_MM, le=500)] = 115.0
    wheel_diameter_mm: Annotated[float, Field(ge=10, le=300)] = 56.0
    track_mm: Annotated[float, Field(ge=30, le=600)] = 112.0
    mass_kg: Positive = 0.75
    grip: Positive = 0.9
    motor_mismatch_percent: Annotated[float, Field(ge=-50, le=50)] = 1.5
    battery_mv: Annotated[int, Field(ge=5000, le=10000)] = 8000
    battery_ohm: Annotated[float, Field(ge=0, le=10)] = 0.0
    battery_drain_mv_per_min: Annotated[float, Field(ge=0, le=1000)] = 0.0
    dead_zone_percent: Annotated[int, Field(ge=0, le=50)] = 5
    backlash_deg: Annotated[float, Field(ge=0, le=60)] = 0.0
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
        hfov_deg: Horizontal field of view.
        height_mm: Height of the lens above the floor.
        forward_mm: Distance of the lens in front of the axle.
        right_mm: Distance of the lens to the right of the robot's middle.
        yaw_deg: Direction of the lens from the robot's front, positive right.
        tilt_deg: Elevation of the lens, positive up.
        roll_deg: Rotation about the optical axis, positive clockwise as seen from behind the camera.
        fps: Frames per second.
        latency_s: Delay from a frame's exposure to its delivery.
        drop_rate: Share of the frames that never arrive.
        distortion_k1: First radial distortion of the lens, as in OpenCV; negative is a barrel.
        readout_s: Rolling shutter: time from the exposure of the first row to that of the last.
        shutter_s: Time of the exposure; a frame taken in a turn is smeared by it.
        auto_exposure_s: Time constant with which the camera follows the brightness; 0 for a fixed exposure.
    """

    hfov_deg: Annotated[float, Field(ge=20, le=120)] = 60.0
    height_mm: Length = 200.0
    forward_mm: Offset = 60.0
    right_mm: Offset = 0.0
    yaw_deg: Degrees = 0.0
    tilt_deg: Annotated[float, Field(ge=-30, le=30)] = 0.0
    roll_deg: Degrees = 0.0
    fps: Annotated[int, Field(ge=1, le=60)] = 10
    latency_s: Annotated[float, Field(ge=0, le=5)] = 0.0
    drop_rate: Annotated[float, Field(ge=0, le=0.95)] = 0.0
    distortion_k1: Annotated[float, Field(ge=-0.5, le=1)] = 0.0
    readout_s: Annotated[float, Field(ge=0, le=0.2)] = 0.0
    shutter_s: Annotated[float, Field(ge=0, le=1)] = 0.02
    auto_exposure_s: Annotated[float, Field(ge=0, le=60)] = 0.0

    @model_validator(mode="after")
    def _can_be_drawn(self) -> Self:
        corner = FRAME_DIAGONAL * math.tan(math.radians(self.hfov_deg / 2))
        if self.distortion_k1 * corner**2 < -STRONGEST_BARREL:
            lowest = -STRONGEST_BARREL / corner**2
            raise ValueError(f"the corners show nothing; set distortion_k1 above {lowest:.3f} for this hfov_deg")
        real = corner  # of the ray that appears in the corner: a barrel sees farther
        for _ in range(8 if self.distortion_k1 < 0 else 0):  # Newton's method
            square = self.distortion_k1 * real**2
            real -= (real * (1 + square) - corner) / max(1 + 3 * square, 0.05)
        if self.tilt_deg and abs(self.tilt_deg) + math.degrees(math.atan(real)) > STEEPEST_DEG:
            raise ValueError(f"sees what is right above or below it; lower hfov_deg ({self.hfov_deg:g}) or tilt_deg")
        return self


class Wall(Table):
    """An inner wall.

    Attributes:
        from_mm: One end.
        to_mm: The other end.
        absorbs: Whether it absorbs ultrasound, as a curtain does.
    """

    from_mm: Point
    to_mm: Point
    absorbs: bool = False
    height_mm: Length = 600.0
    thickness_mm: Length = 20.0
    texture: Name = "wall"


class Box(Table):
    """A box on the floor; a low one stops the robot but hides no picture.

    Attributes:
        name: Name in events.
        at_mm: Centre.
        size_mm: Depth along the facing, and width.
        facing_deg: Direction of the front.
        texture: Image file, or a built-in texture.
        mass_kg: With a mass, the robot can push the box; otherwise it is fixed.
        absorbs: Whether it absorbs ultrasound, as cushions and stuffed toys do.
        present: Whether it is present at the start.
    """

    name: Name
    at_mm: Point
    size_mm: Size
    height_mm: Length
    facing_deg: Direction = 0.0
    mass_kg: Positive | None = None
    absorbs: bool = False
    texture: Name = "carton"
    present: bool = True


class Person(Table):
    """A person who comes and goes by events.

    Attributes:
        name: Name in events.
        enters_from_mm: Door where the person appears and disappears.
        radius_mm: Half of the body's width.
        speed_mm_s: Walking speed.
        absorbs: Whether the clothes absorb ultrasound.
    """

    name: Name
    enters_from_mm: Point
    radius_mm: Length = 180.0
    height_mm: Length = 1700.0
    speed_mm_s: Positive = 800.0
    absorbs: bool = False
    texture: Name = "person_blue"


class Picture(Table):
    """A picture on a stand.

    Attributes:
        name: Name in missions, and in the texture library unless `file` is given.
        at_mm: Centre.
        facing_deg: Direction of the front; a viewer must stand there.
        file: Image file; a relative path is from the world file's folder, ``~`` is the user's.
        size_mm: Width and height; A4 by default.
        centre_height_mm: Height of the centre above the floor.
        present: Whether it is present at the start.
    """

    name: Name
    at_mm: Point
    facing_deg: Direction
    file: Annotated[Path, Strict(False), AfterValidator(at_home)] | None = None
    size_mm: Size = (210.0, 297.0)
    centre_height_mm: Length = 200.0
    present: bool = True

    @model_validator(mode="after")
    def _above_the_floor(self) -> Self:
        if self.centre_height_mm < self.size_mm[1] / 2:
            raise ValueError(f"the lower edge is below the floor; raise centre_height_mm to {self.size_mm[1] / 2:g}")
        return self


class WorldFile(Table):
    """A whole world.

    Attributes:
        title: One-line description.
        sensors: Sensors on the robot other than the bumper and ultrasonic sensor of the table `robot`.
    """

    title: str = ""
    floor: Floor
    robot: Robot
    light: Light = Light()
    shades: Entries[Shade] = ()
    computer: Computer = Computer()
    camera: Camera = Camera()
    ultrasonic: Ultrasonic = Ultrasonic()
    surroundings: Surroundings = Surroundings()
    sensors: Entries[Mount] = ()
    carpets: Entries[Carpet] = ()
    patches: Entries[Patch] = ()
    sounds: Entries[Sound] = ()
    magnets: Entries[Magnet] = ()
    walls: Entries[Wall] = ()
    boxes: Entries[Box] = ()
    people: Entries[Person] = ()
    pictures: Entries[Picture] = ()
    events: Entries[Event] = ()
