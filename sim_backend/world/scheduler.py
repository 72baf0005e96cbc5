"""Schedule a world's events: decide when each one's conditions hold.

Conditions are checked every `INTERVAL_MS`. The scheduler decides *when*; the `EventContext` has the objects' places and
moves them.
"""

from __future__ import annotations

from collections.abc import Iterable
from random import Random
from typing import Protocol

from sim_backend.world.event_tables import Event
from sim_backend.world.toml_types import Duration

INTERVAL_MS = 100


class EventContext(Protocol):
    """The part of the world that the scheduler queries and changes."""

    def in_view(self, picture: str) -> bool:
        """Return whether the robot's camera could see the picture now."""

    def robot_distance_mm(self, name: str) -> float:
        """Return the distance between the centres of the robot and an object."""

    def perform(self, event: Event, stays_ms: int | None) -> None:
        """Perform the event."""

    def is_over(self, event: Event) -> bool:
        """Return whether the event's effect has ended; an instantaneous move is over at once."""


class _PendingEvent:
    """One event and the state of its conditions."""

    def __init__(self, event: Event, random: Random) -> None:
        self.event, self._random = event, random
        self.count = 0
        self.running = False
        self.began_ms = self.ended_ms = -1
        self.arm()

    def arm(self) -> None:
        """Reset the conditions and draw new durations."""
        self.delay_ms = draw_ms(self.event.when.delay_s, self._random)
        self.view_ms = draw_ms(self.event.when.for_s, self._random)
        self.seen_ms = self.views = 0
        self.seeing = False

    @property
    def exhausted(self) -> bool:
        """Whether it has happened as often as `times` allows."""
        return 0 < self.event.times <= self.count

    def observe(self, seeing: bool) -> None:
        """Count the time in view, and how often the picture came into view."""
        self.views += seeing and not self.seeing
        self.seen_ms += INTERVAL_MS if seeing and self.seeing else 0
        self.seeing = seeing


class EventScheduler:
    """Runs the events of a world.

    Args:
        events: Simultaneous ones run in this order.
        random: Draws durations that are given as ranges.

    Attributes:
        log: Events so far: (time in ms, name).
    """

    def __init__(self, events: Iterable[Event], random: Random) -> None:
        self._random = random
        self._events = {event.name: _PendingEvent(event, random) for event in events}
        self.log: list[tuple[int, str]] = []

    def advance(self, now_ms: int, context: EventContext) -> None:
        """Run the events whose conditions hold.

        Args:
            now_ms: Simulation time; call this every `INTERVAL_MS`.
            context: The world.
        """
        for pending in self._events.values():
            if pending.running:
                if context.is_over(pending.event):
                    pending.running, pending.ended_ms = False, now_ms
                    pending.arm()
            elif not pending.exhausted and self._conditions_hold(pending, now_ms, context):
                self._begin(pending, now_ms, context)

    def _begin(self, pending: _PendingEvent, now_ms: int, context: EventContext) -> None:
        stays = pending.event.stays_s
        context.perform(pending.event, None if stays is None else draw_ms(stays, self._random))
        pending.count += 1
        pending.running, pending.began_ms = True, now_ms
        self.log.append((now_ms, pending.event.name))

    def _conditions_hold(self, pending: _PendingEvent, now_ms: int, context: EventContext) -> bool:
        since_ms = self._possible_since(pending)
        when = pending.event.when
        if since_ms is None or now_ms < since_ms + pending.delay_ms:
            return False
        if when.sees is not None:
            pending.observe(context.in_view(when.sees))
            if not (pending.seeing and pending.seen_ms >= pending.view_ms and pending.views >= when.view_number):
                return False
        measured_from = when.of or when.sees
        if measured_from is None or (when.robot_within_mm is None and when.robot_beyond_mm is None):
            return True
        distance_mm = context.robot_distance_mm(measured_from)
        return (when.robot_beyond_mm or 0.0) < distance_mm < (when.robot_within_mm or float("inf"))

    def _possible_since(self, pending: _PendingEvent) -> int | None:
        """Return when the conditions on time and on other events were met, or None if they are not.

        A repeated event waits again from the end of its previous run.
        """
        when = pending.event.when
        since_ms = max(pending.ended_ms, 0 if when.at_s is None else round(when.at_s * 1000))
        if when.after is not None:
            other_ms = self._events[when.after].began_ms
        elif when.after_end_of is not None:
            other_ms = self._events[when.after_end_of].ended_ms
        else:
            return since_ms
        # a repeated event also needs a new run of the other one
        return None if other_ms < 0 or other_ms < pending.began_ms else max(since_ms, other_ms)


def draw_ms(duration_s: Duration, random: Random) -> int:
    """Draw a duration in whole milliseconds from a uniform distribution."""
    return round(random.uniform(*duration_s) * 1000)
