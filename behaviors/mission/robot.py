"""How the robot is built: the tables [robot] and [camera] of a mission file, and the robot file with the same tables.

Directions: positive is right, clockwise seen from above, and clockwise for an observer who looks along the camera;
a positive tilt looks up. Places are measured from the middle between the wheels.
"""

from __future__ import annotations

import datetime
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from behaviors.mission.cross_checks import cross_checks
from behaviors.mission.mistakes import mistakes
from behaviors.ports import Pose
from input_files.mistakes import MistakesError, is_foreign, listed
from input_files.plain import InputFileError
from input_files.toml_file import read_toml

OutputPort = Literal["A", "B", "C"]
ColorName = Literal["red", "orange", "yellow", "green", "cyan", "blue", "magenta"]
InputPort = Literal[0, 1, 2, 3, 4]
CALIBRATED = ("camera", "wheels", "sonar", "motors")
"""What can be calibrated."""
ROBOT_VARIABLE = "NXT_ROBOT"
"""The environment variable that names a robot file for missions that name none."""


def brick_id(bluetooth_address: str) -> str:
    """Return a brick's address as robot files have it."""
    return bluetooth_address.replace(":", "")


class RobotFileError(MistakesError):
    """A robot file with mistakes; the message lists all of them, one per line, each with its path and what to do."""


class Table(BaseModel):
    """A table of a mission or robot file."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class RobotTable(Table):
    """How the robot is built.

    Attributes:
        left: Output port of the left wheel.
        right: Output port of the right wheel.
        left_reversed: Whether positive power drives the left wheel backwards.
        right_reversed: The same for the right wheel.
        ultrasonic: Input port of the ultrasonic sensor; 0 for none.
        touch: Input port of the bumper; 0 for none.
        compass: Input port of a compass that corrects the heading; 0 for none.
        wheel_diameter_mm: Diameter of the wheels; 56 is the NXT set's.
        wheel_mismatch_percent: How much larger the right wheel is than the left one; the diameter is their mean.
        axle_track_mm: Distance between the centres of the wheels.
        turn_slip_percent: Share of each turn on the spot that the wheels lose by slipping.
        radius_mm: Radius of the circle around the midpoint between the wheels that holds the whole robot.
        sonar_forward_mm: How far the ultrasonic sensor is in front of the axle.
        sonar_height_mm: Its height above the floor; what is lower may give no echo.
        sonar_cone_deg: Full angle of its beam.
        stop_distance_mm: Distance ahead at which the safety stop acts.
    """

    left: OutputPort = "B"
    right: OutputPort = "C"
    left_reversed: bool = False
    right_reversed: bool = False
    ultrasonic: InputPort = 4
    touch: InputPort = 1
    compass: InputPort = 0
    wheel_diameter_mm: float = Field(default=56.0, ge=10, le=300)
    wheel_mismatch_percent: float = Field(default=0.0, ge=-20, le=20)
    axle_track_mm: float = Field(default=112.0, ge=30, le=600)
    turn_slip_percent: float = Field(default=0.0, ge=-20, le=50)
    radius_mm: float = Field(default=130.0, ge=50, le=500)
    sonar_forward_mm: float = Field(default=100.0, ge=-300, le=500)
    sonar_height_mm: float = Field(default=90.0, ge=10, le=1000)
    sonar_cone_deg: float = Field(default=30.0, ge=4, le=90)
    stop_distance_mm: float = Field(default=200.0, ge=30, le=1000)

    @property
    def turning_track_mm(self) -> float:
        """Distance between the wheels of a robot that turns as far without slip."""
        return self.axle_track_mm / (1 - self.turn_slip_percent / 100)


FRAME_ASPECT = 3 / 4
"""Height over width of the frames of usual cameras."""
MEASURED_PLACE = frozenset({"forward_mm", "height_mm"})
"""Keys of [camera] whose values are measured ones if they are given, and guesses otherwise."""


class CameraTable(Table):
    """The camera on the robot.

    Attributes:
        hfov_deg: Horizontal field of view.
        forward_mm: How far the lens is in front of the axle.
        right_mm: How far the lens is to the right of the midpoint between the wheels.
        height_mm: Height of the lens above the floor; with the tilt it shows whether a target is lower than the sonar,
            and how far away one of unknown height is.
        yaw_deg: How far the camera looks to the right.
        tilt_deg: How far it looks up; negative is down.
        roll_deg: How far it is turned clockwise about its line of sight.
        latency_s: Time from the exposure of a frame to its arrival.
    """

    hfov_deg: float = Field(default=60.0, ge=20, le=140)
    forward_mm: float = Field(default=0.0, ge=-500, le=500)
    right_mm: float = Field(default=0.0, ge=-300, le=300)
    height_mm: float = Field(default=200.0, ge=10, le=2000)
    yaw_deg: float = Field(default=0.0, ge=-60, le=60)
    tilt_deg: float = Field(default=0.0, ge=-45, le=45)
    roll_deg: float = Field(default=0.0, ge=-45, le=45)
    latency_s: float = Field(default=0.0, ge=0, le=2)

    def lens_at(self, robot: Pose) -> Pose:
        """Return the pose of the lens, with the robot's heading, for a pose of the robot."""
        x_mm, y_mm = robot.ahead(self.forward_mm)
        x_mm, y_mm = Pose(x_mm, y_mm, robot.heading_deg).ahead(self.right_mm, 90.0)
        return Pose(x_mm, y_mm, robot.heading_deg)

    def floor_mm(self, below_deg: float) -> float:
        """Return how far in front of the lens a ray that points down by this angle, 0..90, meets the floor."""
        return self.height_mm / math.tan(math.radians(below_deg))

    def view_at(self, robot: Pose) -> Pose:
        """Return the pose of the lens, with the direction in which it looks."""
        lens = self.lens_at(robot)
        return Pose(lens.x_mm, lens.y_mm, lens.heading_deg + self.yaw_deg)


