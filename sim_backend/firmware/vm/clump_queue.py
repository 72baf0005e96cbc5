"""Queues of clumps: those that run, those that sleep, and those that wait for a mutex.

The record of a clump has one link for all of them, so a clump is in one queue at a time; one that enters a second queue
breaks the first. A queue itself is two bytes, the numbers of its first and its last clump.

Source: docs/firmware.md section 8.3.
"""

from __future__ import annotations

from collections.abc import Iterator

NO_CLUMP = 0xFF
"""The number that means no clump."""

_CLUMPS = 0x100
"""Number of possible clumps; a longer queue is a circle, in which the firmware hangs."""


class ClumpQueue:
    """A queue of clumps.

    Attributes:
        ends: Numbers of the first and the last clump.
    """

    def __init__(self, pool: bytearray, record: int, link: int, ends: bytearray | None = None, at: int = 0) -> None:
        """Open a queue.

        Args:
            pool: The memory that begins with the records of the clumps.
            record: Size of a record.
            link: Place of the link in a record.
            ends: Memory with the two bytes of the queue; without it the queue is new and empty.
            at: Their place.
        """
        self._pool, self._record, self._link = pool, record, link
        self.ends = bytearray([NO_CLUMP] * 2) if ends is None else memoryview(ends)[at : at + 2]

    @property
    def first(self) -> int:
        """Number of the first clump."""
        return self.ends[0]

    @property
    def last(self) -> int:
        """Number of the last clump."""
        return self.ends[1]

    def _link_at(self, number: int) -> int:
        return number * self._record + self._link

    def __iter__(self) -> Iterator[int]:
        """Follow the links; the clump that was returned may leave the queue."""
        number = self.first
        for _ in range(_CLUMPS):
            if number == NO_CLUMP:
                return
            following = self._pool[self._link_at(number)]
            yield number
            number = following

    def append(self, number: int) -> None:
        """Put a clump at the end."""
        self._pool[self._link_at(number)] = NO_CLUMP
        if self.first == NO_CLUMP:
            self.ends[0] = number
        else:
            self._pool[self._link_at(self.last)] = number
        self.ends[1] = number

    def remove(self, number: int) -> None:
        """Remove a clump."""
        at = self._link_at(number)
        following = self._pool[at]
        if number == self.first:
            self.ends[0] = following
            if following == NO_CLUMP:
                self.ends[1] = NO_CLUMP
        else:
            before = next((one for one in self if self._pool[self._link_at(one)] == number), None)
            if before is not None:
                self._pool[self._link_at(before)] = following
                if number == self.last:
                    self.ends[1] = before
        self._pool[at] = NO_CLUMP

    def rotate(self) -> None:
        """Put the first clump at the end."""
        ends = self.ends
        number, last = ends
        if number != last:
            at = self._link_at(number)
            ends[0] = self._pool[at]
            self._pool[self._link_at(last)] = number
            ends[1], self._pool[at] = number, NO_CLUMP
