"""Links to the simulated brick, with latency, ordering and scheduled faults."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field
from random import Random
from typing import Protocol

from firmware_protocol.framing import LENGTH_SIZE, frame


class Timeline(Protocol):
    """The part of the simulation that a link uses."""

    @property
    def now_ms(self) -> int:
        """Simulation time."""

    def advance(self, duration_ms: int) -> None:
        """Advance the simulation."""

    def at(self, due_ms: int, action: Callable[[], None]) -> None:
        """Run `action` at that time."""

    def deliver(self, telegram: bytes) -> bytes | None:
        """Deliver a telegram to the brick over USB now."""

    def deliver_bluetooth(self, framed: bytes) -> bytes:
        """Deliver a telegram to the brick over Bluetooth now."""

    def unplug(self) -> None:
        """Pull the USB cable now."""


@dataclass(frozen=True)
class LinkFaults:
    """Faults of a link. Telegrams are counted from 0 on each link.

    Attributes:
        drop_requests: Numbers of the telegrams that never reach the brick, in any container, such as
            `range(0, 10**6, 7)`.
        drop_replies: Numbers of the telegrams whose reply is lost.
        duplicate_replies: Numbers of the telegrams whose reply arrives twice.
        corrupt_replies: Numbers of the telegrams whose reply arrives with all bits inverted except its length.
        delay_replies_ms: Extra delay of the reply by number of the telegram; later replies queue behind it.
        silent_ms: Spans (from, to) of simulation time in which nothing gets through in either direction.
        unplugged_ms: Spans (from, to) without a cable: a link that is open at the start is lost, and none can be
            opened before the end.
        weak_ms: Spans (from, to) at the edge of the radio's range, in which `weak_latency_ms` and `weak_loss` apply.
        weak_latency_ms: Shortest and longest round trip there; each telegram's is drawn from this range.
        weak_loss: Share of the telegrams there of which request or reply is lost, 0..1.
    """

    drop_requests: Container[int] = ()
    drop_replies: Container[int] = ()
    duplicate_replies: Container[int] = ()
    corrupt_replies: Container[int] = ()
    delay_replies_ms: Mapping[int, int] = field(default_factory=dict)
    silent_ms: tuple[tuple[int, int], ...] = ()
    unplugged_ms: tuple[tuple[int, int], ...] = ()
    weak_ms: tuple[tuple[int, int], ...] = ()
    weak_latency_ms: tuple[int, int] = (300, 1500)
    weak_loss: float = 0.05

    def silent(self, now_ms: int) -> bool:
        """Return whether nothing gets through at this time."""
        return any(start <= now_ms < end for start, end in self.silent_ms)

    def unplugged(self, since_ms: int, now_ms: int) -> bool:
        """Return whether a link opened at `since_ms` has lost its cable by `now_ms`."""
        return any(start <= now_ms and since_ms < end for start, end in self.unplugged_ms)

    def weakened(self, number: int, now_ms: int) -> tuple[int, bool, bool] | None:
        """Return the round trip of a telegram that is sent at this time, and whether request and reply are lost.

        None outside the spans of `weak_ms`.
        """
        if not any(start <= now_ms < end for start, end in self.weak_ms):
            return None
        random = Random(f"{now_ms}/weak {number}")
        lost = random.random() < self.weak_loss
        request_lost = lost and random.random() < 0.5
        return random.randint(*self.weak_latency_ms), request_lost, lost and not request_lost


NO_FAULTS = LinkFaults()


class SimLink:
    """A link to the simulated brick.

    Telegrams keep their order; the brick accepts one per pass of 1 ms.

    Args:
        simulation: The brick and its clock.
        latency_ms: Round trip, rounded to whole milliseconds; the brick itself needs one.
        faults: Faults of the link.
        bluetooth: Whether this is a Bluetooth link instead of a cable: the limits are those of Bluetooth, each reply
            is preceded by its length, and the end of the link closes no files.

    Raises:
        ConnectionError: The cable is unplugged.
    """

    def __init__(
        self,
        simulation: Timeline,
        latency_ms: float = 0.0,
        faults: LinkFaults = NO_FAULTS,
        *,
        bluetooth: bool = False,
    ) -> None:
        self._simulation, self._faults, self._bluetooth = simulation, faults, bluetooth
        self._latency_ms = max(0, round(latency_ms))
        self._opened_ms = simulation.now_ms
        self._sent = 0
        self._deliveries: deque[int] = deque()
        self._next_pass_ms = 0
        self._replies: deque[tuple[int, bytes]] = deque()
        self._open = True
        self._check_cable()
        for start_ms, _ in faults.unplugged_ms:
            if start_ms > self._opened_ms and not bluetooth:
                simulation.at(start_ms, simulation.unplug)

    @property
    def is_open(self) -> bool:
        """Whether the link is open; an unplugged cable is noticed at the next call."""
        return self._open

    @property
    def arrived(self) -> bool:
        """Whether a reply has arrived that was not read.

        Raises:
            ConnectionError: The cable was unplugged, or the link is closed.
        """
        self._check_cable()
        return bool(self._replies) and self._replies[0][0] <= self._simulation.now_ms

    @property
    def under_way(self) -> int:
        """Number of telegrams that have not reached the brick, and replies that have not been read."""
        return len(self._deliveries) + len(self._replies)

    def send(self, telegram: bytes) -> None:
        """Send a telegram to the brick; does not wait.

        Raises:
            ConnectionError: The cable was unplugged, or the link is closed.
        """
        self._check_cable()
        number, sent_ms = self._sent, self._simulation.now_ms
        self._sent += 1
        weakened = self._faults.weakened(number, sent_ms)
        latency_ms, request_lost, reply_lost = weakened or (self._latency_ms, False, False)
        if request_lost or number in self._faults.drop_requests or self._faults.silent(sent_ms):
            return
        due_ms = max(sent_ms + latency_ms // 2, self._next_pass_ms)
        self._next_pass_ms = due_ms + 1
        self._deliveries.append(due_ms)
        self._simulation.at(due_ms, lambda: self._deliver(number, sent_ms + latency_ms, reply_lost, telegram))

    def poll(self) -> bytes | None:
        """Return the next reply that has arrived, or None.

        Raises:
            ConnectionError: The cable was unplugged, or the link is closed.
        """
        return self._replies.popleft()[1] if self.arrived else None

    def receive(self, timeout_ms: int) -> bytes | None:
        """Run the simulation until a reply arrives, at most `timeout_ms`; None without one.

        Raises:
            ConnectionError: The cable was unplugged, or the link is closed.
        """
        deadline_ms = self._simulation.now_ms + timeout_ms
        while (reply := self.poll()) is None:
            now_ms = self._simulation.now_ms
            if now_ms >= deadline_ms:
                return None
            self._simulation.advance(self._next_news_ms(now_ms, deadline_ms) - now_ms)
        return reply

    def close(self) -> None:
        """Close the link; sent telegrams still reach the brick, replies are lost."""
        self._open = False

    def _next_news_ms(self, now_ms: int, deadline_ms: int) -> int:
        news = [deadline_ms]
        news += [start_ms for start_ms, _ in self._faults.unplugged_ms if start_ms > now_ms]
        if self._replies:
            news.append(self._replies[0][0])
        if self._deliveries:
            news.append(self._deliveries[0] + 1)
        return min(news)

    def _deliver(self, number: int, reply_ms: int, reply_lost: bool, telegram: bytes) -> None:
        self._deliveries.popleft()
        now_ms = self._simulation.now_ms
        if self._faults.unplugged(self._opened_ms, now_ms):
            return
        reply = self._ask(telegram)
        due_ms = max(reply_ms, now_ms + 1) + self._faults.delay_replies_ms.get(number, 0)
        if not reply or reply_lost or number in self._faults.drop_replies or self._faults.silent(due_ms):
            return
        if number in self._faults.corrupt_replies:
            intact = LENGTH_SIZE if self._bluetooth else 0
            reply = reply[:intact] + bytes(byte ^ 0xFF for byte in reply[intact:])
        copies = 2 if number in self._faults.duplicate_replies else 1
        self._replies.extend([(due_ms, reply)] * copies)

    def _ask(self, telegram: bytes) -> bytes | None:
        if self._bluetooth:
            return self._simulation.deliver_bluetooth(frame(telegram))
        return self._simulation.deliver(telegram)

    def _check_cable(self) -> None:
        if not self._open:
            raise ConnectionError("the link to the simulated brick is closed")
        if self._faults.unplugged(self._opened_ms, self._simulation.now_ms):
            self._open = False
            raise ConnectionError("the cable to the simulated brick was unplugged")