class ColorTable(Table):
    """How a colour looks in the robot's camera and light.

    Attributes:
        hue_deg: Its hue; 0 is red, 120 green, 240 blue.
        reach_deg: How far from it hues still count.
        min_saturation_percent: Paler pixels do not count.
        min_value_percent: Darker pixels do not count.
    """

    hue_deg: float = Field(ge=0, lt=360)
    reach_deg: float = Field(ge=2, le=60)
    min_saturation_percent: float = Field(ge=0, le=100)
    min_value_percent: float = Field(ge=0, le=100)


class MeasuredTable(Table):
    """How some of the values were measured.

    Attributes:
        date: When.
        method: How.
        standard_uncertainty: Of each value, by its key and in its unit.
        measured: Values that no other table has.
    """

    date: Annotated[datetime.date, Field(strict=False)]  # text in JSON
    method: str = Field(max_length=200)
    standard_uncertainty: dict[str, Annotated[float, Field(ge=0)]] = {}
    measured: dict[str, float] = {}


class CalibrationTable(Table):
    """Where the values of a robot file come from; written by ``nxtdrive calibrate``.

    Attributes:
        format: Number of this format.
        brick_id: Address of the brick, twelve hexadecimal digits; empty if unknown.
        brick_name: Its name.
        camera: How the values of [camera] were measured.
        wheels: How the diameter of the wheels, their mismatch and their track were measured.
        sonar: How the place of the ultrasonic sensor was measured.
        motors: How the directions of the motors were found.
        colors: How the last colour was measured.
    """

    format: Literal[1] = 1
    brick_id: str = Field(default="", max_length=12)
    brick_name: str = Field(default="", max_length=15)
    camera: MeasuredTable | None = None
    wheels: MeasuredTable | None = None
    sonar: MeasuredTable | None = None
    motors: MeasuredTable | None = None
    colors: MeasuredTable | None = None

    def describes_another(self, bluetooth_address: str) -> bool:
        """Return whether this is of another brick than the one with an address, as far as is known."""
        return self.brick_id not in ("", brick_id(bluetooth_address))

    @property
    def missing(self) -> list[str]:
        """What was not calibrated."""
        return [name for name in CALIBRATED if getattr(self, name) is None]

    @property
    def summary(self) -> str:
        """What was calibrated when, and what was not."""
        done = [f"{name} {getattr(self, name).date}" for name in CALIBRATED if name not in self.missing]
        return ", ".join([*done, *(f"{name} not calibrated" for name in self.missing)])


class RobotFile(Table):
    """A whole robot file."""

    robot: RobotTable = RobotTable()
    camera: CameraTable = CameraTable()
    color: dict[ColorName, ColorTable] = {}
    calibration: CalibrationTable = CalibrationTable()


def load_robot_file(path: Path) -> RobotFile:
    """Read and check a robot file.

    Raises:
        RobotFileError: The file cannot be read or has mistakes; the message lists all of them.
    """
    try:
        tables = read_toml(path)
    except InputFileError as error:
        raise RobotFileError(str(error)) from None
    for table, what in (("mission", "a mission"), ("floor", "a world")):
        if table in tables:
            raise RobotFileError(
                f"{path} is {what}, not a robot file. `nxtdrive calibrate --robot FILE` writes a robot file"
            )
    if is_foreign(tables, RobotFile.model_fields):
        raise RobotFileError(
            f"{path} is not a robot file: it has no [robot] and no [camera]. "
            "`nxtdrive calibrate --robot FILE` writes one"
        )
    problems = list(cross_checks(tables, RobotTable().model_dump()))
    try:
        described = RobotFile.model_validate(tables)
    except ValidationError as error:
        problems += mistakes(error, RobotFile)
    if problems:
        number, *lines = listed(len(problems), problems)
        raise RobotFileError(f"{path}: {number}", lines)
    return described


def with_robot(tables: Mapping[str, Any], described: RobotFile) -> dict[str, Any]:
    """Return the tables of a mission file, completed by the robot file.

    It completes keys of [robot] and [camera], and colours, and adds the robot file's [calibration].
    """
    merged, values = dict(tables), described.model_dump(exclude_unset=True)
    for name in ("robot", "camera", "color"):
        own = tables.get(name, {})
        if isinstance(own, Mapping):
            merged[name] = {**values.get(name, {}), **own}
    return merged | {"calibration": described.calibration.model_dump(exclude_unset=True)}
