"""The brick as a vehicle: two driven wheels, a sonar and a bumper; the mind's `Body`."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Literal, overload

from behaviors.ports import MotionResult, Pose, StopReason
from firmware_protocol.errors import ConfigError
from nxtdrive.motion.brake_predictor import SEEN_DEG_S, WATCH_S
from nxtdrive.motion.compass_correction import CompassCorrection
from nxtdrive.motion.leased_speed import LEASE_RANGE_S, LEASE_S, LeasedSpeed
from nxtdrive.motion.obstacle_monitor import ObstacleMonitor, SafetyLimits
from nxtdrive.motion.odometry import Odometry
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S, sample
from nxtdrive.motion.position_move import Pace, PositionMove, Wheel, unguarded
from nxtdrive.motion.scheduler import Motion, Steps
from nxtdrive.ports import MotorPort, SensorPort, output_port
from nxtdrive.sensors import Compass, Touch, Ultrasonic

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

__all__ = ["DriveSettings", "Rover", "SafetyLimits"]

FASTEST_DEG_S = 0.75 * FULL_SPEED_DEG_S
"""A wheel's highest speed: regulation needs a reserve, and a battery of 7.2 V turns the motor at no more than 770."""
REST_S = 0.03
"""Wheels whose counts are the same for so long stand."""
TRIPS = 9
"""Round trips from one `drive` to the next: questions to sonar, bumper and wheels, then the safety stop's, take 8."""
TURN_RANGE_DEG = 3600.0
STRAIGHT_RANGE_MM = 10_000.0
"""Longer motions than these are mistakes in a unit."""


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """How fast the rover moves.

    Attributes:
        speed_mm_s: Of `straight`.
        acceleration_mm_s2: Of `straight`, speeding up and slowing down.
        turn_deg_s: Of `turn`.
        turn_acceleration_deg_s2: Of `turn`, speeding up and slowing down.
        lease_s: About how long the robot drives on when program or link have died, or nobody calls `drive` again (on a
            slow link see there): 0.3..10. A wheel's limit is what it turns in this time, and at least 20 degrees.
    """

    speed_mm_s: float = 200.0
    acceleration_mm_s2: float = 400.0
    turn_deg_s: float = 120.0
    turn_acceleration_deg_s2: float = 300.0
    lease_s: float = LEASE_S


SAFETY = SafetyLimits()
SETTINGS = DriveSettings()
START = Pose()


