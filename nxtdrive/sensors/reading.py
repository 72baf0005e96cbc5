"""A measured value and when it held."""

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
        time_s: When it held, on the link's clock: half way between question and answer.
    """

    value: T
    time_s: float

    def age_s(self, now_s: float) -> float:
        """How old it is at `now_s` of the link's clock."""
        return now_s - self.time_s


class Measuring(ABC, Generic[T]):
    """Anything on a brick that measures one quantity.

    Attributes:
        link: The way to the brick.
        quantity: What it measures, such as ``distance``.
        unit: Of its values, such as ``mm``; empty for values that have none.
    """

    quantity: ClassVar[str]
    unit: ClassVar[str] = ""
    link: SensorLink

    @property
    @abstractmethod
    def value(self) -> T:
        """The quantity now; what the sensor's own property says."""

    @abstractmethod
    def set_up(self) -> None:
        """Make the port and the sensor ready to measure; measuring does so by itself when it must."""

    def measure(self) -> Reading[T]:
        """The quantity now, and when that was; errors as for the sensor's own property."""
        begun = self.link.now()
        value = self.value
        return Reading(value, (begun + self.link.now()) / 2)

    def watch(self, every_s: float = 0.0) -> Iterator[Reading[T]]:
        """Measure again and again, for as long as somebody asks.

        Args:
            every_s: From one reading to the next; 0 is as fast as the link allows.
        """
        self.set_up()
        due = self.link.now()
        while True:
            yield self.measure()
            due = max(due + every_s, self.link.now())
            self.link.sleep(due - self.link.now())
