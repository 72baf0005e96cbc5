"""Measured values with their times."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

from nxtdrive.link.link import Link

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Reading(Generic[T]):
    """A measured value.

    Attributes:
        value: In the sensor's unit.
        time_s: Time of the measurement on the link's clock: half way between request and reply.
    """

    value: T
    time_s: float

    def age_s(self, now_s: float) -> float:
        """Age at `now_s` of the link's clock."""
        return now_s - self.time_s


class QuantitySensor(ABC, Generic[T]):
    """A sensor of one quantity.

    Attributes:
        link: The link to the brick.
        quantity: What it measures, such as ``distance``.
        unit: Unit of its values, such as ``mm``, or empty.
    """

    quantity: ClassVar[str]
    unit: ClassVar[str] = ""
    link: Link

    @property
    @abstractmethod
    def value(self) -> T:
        """The measured value; the same as the sensor's own property."""

    @abstractmethod
    def set_up(self) -> None:
        """Set up the port and the sensor; measuring does this if necessary."""

    def measure(self) -> Reading[T]:
        """Measure now; errors as for the sensor's own property."""
        begun = self.link.now()
        value = self.value
        return Reading(value, (begun + self.link.now()) / 2)

    def watch(self, every_s: float = 0.0) -> Iterator[Reading[T]]:
        """Measure repeatedly, until the caller stops iterating.

        Args:
            every_s: Interval; 0 is as fast as the link allows.
        """
        self.set_up()
        due = self.link.now()
        while True:
            yield self.measure()
            due = max(due + every_s, self.link.now())
            self.link.sleep(due - self.link.now())
