"""A compass beside odometry: the wheels know each turn, the needle knows the direction after many.

Wheels slip, and every turn adds its error; a needle has none that grows, but near iron it points elsewhere. So the
needle corrects the heading, by no more than the wheels can have lost since it was last believed. Where it has moved by
more than that, something bends the field: then it is not believed until, somewhere else, it agrees with the wheels
again. Iron in a room turns the needle by the same angle whichever way the robot looks, so a turn on the spot is
measured by the needle at any place.

Source of the figures: docs/motion.md, section on the compass.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from behaviors.angles import wrapped_deg
from firmware_protocol.errors import BrickError
from nxtdrive.link.protocol import RequestLink
from nxtdrive.motion.odometry import NOWHERE, Odometry, Trip
from nxtdrive.motion.sensor_health import FAILURES, SensorHealth
from nxtdrive.sensors import Compass

TURN_LOSS = 0.25
"""Wheels lose at most this part of a turn."""
VEER_DEG_PER_M = 15.0
"""And turn the robot at most so much, unseen, on each metre of way."""
NEEDLE_DEG = 4.0
"""A reading is this good: steps of a degree, and noise of about one."""
REST_DEG = 0.5
"""Doubt in the heading that each reading adds. Where nothing else is in doubt a reading counts by a ninth: single
readings do not shake the heading, and what is left of an error is gone after some twenty."""
SPOT_MM = 30.0
"""Nearer than this it is the same place; the field of a room changes little on so short a way."""

log = logging.getLogger(__name__)


class CompassFilter:
    """Corrects a heading by a compass; both in degrees, clockwise.

    A complementary filter with a gate. Its gain is the part that doubt in the heading has in the doubt in both, so no
    correction is larger than the doubt in the heading.

    Attributes:
        aligned: Whether it has had a first reading, which ties the compass to the heading.
    """

    def __init__(self) -> None:
        self.aligned = False
        self._north_deg = self._before_deg = self._doubt_deg = 0.0
        self._believed = True

    def correction_deg(self, compass_deg: float, heading_deg: float, trip: Trip) -> float:
        """What to add to the heading.

        Args:
            compass_deg: What the compass says, robot at rest.
            heading_deg: The heading by odometry and earlier corrections, not wrapped.
            trip: What the wheels did since the reading before.
        """
        before_deg, self._before_deg = self._before_deg, compass_deg
        if not self.aligned:
            self.aligned, self._north_deg = True, compass_deg - heading_deg
            return 0.0
        lost_deg = TURN_LOSS * abs(trip.turned_deg) + VEER_DEG_PER_M * trip.driven_mm / 1000.0
        error_deg = wrapped_deg(compass_deg - self._north_deg - heading_deg)
        here = trip.away_mm <= SPOT_MM
        plausible = abs(error_deg) <= self._doubt_deg + lost_deg + NEEDLE_DEG
        self._believed = plausible and (self._believed or not here)
        if not self._believed:
            turn_error_deg = wrapped_deg(compass_deg - before_deg - trip.turned_deg)
            if here and abs(turn_error_deg) <= lost_deg + NEEDLE_DEG:
                return turn_error_deg
            self._doubt_deg += lost_deg
            return 0.0
        doubt_deg = self._doubt_deg + lost_deg + REST_DEG
        gain = doubt_deg / (doubt_deg + NEEDLE_DEG)
        self._doubt_deg = doubt_deg * (1.0 - gain)
        return gain * error_deg

    def rename(self, by_deg: float) -> None:
        """The same heading is called `by_deg` more from now on."""
        self._north_deg -= by_deg


class CompassCorrection:
    """Keeps odometry's heading aligned with a compass: one reading for each rest of the robot.

    Only at rest: motors under power are magnets themselves, and needle and wheels are asked at different moments.

    Args:
        compass: The compass.
        odometry: What it corrects.
        read_wheels: Gives odometry a new reading.
        link: Its clock counts.

    Attributes:
        health: Whether the compass answers.
    """

    def __init__(
        self, compass: Compass, odometry: Odometry, read_wheels: Callable[[], None], link: RequestLink
    ) -> None:
        self.health = SensorHealth("compass", link)
        self._compass = compass
        self._odometry = odometry
        self._read_wheels = read_wheels
        self._filter = CompassFilter()
        self._asking = threading.Lock()
        self._failures = 0

    def update(self) -> None:
        """Correct the heading, unless it was since the wheels turned; a reading during which they turn is dropped.

        Raises:
            BrickError: The compass does not answer, and never has. One that falls silent later is left alone; see also
                `SensorHealth.listener`.
        """
        rests = self._filter.aligned and self._odometry.trip == NOWHERE
        if rests or self._failures >= FAILURES or not self._asking.acquire(blocking=False):
            return
        try:
            self.health.ask(self._ask, None)
            self._failures = 0
        except BrickError as error:
            if not self._filter.aligned:
                raise
            self._failures += 1
            if self._failures == FAILURES:
                log.warning("the compass does not answer any more; the heading comes from the wheels: %s", error)
        finally:
            self._asking.release()

    def rename(self, by_deg: float) -> None:
        """The same heading is called `by_deg` more from now on."""
        self._filter.rename(by_deg)

    def _ask(self) -> None:
        odometry = self._odometry
        still_since_s, compass_deg = odometry.still_since_s, self._compass.heading_deg
        self._read_wheels()
        if odometry.still_since_s == still_since_s:
            odometry.correct(self._filter.correction_deg(compass_deg, odometry.pose.heading_deg, odometry.trip))
