"""The driver as a mission's robot and clock: driver errors become the outages that `behaviors.ports` declares."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from behaviors.ports import MotionResult, Ports, Pose, RobotUnreachable, SensorListener, SensorLost, StopReason, Vision
from firmware_protocol.errors import BrickError, BrickNotFound, LinkError, RemoteProtocolError
from nxtdrive.motion.obstacle_monitor import SafetyLimits

if TYPE_CHECKING:
    from behaviors.mission import Mission
    from behaviors.mission.robot import RobotTable
    from nxtdrive.brick import Brick
    from nxtdrive.motion.rover import Rover

REDUCED_SPEED = 0.5
"""Share of its speed at which the robot drives forward without one of its safety sensors."""


@contextmanager
def link_errors_as_outages() -> Iterator[None]:
    """Raise `RobotUnreachable` for a link that is lost or silent and for a brick that refuses or answers nonsense."""
    try:
        yield
    except (LinkError, BrickNotFound, BrickError, RemoteProtocolError) as error:
        raise RobotUnreachable(str(error), refused=isinstance(error, BrickError)) from error


class MissionClock:
    """The link's clock; implements `behaviors.ports.Clock`.

    Args:
        brick: Its link may be lost and opened again.
    """

    def __init__(self, brick: Brick) -> None:
        self._brick = brick

    def now(self) -> float:
        """Return seconds since an arbitrary start."""
        return self._brick.now()

    def sleep(self, duration_s: float) -> None:
        """Let `duration_s` pass.

        Raises:
            RobotUnreachable: The link was lost in that time.
        """
        with link_errors_as_outages():
            self._brick.sleep(duration_s)


class MissionBody:
    """A rover that survives the failure of a sensor; implements `behaviors.ports.Body`.

    Args:
        rover: The robot.
        safety_sensors: Those of ``sonar`` and ``bumper`` that it has.
    """

    def __init__(self, rover: Rover, safety_sensors: Collection[str]) -> None:
        self._rover = rover
        self._safety_sensors = frozenset(safety_sensors)
        self._failed: dict[str, str] = {}
        self._distrusted: dict[str, str] = {}
        self._listeners: list[SensorListener] = []
        rover.on_sensor_change(self._sensor_changed)

    def turn(self, angle_deg: float) -> MotionResult:
        """Turn on the spot, positive right; returns at rest."""
        with link_errors_as_outages():
            return self._rover.turn(angle_deg)

    def straight(self, distance_mm: float) -> MotionResult:
        """Drive along the heading; returns at rest.

        Raises:
            SensorLost: `distance_mm` is positive, and no safety sensor is left.
        """
        self._check_safety(distance_mm)
        with link_errors_as_outages():
            return self._rover.straight(distance_mm, self._rover.settings.speed_mm_s * self._speed_share)

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        """Drive on until the next call, for at most one lease.

        Raises:
            SensorLost: `speed_mm_s` is positive, and no safety sensor is left.
        """
        self._check_safety(speed_mm_s)
        with link_errors_as_outages():
            return self._rover.drive(speed_mm_s * self._speed_share, turn_deg_s)

    def stop(self) -> None:
        """Brake now."""
        with link_errors_as_outages():
            self._rover.stop()

    def pose(self) -> Pose:
        """Return where the robot is by odometry."""
        with link_errors_as_outages():
            return self._rover.pose()

    def last_pose(self) -> Pose:
        """Return where the robot is by the latest reading of its wheels; asks nothing."""
        return self._rover.last_pose

    def range_mm(self) -> float | None:
        """Return the distance ahead; None without an echo and while there is no working sonar."""
        with link_errors_as_outages():
            return self._rover.range_mm()

    def touching(self) -> bool:
        """Return whether the bumper is pressed; False while there is no working bumper."""
        with link_errors_as_outages():
            return self._rover.touching()

    def dead_wheels(self) -> dict[str, bool]:
        """Return which wheels, ``left`` and ``right``, do not turn, and whether each has turned before."""
        return self._rover.dead_wheels()

    def distrust_sonar(self, why: str) -> None:
        """Leave the sonar out of the safety stop, as if it had failed."""
        self._rover.use_sonar(use=False)
        self._set(self._distrusted, "sonar", why)

    def trust_sonar(self) -> None:
        """Let the safety stop use the sonar again."""
        self._rover.use_sonar(use=True)
        self._set(self._distrusted, "sonar", "")

    def correct_turns(self, scale: float, angle_deg: float) -> None:
        """Scale all turns from now on by `scale`, and also the latest one, by `angle_deg` on the spot."""
        self._rover.correct_turns(scale, angle_deg)

    def correct_pose(self, turned_deg: float, moved_mm: float) -> None:
        """Add to the pose what the wheels did not show: a turn, positive right, and a way along the heading."""
        self._rover.correct_pose(turned_deg, moved_mm)

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off."""
        with link_errors_as_outages():
            self._rover.keep_alive()

    def battery_mv(self) -> int:
        """Return the battery voltage in millivolts."""
        with link_errors_as_outages():
            return self._rover.battery_mv()

    def can_drive_forward(self) -> bool:
        """Return whether a safety sensor is left, or the robot has none at all."""
        return not self._safety_sensors or not self._safety_sensors <= self.lost.keys()

    def on_sensor_change(self, listener: SensorListener) -> Callable[[], None]:
        """Call `listener` when a sensor fails and when it answers again, until the returned function is called.

        The listener must not use the robot.
        """
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    @property
    def lost(self) -> dict[str, str]:
        """The sensors that the safety stop does without, each with the reason."""
        return self._distrusted | self._failed

    @property
    def _speed_share(self) -> float:
        return REDUCED_SPEED if self._safety_sensors & self.lost.keys() else 1.0

    def _check_safety(self, forward: float) -> None:
        if forward > 0 and not self.can_drive_forward():
            raise SensorLost("; ".join(f"{sensor}: {error}" for sensor, error in sorted(self.lost.items())))

    def _sensor_changed(self, sensor: str, error: str) -> None:
        self._set(self._failed, sensor, error)

    def _set(self, reasons: dict[str, str], sensor: str, reason: str) -> None:
        """Add a reason to do without a sensor, or with an empty one remove it."""
        was_lost = sensor in self.lost
        if reason:
            reasons[sensor] = reason
        else:
            reasons.pop(sensor, None)
        if (sensor in self.lost) is not was_lost:
            for listener in tuple(self._listeners):
                listener(sensor, reason)


