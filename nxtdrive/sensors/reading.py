"""Measured values with their time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

from nxtdrive.link.protocol import SensorLink

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Reading(Generic[T]):
    """A measured value.

    Attributes:
        value: In the sensor's unit.
        time_s: Time of the measurement on the link's clock: the midpoint between request and reply.
    """

    value: T
    time_s: float

    def age_s(self, now_s: float) -> float:
        """Return its age at `now_s` on the link's clock."""
        return now_s - self.time_s


class Measuring(ABC, Generic[T]):
    """A sensor or motor that measures one quantity.

    Attributes:
        link: The link to the brick.
        quantity: The measured quantity, such as ``distance``.
        unit: Unit of the values, such as ``mm``; empty for values without a unit.
    """

    quantity: ClassVar[str]
    unit: ClassVar[str] = ""
    link: SensorLink

    @property
    @abstractmethod
    def value(self) -> T:
        """The current value; the same as the sensor's specific property."""

    @abstractmethod
    def set_up(self) -> None:
        """Prepare the port and the sensor; a measurement does so itself if needed."""

    def measure(self) -> Reading[T]:
        """Measure once; return the value with its time. Errors are those of the sensor's specific property."""
        begun = self.link.now()
        value = self.value
        return Reading(value, (begun + self.link.now()) / 2)

    def watch(self, every_s: float = 0.0) -> Iterator[Reading[T]]:
        """Yield readings endlessly.

        Args:
            every_s: Period of the readings, seconds; 0 is as fast as the link allows.
        """
        self.set_up()
        due = self.link.now()
        while True:
            yield self.measure()
            due = max(due + every_s, self.link.now())
            self.link.sleep(due - self.link.now())
