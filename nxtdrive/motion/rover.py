"""The brick as a vehicle with two driven wheels, a sonar and a bumper."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal, TypedDict, overload

from behaviors.ports import MotionResult, Pose, SensorListener, StopReason
from firmware_protocol.direct import GetBatteryLevel
from nxtdrive.link.link import Link
from nxtdrive.link.scheduler import Motion, Steps
from nxtdrive.motion.brake_predictor import SEEN_DEG_S
from nxtdrive.motion.compass_correction import CompassCorrection
from nxtdrive.motion.drive_settings import FASTEST_WHEEL_DEG_S, DriveSettings, checked_settings
from nxtdrive.motion.lease import Lease, brake_all, stopping_on_error
from nxtdrive.motion.obstacle_monitor import ObstacleMonitor, SafetyLimits
from nxtdrive.motion.odometry import Odometry
from nxtdrive.motion.outputs import SLOWEST_DEG_S, Sample, sample
from nxtdrive.motion.position_move import PositionMove, SpeedProfile, Wheel, unguarded
from nxtdrive.motion.rover_ports import check_ports, sensor_at
from nxtdrive.motion.stall import WATCH_S, StallDetector
from nxtdrive.motion.wheel_geometry import WheelGeometry
from nxtdrive.ports import MotorPort, SensorPort, in_range, of_type, output_port
from nxtdrive.sensors import Compass, Touch, Ultrasonic

__all__ = ["DriveSettings", "Rover", "SafetyLimits"]

FRESH_ROUND_TRIPS = 1.5
"""A reading of the wheels that is no older than this many round trips is as good as a new one."""
REST_S = 0.03
"""Wheels whose counts have not changed for this time stand."""
ROUND_TRIPS = 9
"""Round trips between two calls of `drive`: reading sonar, bumper and wheels, and the safety stop, take 8."""
STANDING_SHARE = 0.02
"""A wheel that would turn less than this share of the other is not driven."""
TURN_RANGE_DEG = 3600.0
STRAIGHT_RANGE_MM = 10_000.0
"""Longer motions are mistakes in the unit."""
DRIVE_RANGE = 1e6
"""Largest speed, mm/s, and turn rate, deg/s, of `drive`: any number that may have been meant."""

SAFETY = SafetyLimits()
START = Pose()


class RoverOptions(TypedDict, total=False):
    """The arguments of `Rover` other than its link, ports and sensors; they are explained there."""

    wheel_diameter_mm: float
    axle_track_mm: float
    safety: SafetyLimits
    settings: DriveSettings | None
    reversed: bool | tuple[bool, bool]
    wheel_mismatch_percent: float
    turn_slip_percent: float


class Rover:
    """Two wheels that drive and steer. Positive is right; the pose is in the frame of the start.

    `straight`, `turn` and `curve` return when the robot is at rest, or with ``wait=False`` at once; then they continue
    while the program makes requests or calls `Brick.sleep`. The next motion, `drive` or `stop` cancels them. During
    such a motion the program may read the sonar by `range_mm`, or by the `Ultrasonic` object that the rover was given.

    Args:
        link: The link to the brick.
        left: Port of the left wheel's motor.
        right: Port of the right wheel's motor.
        wheel_diameter_mm: Of both wheels.
        axle_track_mm: Distance between the points where the wheels touch the floor.
        ultrasonic: The sonar or its port, or None.
        touch: The bumper or its port, or None.
        compass: A compass or its port that corrects the heading whenever the robot has come to rest, or None; see
            `nxtdrive.motion.compass_correction`.
        safety: When the safety stop ends driving forward.
        settings: How fast it moves; by default as usual, or slower if the wheels are small.
        reversed: Whether positive power drives the robot backwards; for wheels that differ, (left, right).
        wheel_mismatch_percent: How much larger the right wheel is than the left one, -20..20; the diameter is the mean.
        turn_slip_percent: Share of each turn that the wheels lose by slipping, -20..50.

    Attributes:
        settings: How fast it moves.

    Raises:
        LocalProtocolError: A port is used twice, or a size, speed or type is wrong.
    """

    def __init__(
        self,
        link: Link,
        left: MotorPort = "B",
        right: MotorPort = "C",
        wheel_diameter_mm: float = 56.0,
        axle_track_mm: float = 112.0,
        *,
        ultrasonic: SensorPort | Ultrasonic | None = 4,
        touch: SensorPort | Touch | None = 1,
        compass: SensorPort | Compass | None = None,
        safety: SafetyLimits = SAFETY,
        settings: DriveSettings | None = None,
        reversed: bool | tuple[bool, bool] = False,
        wheel_mismatch_percent: float = 0.0,
        turn_slip_percent: float = 0.0,
    ) -> None:
        self._ports = (output_port(left), output_port(right))
        sonar, bumper = sensor_at(link, Ultrasonic, ultrasonic), sensor_at(link, Touch, touch)
        heading_sensor = sensor_at(link, Compass, compass)
        check_ports(self._ports, {"sonar": sonar, "bumper": bumper, "compass": heading_sensor})
        wanted = None if settings is None else of_type("settings", settings, DriveSettings)
        self.settings = settings = checked_settings(wheel_diameter_mm, axle_track_mm, wanted)
        self._link = link
        self._wheels = WheelGeometry.of(
            wheel_diameter_mm,
            axle_track_mm,
            reversed=reversed,
            mismatch_percent=wheel_mismatch_percent,
            turn_slip_percent=turn_slip_percent,
        )
        self._monitor = ObstacleMonitor(sonar, bumper, of_type("safety", safety, SafetyLimits), link)
        self._leases = [Lease(link, port, settings.lease_s, round_trips=ROUND_TRIPS) for port in self._ports]
        self._stalls = [StallDetector() for _ in self._ports]
        self._motion: Motion[MotionResult] | None = None
        self._driving = False
        self._sensor_lock = link.new_lock()
        self._odometry = Odometry(self._wheels)
        self._correction: CompassCorrection | None = None
        if heading_sensor is not None:
            self._correction = CompassCorrection(heading_sensor, self._odometry, self._read_wheels, link)

    @overload
    def straight(
        self, distance_mm: float, speed_mm_s: float | None = None, *, wait: Literal[True] = True
    ) -> MotionResult: ...
    @overload
    def straight(
        self, distance_mm: float, speed_mm_s: float | None = None, *, wait: Literal[False]
    ) -> Motion[MotionResult]: ...
    def straight(
        self, distance_mm: float, speed_mm_s: float | None = None, *, wait: bool = True
    ) -> MotionResult | Motion[MotionResult]:
        """Drive straight by `distance_mm`, negative: back; returns at rest, in bounded time.

        The safety stop may end a drive forward.

        Args:
            distance_mm: -10000..10000.
            speed_mm_s: Of this drive; by default that of the settings.
            wait: Whether to return at rest; else at once.
        """
        in_range("distance_mm", distance_mm, -STRAIGHT_RANGE_MM, STRAIGHT_RANGE_MM)
        return self._arc(distance_mm, 0.0, speed_mm_s, wait)

    @overload
    def turn(self, angle_deg: float, *, wait: Literal[True] = True) -> MotionResult: ...
    @overload
    def turn(self, angle_deg: float, *, wait: Literal[False]) -> Motion[MotionResult]: ...
    def turn(self, angle_deg: float, *, wait: bool = True) -> MotionResult | Motion[MotionResult]:
        """Turn on the spot by `angle_deg`, positive right, -3600..3600; returns at rest."""
        in_range("angle_deg", angle_deg, -TURN_RANGE_DEG, TURN_RANGE_DEG)
        return self._arc(0.0, angle_deg, None, wait)

    @overload
    def curve(
        self, radius_mm: float, angle_deg: float, speed_mm_s: float | None = None, *, wait: Literal[True] = True
    ) -> MotionResult: ...
    @overload
    def curve(
        self, radius_mm: float, angle_deg: float, speed_mm_s: float | None = None, *, wait: Literal[False]
    ) -> Motion[MotionResult]: ...
    def curve(
        self, radius_mm: float, angle_deg: float, speed_mm_s: float | None = None, *, wait: bool = True
    ) -> MotionResult | Motion[MotionResult]:
        """Drive on a circle until the robot has turned by `angle_deg`, positive right; returns at rest.

        The safety stop may end a drive forward.

        Args:
            radius_mm: Of the path of the middle between the wheels, -10000..10000; negative: drive back.
            angle_deg: -3600..3600.
            speed_mm_s: Of the middle between the wheels; by default that of the settings.
            wait: Whether to return at rest; else at once.
        """
        in_range("radius_mm", radius_mm, -STRAIGHT_RANGE_MM, STRAIGHT_RANGE_MM)
        in_range("angle_deg", angle_deg, -TURN_RANGE_DEG, TURN_RANGE_DEG)
        return self._arc(radius_mm * math.radians(abs(angle_deg)), angle_deg, speed_mm_s, wait)

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        """Drive until the next call, for at most one lease.

        On a link on which nine round trips take longer than the lease, the lease is renewed for that time; reading
        sensors would otherwise let it end between two calls. Speeds beyond those of the motors are reduced, on the same
        curve.

        Returns:
            None; or with motors braked the reason of the safety stop, or STALLED if a wheel has stood for 0.7 s
            although it should turn at 20 deg/s or more. The next call is another try.
        """
        in_range("speed_mm_s", speed_mm_s, -DRIVE_RANGE, DRIVE_RANGE)
        in_range("turn_deg_s", turn_deg_s, -DRIVE_RANGE, DRIVE_RANGE)
        self._link.motions.claim(self._ports)
        with stopping_on_error(self.stop):
            if self._correction is not None and not self._driving:
                self.pose()
            elif (speed_mm_s or turn_deg_s) and self._wheels_unread:
                self._read_wheels()
            if speed_mm_s > 0 and (reason := self._monitor.watch(self._odometry.pose)) is not None:
                self.stop()
                return reason
            speeds = self._wheels.wheels_deg(speed_mm_s, turn_deg_s)
            excess = max(1.0, *(abs(speed) / FASTEST_WHEEL_DEG_S for speed in speeds))
            self._driving = True
            for lease, stall, sign, speed in zip(self._leases, self._stalls, self._wheels.signs, speeds, strict=True):
                turning = lease.drive(sign * speed / excess)
                if not turning or abs(speed) / excess < SEEN_DEG_S:
                    stall.restart(self._link.now())
            if any(stall.stalled for stall in self._stalls):
                for stall, speed in zip(self._stalls, speeds, strict=True):
                    if stall.stalled:
                        stall.count(forward=speed > 0)
                self.stop()
                return StopReason.STALLED
        return None

    @property
    def done(self) -> bool:
        """Whether neither `straight`, `turn` nor `curve` is under way."""
        return self._motion is None or self._motion.done

    def stop(self) -> None:
        """Brake now."""
        self._driving = False
        self._link.motions.claim(self._ports)
        brake_all(self._leases)

    @property
    def last_pose(self) -> Pose:
        """The pose by the latest reading of the wheels."""
        return self._odometry.pose

    def pose(self) -> Pose:
        """Read the wheels and return the pose by odometry.

        With a compass, the heading is corrected when the robot is at rest, which takes two more round trips.

        Raises:
            BrickError: The compass does not answer, and never has.
        """
        self._read_wheels()
        self._correct_heading()
        return self._odometry.pose

    def reset_pose(self, pose: Pose = START) -> None:
        """Set the pose."""
        before = self.pose()
        with self._sensor_lock:
            self._odometry.set_pose(pose)
            self._monitor.forget_echoes()
        if self._correction is not None:
            self._correction.rebase(pose.heading_deg - before.heading_deg)

    def correct_turns(self, scale: float, angle_deg: float) -> None:
        """Scale all turns by `scale` from now on: in the pose, and in commands to the wheels.

        Args:
            scale: 0.5..2.
            angle_deg: The pose counted this turn on the spot, the latest one, in the old way.
        """
        self._wheels = replace(self._wheels, track_mm=self._wheels.track_mm / in_range("scale", scale, 0.5, 2))
        self._odometry.correct((scale - 1.0) * angle_deg, self._wheels)

    def correct_pose(self, turned_deg: float, moved_mm: float) -> None:
        """Add to the pose what the wheels did not show: a turn, positive right, and a way along the heading."""
        in_range("turned_deg", turned_deg, -TURN_RANGE_DEG, TURN_RANGE_DEG)
        self._odometry.correct(turned_deg, moved_mm=in_range("moved_mm", moved_mm, -DRIVE_RANGE, DRIVE_RANGE))

    def range_mm(self) -> float | None:
        """Measure the distance ahead, millimetres; None without an echo or without a sonar."""
        with self._sensor_lock:
            return self._monitor.range_mm(self._odometry.pose)

    def touching(self) -> bool:
        """Return whether the bumper is pressed; False without one."""
        with self._sensor_lock:
            return self._monitor.touching(self._odometry.pose)

    def dead_wheels(self) -> dict[str, bool]:
        """Return which wheels, left and right, do not turn (`StallDetector.dead`), and whether each once has."""
        sides = zip(("left", "right"), self._stalls, strict=True)
        return {side: stall.has_moved for side, stall in sides if stall.dead}

    def use_sonar(self, *, use: bool) -> None:
        """Set whether echoes may stop the robot; without them only the bumper does."""
        self._monitor.uses_sonar = use

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off."""
        self._link.keep_alive()

    def battery_mv(self) -> int:
        """Return the battery voltage in millivolts."""
        return self._link.request(GetBatteryLevel()).voltage_mv

    def on_sensor_change(self, listener: SensorListener) -> None:
        """Leave out sensors that fail instead of raising their errors, and retry them every 10 s.

        Meanwhile their data count as unknown: no range, no touch, a heading by the wheels alone.

        Args:
            listener: Called with ``sonar``, ``bumper`` or ``compass`` and the error in words; with an empty string when
                the sensor answers again. It may be called during a motion and must not use the rover.
        """
        healths = [self._monitor.sonar_health, self._monitor.bumper_health]
        if self._correction is not None:
            healths.append(self._correction.health)
        for health in healths:
            health.listener = listener

    def _arc(
        self, distance_mm: float, angle_deg: float, speed_mm_s: float | None, wait: bool
    ) -> MotionResult | Motion[MotionResult]:
        """Drive `distance_mm` along an arc that turns by `angle_deg`."""
        limits, fastest_mm_s = self.settings, FASTEST_WHEEL_DEG_S * min(self._wheels.mm_per_deg)
        speed_mm_s = limits.speed_mm_s if speed_mm_s is None else in_range("speed_mm_s", speed_mm_s, 1, fastest_mm_s)
        wheels_deg = self._wheels.wheels_deg(distance_mm, angle_deg)
        longest_deg = max(map(abs, wheels_deg))
        # of the limits along the path and of the turn, the stricter one applies
        driven_mm, turned_deg = abs(distance_mm), abs(angle_deg)
        speed_s = max(driven_mm / speed_mm_s, turned_deg / limits.turn_deg_s) or 1.0
        change_s2 = max(driven_mm / limits.acceleration_mm_s2, turned_deg / limits.turn_acceleration_deg_s2)
        speed_deg_s = min(FASTEST_WHEEL_DEG_S, longest_deg / speed_s)
        profile = SpeedProfile(max(SLOWEST_DEG_S, speed_deg_s), longest_deg / change_s2 if change_s2 else math.inf)
        wheels = [
            Wheel(port, sign * (each_deg / longest_deg if longest_deg else 1.0))
            for port, sign, each_deg in zip(self._ports, self._wheels.signs, wheels_deg, strict=True)
            if abs(each_deg) >= STANDING_SHARE * longest_deg
        ]
        self._link.motions.claim(self._ports)
        steps = self._steps(wheels, longest_deg, profile, guarded=distance_mm > 0)
        motion = self._motion = self._link.motions.start(self._ports, steps)
        return motion.join() if wait else motion

    def _steps(
        self, wheels: list[Wheel], angle_deg: float, profile: SpeedProfile, *, guarded: bool
    ) -> Steps[MotionResult]:
        begin, begin_mm, begin_deg = self.pose(), self._odometry.distance_mm, self._odometry.turned_deg
        for lease in self._leases:
            lease.release()
        if guarded and (reason := self._monitor.check_start(begin)) is not None:
            brake_all(self._leases)
            return MotionResult(reason, 0.0, 0.0)
        self._driving = False
        turning = [wheel.port for wheel in wheels]
        for lease, port in zip(self._leases, self._ports, strict=True):
            if port not in turning:  # it may still turn under its last lease
                self._link.mark_driven(port)
                lease.brake()
        guard = self._guard if guarded else unguarded
        # in a motion of only one wheel the other one is read as well
        on_reading = self._update if len(wheels) == len(self._ports) else lambda _: self._read_wheels()
        move = PositionMove(
            self._link, wheels, profile, guard=guard, on_reading=on_reading, lease_s=self.settings.lease_s
        )
        stop = yield from move.steps(angle_deg)
        if stop is StopReason.STALLED:
            ratios = {wheel.port: wheel.ratio for wheel in wheels}
            for stall, port, sign in zip(self._stalls, self._ports, self._wheels.signs, strict=True):
                if port in ratios:
                    stall.count(forward=sign * ratios[port] > 0)
        self._correct_heading()
        return MotionResult(stop, self._odometry.distance_mm - begin_mm, self._odometry.turned_deg - begin_deg)

    def _read_wheels(self) -> None:
        self._update(sample(self._link, *self._ports))

    def _update(self, reading: Sample) -> None:
        """Add a reading of both wheels."""
        if self._odometry.update(reading):
            for stall, angle_deg in zip(self._stalls, reading.angles_deg, strict=True):
                stall.update(reading.time_s, angle_deg)

    @property
    def _wheels_unread(self) -> bool:
        """Whether the latest reading of the wheels is too old; most programs call `pose` between calls of `drive`."""
        fresh_s, last = max(WATCH_S, FRESH_ROUND_TRIPS * self._link.latency_s), self._odometry.last
        return last is None or self._link.now() - last.time_s > fresh_s

    def _correct_heading(self) -> None:
        """Correct the heading by the compass, if there is one and the robot is at rest."""
        if self._correction is not None and ((self.done and not self._driving) or self._odometry.rest_s >= REST_S):
            self._correction.update()

    def _guard(self, near: bool) -> StopReason | None:
        """Return the reason to end a motion; makes no request while the program reads a sensor."""
        mine = self._sensor_lock.acquire(blocking=False)
        try:
            return self._monitor.watch(self._odometry.pose, request=mine and not near)
        finally:
            if mine:
                self._sensor_lock.release()