def build_rover(brick: Brick, robot: RobotTable) -> Rover:
    """Return the vehicle that a mission or a robot file describes."""
    return brick.rover(
        left=robot.left,
        right=robot.right,
        wheel_diameter_mm=robot.wheel_diameter_mm,
        axle_track_mm=robot.axle_track_mm,
        reversed=(robot.left_reversed, robot.right_reversed),
        wheel_mismatch_percent=robot.wheel_mismatch_percent,
        turn_slip_percent=robot.turn_slip_percent,
        ultrasonic=robot.ultrasonic or None,
        touch=robot.touch or None,
        compass=robot.compass or None,
        safety=SafetyLimits(stop_distance_mm=robot.stop_distance_mm),
    )


def build_body(brick: Brick, mission: Mission) -> MissionBody:
    """Return the robot that a mission describes, as the mission's port."""
    return MissionBody(build_rover(brick, mission.robot), safety_sensors(mission.robot))


def mission_ports(brick: Brick, mission: Mission, vision: Vision) -> Ports:
    """Return what a mission works with: the robot that it describes, this vision, and the brick's clock."""
    from nxtdrive.vision.target_vision import CameraVision

    body = build_body(brick, mission)
    if isinstance(vision, CameraVision):
        vision.watch_motion(body.last_pose)
    return Ports(body, vision, MissionClock(brick))


def safety_sensors(robot: RobotTable) -> list[str]:
    """Return which sensors of the safety stop a robot has, as `MissionBody` takes them."""
    ports = {"sonar": robot.ultrasonic, "bumper": robot.touch}
    return [sensor for sensor, port in ports.items() if port]


def lacking_sensors(robot: RobotTable) -> list[str]:
    """Return which sensors of the safety stop a robot does not have."""
    return [sensor for sensor in ("sonar", "bumper") if sensor not in safety_sensors(robot)]
