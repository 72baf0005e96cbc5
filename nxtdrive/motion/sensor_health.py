"""Health of a rover's sensors: one that has failed is left out and retried from time to time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from behaviors.ports import SensorListener
from firmware_protocol.errors import BrickError, NXTError
from nxtdrive.link.protocol import RequestLink
from nxtdrive.sensors.port import SensorTimeout

T = TypeVar("T")

FAILURES = 3
"""A sensor that fails this often in a row is left out."""
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

    def __init__(self, name: str, link: RequestLink) -> None:
        self.listener: SensorListener | None = None
        self.lost = False
        self._name = name
        self._link = link
        self._failures = 0
        self._retry_s = 0.0

    def ask(self, question: Callable[[], T], unknown: T) -> T:
        """Read the sensor, unless it is left out.

        Returns:
            The value, or `unknown` if the sensor has failed.

        Raises:
            BrickError: The sensor has failed, and there is no listener.
            SensorTimeout: The same.
            LinkError: The brick itself does not answer.
        """
        if self.lost and self._link.now() < self._retry_s:
            return unknown
        try:
            answer = question()
        except (BrickError, SensorTimeout) as error:
            if self.listener is None:
                raise
            self._failures += 1
            if self._failures >= FAILURES:
                self.lose(error)
            return unknown
        self._failures = 0
        if self.lost:
            self.lost = False
            if self.listener is not None:
                self.listener(self._name, "")
        return answer

    def lose(self, error: NXTError) -> bool:
        """Leave the sensor out for now; False, and nothing changes, without a listener."""
        if self.listener is None:
            return False
        self._retry_s = self._link.now() + RETRY_S
        if not self.lost:
            self.lost = True
            self.listener(self._name, str(error))
        return True
