"""Correction of odometry's heading by a compass.

Wheels slip, and every turn adds to the error of the heading. The error of a compass does not grow, but iron nearby
deflects it. So the compass corrects the heading by no more than the wheels can have lost since its last accepted
reading. A larger deviation means a distorted field: the compass is then ignored until it agrees with the wheels again
at another place. Iron in a room deflects the compass by the same angle whatever the robot's heading, so turns on the
spot can be measured by the compass everywhere.

Source of the figures: docs/motion.md, section on the compass.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from behaviors.angles import wrapped_deg
from nxtdrive.link.link import Link
from nxtdrive.motion.odometry import NO_MOTION, Odometry, OdometryDelta
from nxtdrive.motion.sensor_health import SENSOR_ERRORS, SensorHealth
from nxtdrive.sensors import Compass

TURN_LOSS = 0.25
"""Largest part of a turn that slipping wheels lose."""
MAX_DRIFT_DEG_PER_M = 15.0
"""Largest turn per metre driven that the wheels' counters do not show."""
READING_DEG = 4.0
"""Error bound of a reading: steps of one degree, and noise of about one."""
REST_DEG = 0.5
"""Uncertainty of the heading that each reading adds. Without any other, a reading has a weight of a ninth: noise is
smoothed, and a remaining error is gone after about twenty readings."""
SAME_PLACE_MM = 30.0
"""Readings closer together than this count as one place; the field of a room changes little over this distance."""

log = logging.getLogger(__name__)


class CompassFilter:
    """Corrects a heading by a compass; both in degrees, clockwise.

    A complementary filter with a gate. Its gain is the heading's share of the uncertainty of heading and compass
    together, so no correction exceeds the uncertainty of the heading.

    Attributes:
        aligned: Whether there was a first reading, which relates the compass to the heading.
    """

    def __init__(self) -> None:
        self.aligned = False
        self._north_deg = self._before_deg = self._uncertainty_deg = 0.0
        self._trusted = True

    def correction_deg(self, compass_deg: float, heading_deg: float, moved: OdometryDelta) -> float:
        """Update with a reading; return the correction to add to the heading, in degrees.

        Args:
            compass_deg: The compass reading, robot at rest.
            heading_deg: The heading by odometry and earlier corrections, not wrapped.
            moved: The wheels' motion since the previous reading.
        """
        before_deg, self._before_deg = self._before_deg, compass_deg
        if not self.aligned:
            self.aligned, self._north_deg = True, compass_deg - heading_deg
            return 0.0
        lost_deg = TURN_LOSS * abs(moved.turned_deg) + MAX_DRIFT_DEG_PER_M * moved.driven_mm / 1000.0
        error_deg = wrapped_deg(compass_deg - self._north_deg - heading_deg)
        here = moved.away_mm <= SAME_PLACE_MM
        plausible = abs(error_deg) <= self._uncertainty_deg + lost_deg + READING_DEG
        self._trusted = plausible and (self._trusted or not here)
        if not self._trusted:
            turn_error_deg = wrapped_deg(compass_deg - before_deg - moved.turned_deg)
            if here and abs(turn_error_deg) <= lost_deg + READING_DEG:
                return turn_error_deg
            self._uncertainty_deg += lost_deg
            return 0.0
        uncertainty_deg = self._uncertainty_deg + lost_deg + REST_DEG
        gain = uncertainty_deg / (uncertainty_deg + READING_DEG)
        self._uncertainty_deg = uncertainty_deg * (1.0 - gain)
        return gain * error_deg

    def rebase(self, by_deg: float) -> None:
        """Follow a change of reference by which the same heading reads `by_deg` more."""
        self._north_deg -= by_deg


class CompassCorrection:
    """Corrects odometry's heading by one compass reading each time the robot is at rest.

    Only at rest, because motors under power are magnets, and compass and wheels are read at different times.

    Args:
        compass: The compass.
        odometry: The odometry to correct.
        read_wheels: Updates the odometry from the wheels.
        link: The link, for its clock.

    Attributes:
        health: Whether the compass answers.
    """

    def __init__(self, compass: Compass, odometry: Odometry, read_wheels: Callable[[], None], link: Link) -> None:
        self.health = SensorHealth("compass", link)
        self._compass = compass
        self._odometry = odometry
        self._read_wheels = read_wheels
        self._filter = CompassFilter()
        self._measuring = threading.Lock()
        self._left_out = False

    def update(self) -> None:
        """Correct the heading, unless the wheels have not turned since the last correction.

        A reading during which the wheels turn is dropped.

        Raises:
            BrickError: The compass does not answer and never has. One that fails later is ignored; see also
                `SensorHealth.listener`.
            SensorTimeout: The same.
        """
        rests = self._filter.aligned and self._odometry.since_correction == NO_MOTION
        if rests or self._left_out or not self._measuring.acquire(blocking=False):
            return
        try:
            self.health.read(self._measure, None)
        except SENSOR_ERRORS as error:
            if not self._filter.aligned:
                raise
            self._left_out = self.health.failing
            if self._left_out:
                log.warning("the compass does not answer any more; the heading comes from the wheels: %s", error)
        finally:
            self._measuring.release()

    def rebase(self, by_deg: float) -> None:
        """Follow a change of reference by which the same heading reads `by_deg` more."""
        self._filter.rebase(by_deg)

    def _measure(self) -> None:
        odometry = self._odometry
        still_since_s, compass_deg = odometry.still_since_s, self._compass.heading_deg
        self._read_wheels()
        if odometry.still_since_s == still_since_s:
            heading_deg, moved = odometry.pose.heading_deg, odometry.since_correction
            odometry.correct(self._filter.correction_deg(compass_deg, heading_deg, moved))
