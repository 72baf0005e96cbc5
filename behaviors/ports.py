"""The ports of a mission: robot, camera and clock, the values that pass through them, and how they fail.

Throughout the project *positive is right*: bearings, turns and headings grow clockwise seen from above; x points
forward at the start, y to the right of it. Lengths are in millimetres, angles in degrees, times in seconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Flag, StrEnum, auto
from typing import NamedTuple, Protocol

from behaviors.angles import wrapped_deg

Point = tuple[float, float]
"""x_mm, y_mm in the frame of the robot's start."""
Edges = tuple[float, float]
"""Lower and upper edge of a target above the lens, millimetres."""


@dataclass(frozen=True, slots=True)
class Pose:
    """The pose of the robot by odometry, in the frame of its start.

    Attributes:
        x_mm: Forward of the start.
        y_mm: To the right of the start.
        heading_deg: Clockwise from the start heading; not wrapped, so that full turns can be counted.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    heading_deg: float = 0.0

    @property
    def point(self) -> Point:
        """The position without the heading."""
        return self.x_mm, self.y_mm

    def ahead(self, distance_mm: float, bearing_deg: float = 0.0) -> Point:
        """Return the point at `distance_mm` and `bearing_deg` (positive right) from here."""
        angle = math.radians(self.heading_deg + bearing_deg)
        return self.x_mm + distance_mm * math.cos(angle), self.y_mm + distance_mm * math.sin(angle)

    def polar_to(self, point: Point) -> tuple[float, float]:
        """Return a point's bearing in degrees, positive right, and its distance in millimetres."""
        dx, dy = point[0] - self.x_mm, point[1] - self.y_mm
        return wrapped_deg(math.degrees(math.atan2(dy, dx)) - self.heading_deg), math.hypot(dx, dy)

    def corrected(self, turned_deg: float, moved_mm: float) -> Pose:
        """Return the pose after a further turn, positive right, and a way along the heading."""
        return Pose(*self.ahead(moved_mm, turned_deg / 2), self.heading_deg + turned_deg)

    def distance_mm_to(self, other: Pose) -> float:
        """Return the distance of another pose."""
        return math.hypot(other.x_mm - self.x_mm, other.y_mm - self.y_mm)

    def forward_mm_to(self, other: Pose) -> float:
        """Return how far another pose is ahead, measured along this heading; negative behind."""
        heading = math.radians(self.heading_deg)
        return (other.x_mm - self.x_mm) * math.cos(heading) + (other.y_mm - self.y_mm) * math.sin(heading)

    def is_near(self, other: Pose, within_mm: float, within_deg: float) -> bool:
        """Return whether another pose is nearer than a distance, and its heading than an angle; full turns count."""
        return self.distance_mm_to(other) < within_mm and abs(self.heading_deg - other.heading_deg) < within_deg


class Cut(Flag):
    """Sides of the frame beyond which a target continues."""

    NONE = 0
    LEFT = auto()
    TOP = auto()
    RIGHT = auto()
    BOTTOM = auto()

    @property
    def names(self) -> list[str]:
        """The sides in words, for records: ``["left", "bottom"]``."""
        return [str(side.name).lower() for side in self]


@dataclass(frozen=True, slots=True)
class Sighting:
    """A target that was detected in a frame; those that `Vision` returns are confirmed by other frames.

    Attributes:
        target: Name of the target.
        bearing_deg: Angle from the robot's forward axis, positive right.
        distance_mm: From the camera to the target, by its apparent size.
        confidence: 0..1 as the detector grades it.
        time_s: When the newest frame was taken, on the mission's clock.
        box: The target in that frame: left, top, width, height in pixels; it may extend beyond the frame.
        cut: Where the frame cuts it off, if the detector finds only the visible part.
        bound: Whether the visible part does not show its size: then it is no farther away than `distance_mm`, and its
            middle is at `bearing_deg` or farther out on the side where it is cut off.
        edges_mm: Its edges by its apparent size; None where that is not known.
        lower_deg: How far below level the lower edge of what is visible of it is seen from the lens; None where that is
            not known.
    """

    target: str
    bearing_deg: float
    distance_mm: float
    confidence: float
    time_s: float
    box: tuple[int, int, int, int]
    cut: Cut = Cut.NONE
    bound: bool = False
    edges_mm: Edges | None = None
    lower_deg: float | None = None


@dataclass(frozen=True, slots=True)
class Glimpse:
    """The targets that one frame showed.

    Attributes:
        time_s: When the frame was taken, on the mission's clock.
        seen: The targets confirmed in it, by name.
        unconfirmed: Names of the targets detected in it that another frame has to confirm.
        turned_deg: How far the camera turned since the frame of the glimpse before, positive right, by the frames
            alone; None where they do not show it.
    """

    time_s: float
    seen: Mapping[str, Sighting]
    unconfirmed: frozenset[str] = frozenset()
    turned_deg: float | None = None


@dataclass(frozen=True, slots=True)
class FloorRay:
    """The free floor in one direction, as a frame shows it. Angles are below the horizontal, of rays from the lens.

    Attributes:
        bearing_deg: From the robot's forward axis, positive right.
        near_deg: To the nearest floor that the frame shows.
        end_deg: To where the floor ends: something stands there, or the floor has another colour. It is not positive if
            the floor's colours go on up to the horizon or beyond: something in these colours stands on this ray.
    """

    bearing_deg: float
    near_deg: float
    end_deg: float