class Rover:
    """Two wheels that drive and steer. Positive is right; the pose is in the frame of the start.

    `straight` and `turn` return when the robot is at rest, or with ``wait=False`` at once; then they go on while the
    program talks to the brick or sleeps by `Brick.sleep`. The next motion, `drive` or `stop` cancels them. During such
    a motion ask the rover for range and bumper: two who question a sensor at once get in each other's way.

    Args:
        brick: An open brick.
        left: Port of the left wheel's motor.
        right: Port of the right wheel's motor.
        wheel_diameter_mm: Of both wheels.
        axle_track_mm: Between the points where the wheels touch the floor.
        ultrasonic: Port of the sonar, or None.
        touch: Port of the bumper, or None.
        compass: Port of a compass that corrects the heading whenever the robot has come to rest, or None; see
            `nxtdrive.motion.compass_correction`.
        safety: When driving forward ends by itself.
        settings: How fast it moves.
        reversed: Whether positive power drives the robot backwards.

    Raises:
        ConfigError: A port is used twice, or a size is not positive.
    """

    def __init__(
        self,
        brick: Brick,
        left: MotorPort = "B",
        right: MotorPort = "C",
        wheel_diameter_mm: float = 56.0,
        axle_track_mm: float = 112.0,
        *,
        ultrasonic: SensorPort | None = 4,
        touch: SensorPort | None = 1,
        compass: SensorPort | None = None,
        safety: SafetyLimits = SAFETY,
        settings: DriveSettings = SETTINGS,
        reversed: bool = False,
    ) -> None:
        sensors = {"sonar": ultrasonic, "bumper": touch, "compass": compass}
        _check(left, right, sensors, wheel_diameter_mm, axle_track_mm, settings)
        self.settings = settings
        self._brick = brick
        self._ports = (output_port(left), output_port(right))
        self._forward = -1 if reversed else 1
        self._mm_per_deg = math.pi * wheel_diameter_mm / 360.0
        self._track_mm = axle_track_mm
        self._monitor = ObstacleMonitor(
            Ultrasonic(brick, ultrasonic) if ultrasonic is not None else None,
            Touch(brick, touch) if touch is not None else None,
            safety,
            brick.now,
        )
        self._speed = LeasedSpeed(brick, settings.lease_s, trips=TRIPS)
        self._motion: Motion[MotionResult] | None = None
        self._driving = False
        self._asking = threading.Lock()
        self._odometry = Odometry(self._forward * self._mm_per_deg, axle_track_mm)
        self._compass_correction = (
            CompassCorrection(Compass(brick, compass), self._odometry, self._read_wheels)
            if compass is not None
            else None
        )

    # --- motion ---

    @overload
    def straight(self, distance_mm: float, *, wait: Literal[True] = True) -> MotionResult: ...
    @overload
    def straight(self, distance_mm: float, *, wait: Literal[False]) -> Motion[MotionResult]: ...
    def straight(self, distance_mm: float, *, wait: bool = True) -> MotionResult | Motion[MotionResult]:
        """Drive `distance_mm` along the heading, negative: back; returns at rest.

        The safety stop may end a drive forward. Every drive is bounded in time.
        """
        _check_amount("distance_mm", distance_mm, STRAIGHT_RANGE_MM)
        limit = self.settings
        pace = Pace(self._wheel_deg(limit.speed_mm_s), self._wheel_deg(limit.acceleration_mm_s2))
        return self._travel((1, 1), self._wheel_deg(distance_mm), pace, guarded=distance_mm > 0, wait=wait)

    @overload
    def turn(self, angle_deg: float, *, wait: Literal[True] = True) -> MotionResult: ...
    @overload
    def turn(self, angle_deg: float, *, wait: Literal[False]) -> Motion[MotionResult]: ...
    def turn(self, angle_deg: float, *, wait: bool = True) -> MotionResult | Motion[MotionResult]:
        """Turn on the spot by `angle_deg`, positive right; returns at rest."""
        _check_amount("angle_deg", angle_deg, TURN_RANGE_DEG)
        limit = self.settings
        pace = Pace(self._turn_deg(limit.turn_deg_s), self._turn_deg(limit.turn_acceleration_deg_s2))
        return self._travel((1, -1), self._turn_deg(angle_deg), pace, guarded=False, wait=wait)

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        """Drive on until the next call, for at most one lease.

        On a link on which nine round trips last longer than the lease, it is renewed for so long: else questions to
        sensors would let it run out between two calls.

        What is faster than the motors is driven slower, on the same curve.

        Returns:
            None, or the motors being braked already: what the safety stop objects to; or STALLED when a wheel has stood
            for 0.7 s though it was told to turn at 20 deg/s or more. The next call is another try.
        """
        self._brick.motions.claim(self._ports)
        if self._compass_correction is not None and not self._driving:
            self.pose()
        elif (speed_mm_s or turn_deg_s) and self._unread_for_s > WATCH_S:
            self._read_wheels()
        if speed_mm_s > 0 and (objection := self._monitor.watch(self._odometry.pose)) is not None:
            self.stop()
            return objection
        forward, sideways = self._wheel_deg(speed_mm_s), self._turn_deg(turn_deg_s)
        speeds = (forward + sideways, forward - sideways)
        excess = max(1.0, *(abs(speed) / FASTEST_DEG_S for speed in speeds))
        self._driving = True
        for port, wheel, speed in zip(self._ports, self._odometry.wheels, speeds, strict=True):
            turning = self._speed.run(port, self._forward * speed / excess)
            if not turning or abs(speed) / excess < SEEN_DEG_S:
                wheel.begin(self._brick.now())
        if any(wheel.stalled for wheel in self._odometry.wheels):
            self.stop()
            return StopReason.STALLED
        return None

    @property
    def done(self) -> bool:
        """Whether neither `straight` nor `turn` is under way."""
        return self._motion is None or self._motion.done

    def stop(self) -> None:
        """Motors off, brakes on, now."""
        self._driving = False
        self._brick.motions.claim(self._ports)
        self._speed.brake(self._ports)

    # --- senses ---

    def pose(self) -> Pose:
        """Where the robot is by odometry, from the wheels' rotation.

        With a compass the heading is corrected once the robot has come to rest, which takes two round trips more.

        Raises:
            BrickError: The compass does not answer, and never has.
        """
        self._read_wheels()
        self._align()
        return self._odometry.pose

    def reset_pose(self, pose: Pose = START) -> None:
        """Call the present place `pose`."""
        before = self.pose()
        self._odometry.put(pose)
        if self._compass_correction is not None:
            self._compass_correction.rename(pose.heading_deg - before.heading_deg)

    def range_mm(self) -> float | None:
        """Distance ahead by ultrasound, or None without an echo or without a sensor."""
        with self._asking:
            return self._monitor.range_mm(self._odometry.pose)

    def touching(self) -> bool:
        """Whether the bumper is pressed; False without a sensor."""
        with self._asking:
            return self._monitor.touching()

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off."""
        self._brick.keep_alive()

    def battery_mv(self) -> int:
        """Battery voltage in millivolts."""
        return self._brick.battery_mv

    # --- how ---

    def _travel(
        self, signs: tuple[int, int], angle_deg: float, pace: Pace, *, guarded: bool, wait: bool
    ) -> MotionResult | Motion[MotionResult]:
        self._brick.motions.claim(self._ports)
        move = self._motion = self._brick.motions.start(self._ports, self._steps(signs, angle_deg, pace, guarded))
        return move.join() if wait else move

    def _steps(self, signs: tuple[int, int], angle_deg: float, pace: Pace, guarded: bool) -> Steps[MotionResult]:
        begin = self.pose()
        if guarded and (objection := self._monitor.clear_to_go(begin)) is not None:
            self._speed.brake(self._ports)
            return MotionResult(objection, 0.0, 0.0)
        wheels = [Wheel(port, self._forward * sign) for port, sign in zip(self._ports, signs, strict=True)]
        self._speed = LeasedSpeed(self._brick, self.settings.lease_s, trips=TRIPS)
        guard = self._guard if guarded else unguarded
        self._driving, note = False, self._odometry.note
        travel = PositionMove(self._brick, wheels, pace, guard=guard, note=note, lease_s=self.settings.lease_s)
        stop = yield from travel.steps(angle_deg)
        self._align()
        return self._motion_since(begin, stop)

    def _motion_since(self, begin: Pose, stop: StopReason) -> MotionResult:
        end, heading = self._odometry.pose, math.radians(begin.heading_deg)
        along = (end.x_mm - begin.x_mm) * math.cos(heading) + (end.y_mm - begin.y_mm) * math.sin(heading)
        return MotionResult(stop, along, end.heading_deg - begin.heading_deg)

    def _wheel_deg(self, distance_mm: float) -> float:
        return distance_mm / self._mm_per_deg

    def _turn_deg(self, angle_deg: float) -> float:
        """How far the wheels go, in opposite directions, to turn the robot."""
        return self._wheel_deg(math.radians(angle_deg) * self._track_mm / 2)

    def _read_wheels(self) -> None:
        self._odometry.note(sample(self._brick, *self._ports))

    @property
    def _unread_for_s(self) -> float:
        """How old the latest reading of the wheels is; seldom old, as who drives asks for the pose."""
        last = self._odometry.last
        return math.inf if last is None else self._brick.now() - last.time_s

    def _align(self) -> None:
        """Let the compass, if there is one, correct the heading of a robot at rest."""
        if self._compass_correction is not None and (
            (self.done and not self._driving) or self._odometry.rest_s >= REST_S
        ):
            self._compass_correction.update()

    def _guard(self, near: bool) -> StopReason | None:
        """What objects to going on; while the program itself asks a sensor, what is known already must do."""
        mine = self._asking.acquire(blocking=False)
        try:
            return self._monitor.watch(self._odometry.pose, ask=mine and not near)
        finally:
            if mine:
                self._asking.release()


def _check(
    left: str,
    right: str,
    sensors: Mapping[str, int | None],
    wheel_diameter_mm: float,
    axle_track_mm: float,
    settings: DriveSettings,
) -> None:
    if left == right:
        raise ConfigError(f"both wheels are said to be on port {left}.", remedy="Each motor has a port of its own.")
    for (one, port), (other, its_port) in combinations(sensors.items(), 2):
        if port is not None and port == its_port:
            raise ConfigError(
                f"{one} and {other} are both said to be on port {port}.", remedy="Each sensor has its own port."
            )
    for name, value in (("wheel_diameter_mm", wheel_diameter_mm), ("axle_track_mm", axle_track_mm)):
        if not value > 0:
            raise ConfigError(f"{name} must be positive, not {value!r}.")
    fastest_mm_s = FASTEST_DEG_S * math.pi * wheel_diameter_mm / 360
    _check_setting("speed_mm_s", settings.speed_mm_s, fastest_mm_s)
    _check_setting("turn_deg_s", settings.turn_deg_s, math.degrees(2 * fastest_mm_s / axle_track_mm))
    if not LEASE_RANGE_S[0] <= settings.lease_s <= LEASE_RANGE_S[1]:
        raise ConfigError("lease_s must be from {:g} to {:g}, not {!r}.".format(*LEASE_RANGE_S, settings.lease_s))
    _check_setting("acceleration_mm_s2", settings.acceleration_mm_s2, math.inf)
    _check_setting("turn_acceleration_deg_s2", settings.turn_acceleration_deg_s2, math.inf)


def _check_setting(name: str, value: float, limit: float) -> None:
    if not 0 < value <= limit:
        raise ConfigError(f"{name} must be above 0 and at most {limit:.0f} with these wheels, not {value!r}.")


def _check_amount(name: str, value: float, limit: float) -> None:
    if not abs(value) <= limit:
        raise ConfigError(f"{name} must be from {-limit:g} to {limit:g}, not {value!r}.")
