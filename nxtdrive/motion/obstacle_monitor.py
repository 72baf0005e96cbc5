"""The safety stop: watches sonar and bumper while the rover drives forward."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace

from behaviors.ports import Pose, StopReason
from firmware_protocol.errors import BrickError
from nxtdrive.link.link import Link
from nxtdrive.motion.bumper_trust import BumperTrust
from nxtdrive.motion.sensor_health import SENSOR_ERRORS, SensorHealth, SensorStuck
from nxtdrive.ports import in_range
from nxtdrive.sensors import Touch, Ultrasonic

FRESH_S = 0.3
"""Oldest echo that may decide whether a motion begins, or stand for a new measurement."""
MAX_ECHO_AGE_S = 1.0
"""An echo older than this is ignored, and a measurement that takes longer is lost; the link's latency is added."""
POLLS = 2
"""Largest number of polls of a measurement before it is dropped: the first may come while the bus is busy."""
ROUND_TRIPS = 8
"""Round trips from the start of a measurement to the end of the next: wheels, bumper, wheels, sonar, twice."""
FARTHEST_MM = 2550.0
"""The sonar gives distances as whole centimetres in one byte."""


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """When the safety stop ends driving forward.

    Attributes:
        enabled: Whether there is a safety stop.
        stop_distance_mm: An echo at this distance or nearer stops the robot, 0..2550; so does the bumper.

    Raises:
        LocalProtocolError: `stop_distance_mm` is not a number in its range.
    """

    enabled: bool = True
    stop_distance_mm: float = 200.0

    def __post_init__(self) -> None:
        """Check the distance."""
        in_range("stop_distance_mm", self.stop_distance_mm, 0, FARTHEST_MM)


@dataclass(frozen=True, slots=True)
class Echo:
    """A measurement of the sonar.

    Attributes:
        distance_mm: To the nearest echo, None without one.
        time_s: When the measurement began.
        pose: The robot's pose at that time, by odometry.
    """

    distance_mm: float | None
    time_s: float
    pose: Pose

    def distance_from(self, pose: Pose) -> float:
        """Return the distance from `pose` to the source of the echo if that stands still; infinity without an echo."""
        return math.inf if self.distance_mm is None else self.distance_mm - self.pose.forward_mm_to(pose)


class ObstacleMonitor:
    """Watches the path ahead with few requests: on a slow link each takes as long as reading the wheels.

    Args:
        sonar: The sonar, or None.
        bumper: The bumper, or None.
        settings: When to stop.
        link: The link to the brick.

    Attributes:
        sonar_health: Whether the sonar answers.
        bumper_health: Whether the bumper answers.
        uses_sonar: Whether echoes may stop the robot.
    """

    def __init__(self, sonar: Ultrasonic | None, bumper: Touch | None, settings: SafetyLimits, link: Link) -> None:
        self._sonar = sonar
        self._bumper = bumper
        self._settings = settings
        self._link = link
        self._echo: Echo | None = None
        self._started: Echo | None = None
        self._bumper_turn = self._pressed = False
        self._bumper_trust = BumperTrust()
        self.sonar_health = SensorHealth("sonar", link)
        self.bumper_health = SensorHealth("bumper", link)
        self.uses_sonar = True

    def range_mm(self, pose: Pose) -> float | None:
        """Measure the distance ahead; None without an echo or without a sonar."""
        sonar = self._sonar
        return None if sonar is None else self.sonar_health.read(lambda: self._measure(sonar, pose), None)

    def _measure(self, sonar: Ultrasonic, pose: Pose) -> float | None:
        if not sonar.ready:
            sonar.set_up()
        started_s = self._link.now()
        if self._started is not None and started_s - self._started.time_s <= FRESH_S:
            # to drop a measurement that has just been started would take two more round trips
            with suppress(BrickError):
                for _ in range(POLLS):
                    there, distance_mm = sonar.poll()
                    if there:
                        self._echo, self._started = replace(self._started, distance_mm=distance_mm), None
                        return distance_mm
        self._echo, self._started = Echo(sonar.distance_mm, started_s, pose), None
        return self._echo.distance_mm

    def touching(self, pose: Pose) -> bool:
        """Return whether the bumper is pressed; False without one, and if it fails or sticks with a listener."""
        bumper = self._bumper
        self._pressed = bumper is not None and self.bumper_health.read(lambda: self._feel(bumper, pose), False)
        return self._pressed

    def _feel(self, bumper: Touch, pose: Pose) -> bool:
        pressed = bumper.pressed
        if self._bumper_trust.sticks(pressed, pose) and self.bumper_health.listener is not None:
            raise SensorStuck(
                "it stays pressed when the robot backs off.", remedy="Does something jam it, or is its cable damaged?"
            )
        return pressed

    def check_start(self, pose: Pose) -> StopReason | None:
        """Read both sensors before a motion; return the reason not to begin it, or None."""
        if not self._settings.enabled:
            return None
        if self.touching(pose):
            return StopReason.CONTACT
        if self.uses_sonar and (self._echo is None or self._link.now() - self._echo.time_s > FRESH_S):
            self.range_mm(pose)
        return self._stop_reason(pose)

    def watch(self, pose: Pose, *, request: bool = True) -> StopReason | None:
        """Check during a motion; return the reason to end it, or None.

        Makes one request at most, to bumper and sonar in turn; while the bumper is pressed, to the bumper. The sonar
        measures while the wheels are controlled; the distance driven since the measurement began is subtracted.

        Args:
            pose: Where the robot is now.
            request: Whether there is time for a request.

        Raises:
            BrickError: The sonar no longer answers; see `SensorHealth.listener`.
            SensorTimeout: The same.
        """
        if not self._settings.enabled:
            return None
        if request:
            sonar = self._sonar if self.uses_sonar and not self.sonar_health.lost else None
            self._bumper_turn = self._pressed or sonar is None or (self._bumper is not None and not self._bumper_turn)
            if sonar is None or self._bumper_turn:
                self.touching(pose)
            else:
                self._poll_sonar(sonar, pose)
        return StopReason.CONTACT if self._pressed else self._stop_reason(pose)

    def forget_echoes(self) -> None:
        """Forget the measurements so far: their poses are not in the frame of the next ones."""
        self._echo = self._started = None

    def _stop_reason(self, pose: Pose) -> StopReason | None:
        echo = self._echo  # another thread may forget it meanwhile
        if echo is None or not self.uses_sonar or self._link.now() - echo.time_s > self._forgotten_s:
            return None
        return StopReason.OBSTACLE if echo.distance_from(pose) <= self._settings.stop_distance_mm else None

    def _poll_sonar(self, sonar: Ultrasonic, pose: Pose) -> None:
        """Fetch the measurement that was started last time, and start the next."""
        try:
            if self._started is not None:
                there, distance_mm = sonar.poll()
                if there:
                    self._echo = Echo(distance_mm, self._started.time_s, self._started.pose)
                    self.sonar_health.worked()
                elif self._link.now() - self._started.time_s < self._forgotten_s:
                    return
            sonar.start()
            self._started = Echo(None, self._link.now(), pose)
        except SENSOR_ERRORS as error:
            self._started = None
            self.sonar_health.failed(error)
            if self.sonar_health.failing and self.sonar_health.listener is None:
                raise

    @property
    def _forgotten_s(self) -> float:
        return MAX_ECHO_AGE_S + (ROUND_TRIPS * self._link.latency_s if self._sonar is not None else 0.0)
