"""Health of a rover's sensors: one that has failed is left out and retried from time to time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

from behaviors.ports import SensorListener
from firmware_protocol.errors import BrickError, NXTError, SensorTimeout
from nxtdrive.link.link import Link

T = TypeVar("T")


class SensorStuck(NXTError):
    """A sensor reports something impossible."""


SENSOR_ERRORS = (BrickError, SensorTimeout, SensorStuck)
"""Errors of a sensor at a brick that answers."""
FAILURES = 3
"""A sensor that fails this many times in a row is left out."""
RETRY_S = 10.0
"""Time between two retries of a sensor that is left out; over Bluetooth each takes up to 0.5 s."""


class SensorHealth:
    """The health of one sensor.

    Without a `listener`, failures are raised, as an ordinary program expects.

    Args:
        name: ``sonar``, ``bumper`` or ``compass``.
        link: The link, for its clock.

    Attributes:
        listener: Called when the sensor fails and when it answers again; None: failures are raised.
        lost: Whether the sensor is left out.
    """

    def __init__(self, name: str, link: Link) -> None:
        self.listener: SensorListener | None = None
        self.lost = False
        self._name = name
        self._link = link
        self._failures = 0
        self._retry_s = -math.inf

    def read(self, measure: Callable[[], T], unknown: T) -> T:
        """Read the sensor, unless it is left out.

        Returns:
            The value, or `unknown` if the sensor has failed.

        Raises:
            BrickError: The sensor has failed, and there is no listener.
            SensorTimeout: The same.
            LinkError: The brick itself does not answer.
        """
        if self._link.now() < self._retry_s:
            return unknown
        try:
            value = measure()
        except SENSOR_ERRORS as error:
            self.failed(error)
            if self.listener is None:
                raise
            return unknown
        self.worked()
        return value

    @property
    def failing(self) -> bool:
        """Whether the sensor has failed `FAILURES` times in a row."""
        return self._failures >= FAILURES

    def failed(self, error: NXTError) -> None:
        """Count a failure; with a listener, leave the sensor out for now if it is `failing`."""
        self._failures += 1
        if self.listener is None or not self.failing:
            return
        self._retry_s = self._link.now() + RETRY_S
        if not self.lost:
            self.lost = True
            self.listener(self._name, str(error))

    def worked(self) -> None:
        """Forget the failures, and use the sensor again if it was left out."""
        self._failures = 0
        if self.lost:
            self.lost = False
            if self.listener is not None:
                self.listener(self._name, "")