class StopReason(StrEnum):
    """Why a motion ended."""

    DONE = "done"
    OBSTACLE = "obstacle"
    CONTACT = "contact"
    STALLED = "stalled"
    TIMEOUT = "timeout"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True)
class MotionResult:
    """The result of a motion: why it ended and how far it came.

    Attributes:
        stop: Why it ended.
        distance_mm: Driven along the heading, by odometry.
        turned_deg: Turned, positive right, by odometry.
    """

    stop: StopReason
    distance_mm: float
    turned_deg: float

    @property
    def done(self) -> bool:
        """Whether it came as far as asked."""
        return self.stop is StopReason.DONE


class Clock(Protocol):
    """The mission's time; in the simulator, sleeping runs the simulation."""

    def now(self) -> float:
        """Return seconds since an arbitrary start; never goes back."""
        ...

    def sleep(self, duration_s: float) -> None:
        """Wait for `duration_s`."""
        ...


class Outage(Exception):
    """Something that the mission needs has failed; the mission continues when it works again.

    Adapters raise these in place of their own errors. A built-in `ConnectionError` or `TimeoutError` is not an outage.

    Attributes:
        permanent: Whether it will never work again, like a video at its end; then waiting is useless.
        refused: Whether the brick answers and refuses.
    """

    permanent = False
    refused = False


class RobotUnreachable(Outage):
    """The brick does not answer, refuses, or answers nonsense; the motors stop at the end of their lease.

    Args:
        message: What failed.
        refused: Whether the brick answers and refuses.
    """

    def __init__(self, message: str, *, refused: bool = False) -> None:
        super().__init__(message)
        self.refused = refused


class CameraLost(Outage):
    """The camera delivers no new frames, or black ones: a target that is not seen may still be there."""


class SensorLost(Outage):
    """No safety sensor is left for driving forward: sonar and bumper, as far as present, have failed."""


SensorListener = Callable[[str, str], None]
"""Called with a sensor's name and its error in words; the error is empty when the sensor answers again."""


class Body(Protocol):
    """The moving robot.

    Every method ends in bounded time and raises `RobotUnreachable` when the brick cannot be reached; the motors stop by
    themselves then. A sensor that fails is left out: its data count as unknown, and the robot drives slower.
    """

    def turn(self, angle_deg: float) -> MotionResult:
        """Turn on the spot by `angle_deg` (positive right) and stop; returns when at rest."""
        ...

    def straight(self, distance_mm: float) -> MotionResult:
        """Drive `distance_mm` along the heading (negative: back) and stop; the safety stop may end it early.

        Raises:
            SensorLost: No sensor is left for the safety stop.
        """
        ...

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        """Drive on until the next call, for at most one lease; return why the safety stop holds the robot, or None.

        Raises:
            SensorLost: No sensor is left for the safety stop.
        """
        ...

    def stop(self) -> None:
        """Switch the motors off and brake, at once."""
        ...

    def pose(self) -> Pose:
        """Return where the robot is by odometry."""
        ...

    def range_mm(self) -> float | None:
        """Return the distance ahead by ultrasound, or None without an echo or without a sensor."""
        ...

    def touching(self) -> bool:
        """Return whether the bumper is pressed; False without a sensor."""
        ...

    def dead_wheels(self) -> Mapping[str, bool]:
        """Return which wheels, ``left`` and ``right``, do not turn when driven, and whether each has turned before."""
        ...

    def distrust_sonar(self, why: str) -> None:
        """Leave the sonar out of the safety stop, as if it had failed; `why` in words."""
        ...

    def trust_sonar(self) -> None:
        """Let the safety stop use the sonar again."""
        ...

    def correct_turns(self, scale: float, angle_deg: float) -> None:
        """Scale all turns from now on by `scale`, and in the pose also the latest one, by `angle_deg` on the spot."""
        ...

    def correct_pose(self, turned_deg: float, moved_mm: float) -> None:
        """Add to the pose what the wheels did not show: a turn, positive right, and a way along the heading."""
        ...

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off."""
        ...

    def battery_mv(self) -> int:
        """Return the battery voltage in millivolts."""
        ...

    def can_drive_forward(self) -> bool:
        """Return whether a sensor is left for the safety stop, or the robot was built without any."""
        ...

    def on_sensor_change(self, listener: SensorListener) -> Callable[[], None]:
        """Call `listener` when a sensor fails and when it answers again, until the returned function is called.

        The listener must not use the robot.
        """
        ...


class Vision(Protocol):
    """The camera with its detectors. `look` and `glance` raise `CameraLost` when no frame arrives."""

    def look(self, target: str) -> Sighting | None:
        """Return the sighting of `target` if it is confirmed in the next new frame, within the camera's timeout."""
        ...

    def glance(self, targets: Sequence[str]) -> Glimpse:
        """Return which of the targets are confirmed in the next new frame."""
        ...

    def free_floor(self, free_at_s: float | None) -> Sequence[FloorRay]:
        """Return how far the floor is free in the frame of the latest look, by direction.

        Args:
            free_at_s: `Glimpse.time_s` of the latest look, or of an earlier one, for which it is now known that the
                floor right ahead was free, so that its appearance can be learned; None without such a look.

        Returns:
            Nothing until the appearance has been learned; directions without information are left out.
        """
        ...


class Ports(NamedTuple):
    """The ports of a mission: robot, camera and clock.

    Attributes:
        body: The robot.
        vision: Its camera and detectors.
        clock: Mission time.
    """

    body: Body
    vision: Vision
    clock: Clock
