"""A faulty wire to a simulated brick, in virtual time."""

from __future__ import annotations

import errno
import math
import os
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from random import Random
from typing import NoReturn

from firmware_protocol.direct import GetCurrentProgramName, StopProgram
from firmware_protocol.framing import LENGTH_SIZE, frame
from firmware_protocol.status import Status
from firmware_protocol.telegram import REPLY_HEADER
from sim_backend.firmware.brick import SimBrick
from sim_backend.simulation import Simulation

FOREVER_MS = 10**9
REBOOT_MS = 8000
"""Time that a restarted brick takes until it accepts a link again."""
MERGE_MS = 15
"""Interval at which a merging serial stream passes its bytes on."""

USB, STREAM, BYTES, MERGED = "USB packets", "serial stream", "serial, single bytes", "serial, merged"
TRANSPORTS = (USB, STREAM, BYTES, MERGED)

FOR_GOOD, RESTARTED = "pulled for good", "brick restarted"
PULLED_MS = {
    FOR_GOOD: FOREVER_MS,
    "pulled for 0.3 s": 300,
    "pulled for 2 s": 2000,
    "pulled for 8 s": 8000,
    RESTARTED: REBOOT_MS,
}
SILENT_MS = {"silent for 1.5 s": 1500, "silent for 5 s": 5000}
LATE_MS = {"reply late by 0.2 s": 200, "reply late by 1 s": 1000, "reply late by 3 s": 3000}
ERRORS = {"EIO": errno.EIO, "EPIPE or write timeout": errno.EPIPE}
"""The second: a stalled endpoint on USB, a serial port that takes nothing."""
REQUEST_LOST, REPLY_LOST, DOUBLED = "request lost", "reply lost", "reply doubled"
TRUNCATED, FLIPPED, REFUSED = "reply truncated", "bits flipped", "refused"
SPLIT, HELD = "reply in two parts", "reply held for the next"
KINDS = (
    *PULLED_MS,
    *SILENT_MS,
    *LATE_MS,
    *ERRORS,
    REQUEST_LOST,
    REPLY_LOST,
    DOUBLED,
    TRUNCATED,
    FLIPPED,
    REFUSED,
    SPLIT,
    HELD,
)
"""All kinds of faults."""

STATUSES = (0x20, 0xBD, 0xBF, 0xC0, 0xDB, 0xDD, 0xDE, 0xE0, 0xEC, 0xFB, 0xFF)
"""Refusals. Those that are regular answers are left out: "no such file" ends a listing, and 0xEC says that no program
runs."""
SPLIT_MS = (20, 450)
"""Range of the pause within a reply."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault of a wire.

    Attributes:
        kind: One of `KINDS`.
        at: Number of the telegram that it happens to, from 0, counted over all links of the wire.
        draw: Seed of its random details.
    """

    kind: str
    at: int
    draw: int = 0


@dataclass(frozen=True, slots=True)
class Exchange:
    """A telegram that the brick received.

    Attributes:
        time_ms: When.
        request: The telegram.
        reply: The reply as the wire delivers it, without its length; None without one.
    """

    time_ms: int
    request: bytes
    reply: bytes | None


