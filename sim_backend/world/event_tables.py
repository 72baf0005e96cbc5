"""Tables of a world file's events: when something happens, and what."""

from __future__ import annotations

from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from sim_backend.world.toml_types import MAX_TIMES, Direction, Duration, Length, Name, Percent, Point, Seconds, Table

Fault = Literal["no_echo", "pressed", "stuck", "error", "unplugged"]
"""How a sensor fails: an ultrasonic sensor without echoes, a touch sensor that stays pressed, a reading that stays, one
that answers only at times (a loose plug), and none at all."""
CameraFault = Literal["stuck", "covered", "fogged", "unplugged"]
"""How the camera fails: it repeats its last frame, its frames are black, its lens is fogged, there are no frames."""
SENSOR_FAULTS, CAMERA_FAULTS = get_args(Fault), get_args(CameraFault)
Wheel = Literal["left", "right", "both"]


class When(Table):
    """Trigger of an event: it happens as soon as all given conditions hold at the same time.

    Attributes:
        at_s: This simulation time has been reached.
        after: The event with this name has begun.
        after_end_of: The event with this name is over (its person has left).
        delay_s: This time has passed since the conditions above were met.
        sees: The picture with this name is in the camera's view.
        for_s: It has been in view for this time in total, since the conditions above were met.
        view_number: It has come into view at least this many times.
        of: Picture, box or person from which the robot's distance is measured; by default the picture of `sees`.
        robot_within_mm: The distance to the middle of the robot is below this.
        robot_beyond_mm: The distance to the middle of the robot is above this.
    """

    at_s: Seconds | None = None
    after: Name | None = None
    after_end_of: Name | None = None
    delay_s: Duration = (0.0, 0.0)
    sees: Name | None = None
    for_s: Duration = (0.0, 0.0)
    view_number: Annotated[int, Field(ge=1, le=MAX_TIMES)] = 1
    of: Name | None = None
    robot_within_mm: Length | None = None
    robot_beyond_mm: Length | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if all(condition is None for condition in (self.at_s, self.after, self.after_end_of, self.sees, self.of)):
            raise ValueError("has no condition; give at_s, after, after_end_of, sees, or of with a distance")
        if self.after is not None and self.after_end_of is not None:
            raise ValueError("after and after_end_of exclude each other")
        near, far = self.robot_within_mm, self.robot_beyond_mm
        if (near is not None or far is not None) and self.of is None and self.sees is None:
            raise ValueError("robot_within_mm and robot_beyond_mm need `of` (or `sees`): the distance from what?")
        if near is not None and far is not None and near <= far:
            raise ValueError("robot_within_mm must be more than robot_beyond_mm")
        return self


class Event(Table):
    """An event: something happens to a person, a picture, a box, a sensor, a wheel, the camera or the robot.

    Attributes:
        name: Name, for references from other events.
        when: The trigger.
        times: Maximum number of occurrences; 0 for no limit.
        person: Person who comes, with `to_mm` or `blocks` and optionally `stays_s`, or who leaves, with `leaves`.
        picture: Picture that moves, appears or disappears.
        box: Box that moves, appears or disappears.
        sensor: Input port of a sensor that fails, with `fault`.
        wheel: Wheel that slips, with `slip_percent`, or whose motor's cable is off, with the `fault` "unplugged".
        camera: The camera fails, with `fault`, or is turned, with `yaw_deg`.
        robot: The robot is lifted and put down at `to_mm`.
        to_mm: New position.
        facing_deg: New facing of a picture, box or the robot.
        speed_mm_s: A picture rides there at this speed, without it is there at once.
        blocks: The person or box moves between the robot and this picture.
        blocks_at_mm: Distance in front of that picture.
        fault: How the sensor, the wheel's motor or the camera fails.
        slip_percent: Share of the wheel's motion that is lost.
        yaw_deg: How far the camera is turned from where it was mounted, positive right.
        stays_s: How long the person stays after arrival, the sensor, wheel or camera is disturbed (without it: until
            another event of that subject ends it, or forever), or the robot is in the air (without it: 2 s).
        leaves: The person leaves now.
        present: Whether the picture or box is present from now on.
    """

    name: Name
    when: When
    times: Annotated[int, Field(ge=0, le=MAX_TIMES)] = 1
    person: Name | None = None
    picture: Name | None = None
    box: Name | None = None
    sensor: Annotated[int, Field(ge=1, le=4)] | None = None
    wheel: Wheel | None = None
    camera: bool = False
    robot: bool = False
    to_mm: Point | None = None
    facing_deg: Direction | None = None
    speed_mm_s: Annotated[float, Field(gt=0, le=1000)] | None = None
    blocks: Name | None = None
    blocks_at_mm: Length = 600.0
    fault: Fault | CameraFault | None = None
    slip_percent: Percent | None = None
    yaw_deg: Annotated[float, Field(ge=-90, le=90)] | None = None
    stays_s: Duration | None = None
    leaves: bool = False
    present: bool = True

    @model_validator(mode="after")
    def _complete(self) -> Self:
        devices = (self.sensor, self.wheel, self.camera or None, self.robot or None)
        if sum(subject is not None for subject in (self.person, self.picture, self.box, *devices)) != 1:
            raise ValueError("must name exactly one of person, picture, box, sensor, wheel, camera and robot")
        if self.person is not None and (self.to_mm is not None or self.blocks is not None) == self.leaves:
            raise ValueError("a person needs exactly one of to_mm, blocks and leaves")
        if self.person is None and self.leaves:
            raise ValueError("leaves is for persons")
        if self.stays_s is not None and (self.picture is not None or self.box is not None):
            raise ValueError("stays_s is not for pictures and boxes")
        if self.blocks is not None and self.person is None and self.box is None:
            raise ValueError("blocks is for persons and boxes")
        if self.to_mm is not None and self.blocks is not None:
            raise ValueError("to_mm and blocks exclude each other")
        return self

    @model_validator(mode="after")
    def _fits_its_subject(self) -> Self:
        if self.speed_mm_s is not None and (self.picture is None or self.to_mm is None):
            raise ValueError("speed_mm_s is for a picture that rides to to_mm")
        if self.robot and self.to_mm is None:
            raise ValueError("robot needs to_mm: where is it put down?")
        if self.to_mm is not None and (self.sensor is not None or self.wheel is not None or self.camera):
            raise ValueError("to_mm is not for sensors, wheels and the camera")
        return self

    @model_validator(mode="after")
    def _disturbs_its_subject(self) -> Self:
        if self.sensor is not None and self.fault not in SENSOR_FAULTS:
            raise ValueError(f"a sensor needs a fault: {', '.join(SENSOR_FAULTS)}")
        if self.wheel is not None and (self.slip_percent is None) == (self.fault is None):
            raise ValueError('a wheel needs slip_percent or fault = "unplugged"')
        if self.wheel is not None and self.fault not in (None, "unplugged"):
            raise ValueError("the fault of a wheel is unplugged: its motor's cable is off")
        if self.camera and (self.yaw_deg is None) == (self.fault is None):
            raise ValueError("the camera needs fault or yaw_deg: how does it fail, or how far is it turned?")
        if self.camera and self.fault not in (None, *CAMERA_FAULTS):
            raise ValueError(f"the camera's fault is one of {', '.join(CAMERA_FAULTS)}")
        if self.fault is not None and self.sensor is None and self.wheel is None and not self.camera:
            raise ValueError("fault is for sensors, wheels and the camera")
        if self.slip_percent is not None and self.wheel is None:
            raise ValueError("slip_percent is for wheels")
        if self.yaw_deg is not None and not self.camera:
            raise ValueError("yaw_deg is for the camera")
        return self

    @property
    def subject(self) -> str:
        """Name of the person, picture or box; empty for others."""
        return self.person or self.picture or self.box or ""