class Wire:
    """The connection between the driver and a simulated brick; at most one link is open at a time.

    Args:
        simulation: Holds brick and clock.
        transport: One of `TRANSPORTS`.
        fault: The fault that occurs, if any.
        latency_ms: Round trip.

    Attributes:
        count: Number of telegrams sent.
        error: Number of the operating system's error that a fault raised, until it is reset.
        exchanges: Each telegram that the brick received.
        on_loss: Called with the end of the time, in milliseconds, during which the brick cannot be reached.
    """

    def __init__(self, simulation: Simulation, transport: str, fault: Fault | None, latency_ms: int = 2) -> None:
        self.simulation = simulation
        self.transport = transport
        self.count = self.error = 0
        self.exchanges: list[Exchange] = []
        self.on_loss: Callable[[int], None] = lambda _until_ms: None
        self._fault = fault
        self._random = Random(f"{fault}")  # noqa: S311 - repeatable
        self._latency_ms = latency_ms
        self._away_until_ms = self._silent_until_ms = 0
        self._links = 0
        self._under_way: deque[int] = deque()
        self._arrivals: deque[tuple[int, bytes]] = deque()
        self._next_pass_ms = self._last_due_ms = 0
        self._held = b""

    # --- the driver's end ---

    def open(self) -> int:
        """Open a link and return its number.

        Raises:
            OSError: The brick cannot be reached.
        """
        if not self.reachable:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        self._links += 1
        return self._links

    def disconnect(self, link: int) -> None:
        """Close a link."""
        if link == self._links:
            self._links += 1
            self._arrivals.clear()

    def check(self, link: int) -> None:
        """Raise OSError if the link is lost."""
        if link != self._links:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))

    def send(self, link: int, telegram: bytes) -> None:
        """Send a telegram; OSError if the link is lost."""
        self.check(link)
        number, now_ms = self.count, self.simulation.now_ms
        self.count += 1
        kind = self._kind(number)
        if kind in SILENT_MS:
            self.silence(SILENT_MS[kind])
        if kind in PULLED_MS and self._random.random() < 1 / 3:
            self.pull(kind)
            self.check(link)
        if kind in ERRORS and self._random.random() < 1 / 3:
            self._fail(ERRORS[kind])
        if kind == REQUEST_LOST or now_ms < self._silent_until_ms:
            return
        due_ms = max(now_ms + self._latency_ms // 2, self._next_pass_ms)
        self._next_pass_ms = due_ms + 1
        self._under_way.append(due_ms)
        self.simulation.at(due_ms, lambda: self._deliver(link, number, telegram))

    def wait(self, link: int, timeout_ms: int) -> bool:
        """Let time pass until something has arrived, at most `timeout_ms`; OSError if the link is lost."""
        deadline_ms = self.simulation.now_ms + timeout_ms
        while True:
            self.check(link)
            now_ms = self.simulation.now_ms
            if self._arrivals and self._arrivals[0][0] <= now_ms:
                return True
            if now_ms >= deadline_ms:
                return False
            news = [deadline_ms, *(due_ms + 1 for due_ms in [*self._under_way][:1])]
            news += [due_ms for due_ms, _ in [*self._arrivals][:1]]
            self.simulation.advance(max(1, min(news) - now_ms))

    def take(self) -> bytes:
        """Return the packet or the bytes that have arrived, as the operating system would pass them on."""
        data = self._arrivals.popleft()[1]
        if not data and self._fault is not None:
            self._fail(ERRORS[self._fault.kind])
        if self.transport in (USB, BYTES):
            return data
        while self._arrivals and self._arrivals[0][0] <= self.simulation.now_ms and self._arrivals[0][1]:
            data += self._arrivals.popleft()[1]
        return data

    def silence(self, duration_ms: int) -> None:
        """Let nothing through for a while."""
        self._silent_until_ms = self.simulation.now_ms + duration_ms
        self.on_loss(self._silent_until_ms)

    @property
    def reachable(self) -> bool:
        """Whether a link to the brick can be opened."""
        return self.simulation.now_ms >= self._away_until_ms

    def _fail(self, number: int) -> NoReturn:
        self.error = number
        raise OSError(number, os.strerror(number))

    @property
    def arrived(self) -> int:
        """Number of bytes that `take` would return now."""
        parts = (data for due_ms, data in self._arrivals if due_ms <= self.simulation.now_ms)
        return sum(map(len, islice(parts, 1 if self.transport in (USB, BYTES) else None)))

    @property
    def duplicates(self) -> bool:
        """Whether its fault lets a reply arrive twice."""
        return self._fault is not None and self._fault.kind == DOUBLED

    @property
    def undetectable(self) -> bool:
        """Whether its fault changes values in a way that no driver can see.

        Telegrams have no checksum; and over USB, where the driver checks only once a second for replies that arrive
        twice, the second copy of a reply passes for that to the next request of the same form (docs/connecting.md).
        """
        kind = "" if self._fault is None else self._fault.kind
        return kind == FLIPPED or (kind == DOUBLED and self.transport == USB)

    # --- the brick's end ---

    def _kind(self, number: int) -> str:
        return self._fault.kind if self._fault is not None and self._fault.at == number else ""

    def _deliver(self, link: int, number: int, telegram: bytes) -> None:
        self._under_way.popleft()
        if link != self._links:
            return
        simulation, kind = self.simulation, self._kind(number)
        if self.transport == USB:
            reply = simulation.deliver(telegram) or b""
        else:
            reply = simulation.deliver_bluetooth(frame(telegram))
        reply = self._corrupt(kind, reply)
        intact = 0 if self.transport == USB else LENGTH_SIZE
        now_ms = simulation.now_ms
        lost = not reply or kind == REPLY_LOST or now_ms < self._silent_until_ms
        self.exchanges.append(Exchange(now_ms, telegram, None if lost else reply[intact:]))
        if kind in PULLED_MS:
            self.pull(kind)
        elif kind in ERRORS:
            self._arrive(now_ms + 1, b"")
        elif not lost:
            self._pass_on(kind, reply, now_ms + max(1, self._latency_ms - self._latency_ms // 2))

    def _pass_on(self, kind: str, reply: bytes, due_ms: int) -> None:
        """Let a reply arrive: whole, late, twice, in two parts, or with the next."""
        due_ms += LATE_MS.get(kind, 0)
        if kind == HELD:
            self._held = reply
            return
        held, self._held = self._held, b""
        if self.transport == USB:
            for packet in (held, reply, reply if kind == DOUBLED else b""):
                if packet:
                    self._arrive(due_ms, packet)
            return
        data = held + reply * (2 if kind == DOUBLED else 1)
        if kind == SPLIT:
            cut = self._random.randrange(1, len(data))
            self._arrive(due_ms, data[:cut])
            self._arrive(due_ms + self._random.randint(*SPLIT_MS), data[cut:])
        else:
            self._arrive(due_ms, data)

    def _arrive(self, due_ms: int, data: bytes) -> None:
        due_ms = self._last_due_ms = max(due_ms, self._last_due_ms)
        if self.transport == MERGED:
            due_ms = math.ceil(due_ms / MERGE_MS) * MERGE_MS
        parts = [data[i : i + 1] for i in range(len(data))] if self.transport == BYTES and data else [data]
        self._arrivals.extend((due_ms, part) for part in parts)

    def _corrupt(self, kind: str, reply: bytes) -> bytes:
        """Change a reply, in a stream with or without its length."""
        intact, random = 0 if self.transport == USB else LENGTH_SIZE, self._random
        if not reply:
            return reply
        if kind == TRUNCATED:
            cut = random.randrange(1, len(reply))
            short = reply[intact:][: max(1, cut - intact)]
            return frame(short) if intact and random.random() < 1 / 2 else reply[:cut]
        if kind == FLIPPED:
            spoilt = bytearray(reply)
            for _ in range(random.randint(1, 3)):
                spoilt[random.randrange(len(spoilt))] ^= 1 << random.randrange(8)
            return bytes(spoilt)
        if kind == REFUSED:
            status = intact + REPLY_HEADER - 1
            payload = bytes(len(reply) - status - 1)
            program = reply[status - 1] in (GetCurrentProgramName.opcode, StopProgram.opcode)
            statuses = [each for each in STATUSES if each != Status.NO_ACTIVE_PROGRAM or not program]
            return reply[:status] + bytes((random.choice(statuses),)) + payload
        return reply

    def pull(self, kind: str) -> None:
        """Cut the link, and keep the brick unreachable for a while.

        Args:
            kind: One of `PULLED_MS`.
        """
        simulation = self.simulation
        self._away_until_ms = simulation.now_ms + PULLED_MS[kind]
        self._links += 1
        self._arrivals.clear()
        self._held = b""
        self.on_loss(self._away_until_ms)
        if kind == RESTARTED:
            restart(simulation)
            # it boots for some seconds, in which it counts nothing
            simulation.at(self._away_until_ms - 1, lambda: restart(simulation))
        elif self.transport == USB:
            simulation.unplug()


def restart(simulation: Simulation) -> None:
    """Switch the brick off and on again; only its files remain."""
    old = simulation.brick
    simulation.brick = new = SimBrick(firmware=old.firmware, flash=old.loader.flash, seed=simulation.seed)
    for port, output in zip("ABC", old.output.outputs, strict=True):
        new.attach_motor(port, output.plant)
    for number, (analog, channel) in enumerate(zip(old.input.ports, old.low_speed.channels, strict=True), 1):
        new.attach_sensor(number, channel.bus.sensor.device or analog.sensor)
    simulation.set_battery(simulation.world.file.robot.battery_mv)
