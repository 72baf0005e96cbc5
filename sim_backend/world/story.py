"""What happens in a world: events that wait for their conditions.

Conditions are looked at every `INTERVAL_MS`. The story decides *when*; the `Stage` knows where things are and moves
them.
"""

from __future__ import annotations

from collections.abc import Iterable
from random import Random
from typing import Protocol

from sim_backend.world.tables import Duration
from sim_backend.world.world_file import Event

INTERVAL_MS = 100


class Stage(Protocol):
    """What the story may ask of the world and do to it."""

    def in_view(self, picture: str) -> bool:
        """Whether the robot's camera could see the picture now."""
        ...

    def robot_distance_mm(self, name: str) -> float:
        """From the robot's middle to the middle of a thing."""
        ...

    def perform(self, event: Event, stays_ms: int | None) -> None:
        """Do what the event says."""
        ...

    def is_over(self, event: Event) -> bool:
        """Whether the person of a performed event has gone again; other events are over at once."""
        ...


class _Watch:
    """One event and how far its conditions have come."""

    def __init__(self, event: Event, random: Random) -> None:
        self.event, self._random = event, random
        self.count = 0
        self.running = False
        self.began_ms = self.ended_ms = -1
        self.arm()

    def arm(self) -> None:
        """Wait for the conditions anew, with durations drawn anew."""
        self.delay_ms = draw_ms(self.event.when.delay_s, self._random)
        self.view_ms = draw_ms(self.event.when.for_s, self._random)
        self.seen_ms = self.views = 0
        self.seeing = False

    @property
    def exhausted(self) -> bool:
        """Whether it has happened as often as it may."""
        return 0 < self.event.times <= self.count

    def look(self, seeing: bool) -> None:
        """Count the time in view and the times it came into view."""
        self.views += seeing and not self.seeing
        self.seen_ms += INTERVAL_MS if seeing and self.seeing else 0
        self.seeing = seeing


class Story:
    """All events of a world.

    Args:
        events: In the order in which simultaneous ones happen.
        random: Draws durations that are given as ranges.

    Attributes:
        log: What happened so far: (time in ms, name of the event).
    """

    def __init__(self, events: Iterable[Event], random: Random) -> None:
        self._random = random
        self._watches = {event.name: _Watch(event, random) for event in events}
        self.log: list[tuple[int, str]] = []

    def advance(self, now_ms: int, stage: Stage) -> None:
        """Let happen what is due.

        Args:
            now_ms: Time of the simulation; the caller comes back every `INTERVAL_MS`.
            stage: Where it happens.
        """
        for watch in self._watches.values():
            if watch.running:
                if stage.is_over(watch.event):
                    watch.running, watch.ended_ms = False, now_ms
                    watch.arm()
            elif not watch.exhausted and self._is_due(watch, now_ms, stage):
                self._begin(watch, now_ms, stage)

    def _begin(self, watch: _Watch, now_ms: int, stage: Stage) -> None:
        stays = watch.event.stays_s
        stage.perform(watch.event, None if stays is None else draw_ms(stays, self._random))
        watch.count += 1
        watch.running, watch.began_ms = True, now_ms
        self.log.append((now_ms, watch.event.name))

    def _is_due(self, watch: _Watch, now_ms: int, stage: Stage) -> bool:
        since_ms = self._possible_since(watch)
        when = watch.event.when
        if since_ms is None or now_ms < since_ms + watch.delay_ms:
            return False
        if when.sees is not None:
            watch.look(stage.in_view(when.sees))
            if not (watch.seeing and watch.seen_ms >= watch.view_ms and watch.views >= when.view_number):
                return False
        measured_from = when.of or when.sees
        if measured_from is None or (when.robot_within_mm is None and when.robot_beyond_mm is None):
            return True
        distance_mm = stage.robot_distance_mm(measured_from)
        return (when.robot_beyond_mm or 0.0) < distance_mm < (when.robot_within_mm or float("inf"))

    def _possible_since(self, watch: _Watch) -> int | None:
        """When the conditions on time and on other events came true, or None if they have not.

        An event that happens again waits anew from the end of the last time.
        """
        when = watch.event.when
        since_ms = max(watch.ended_ms, 0 if when.at_s is None else round(when.at_s * 1000))
        if when.after is not None:
            other_ms = self._watches[when.after].began_ms
        elif when.after_end_of is not None:
            other_ms = self._watches[when.after_end_of].ended_ms
        else:
            return since_ms
        # and needs the other one to have happened again
        return None if other_ms < 0 or other_ms < watch.began_ms else max(since_ms, other_ms)


def draw_ms(duration_s: Duration, random: Random) -> int:
    """A duration in whole milliseconds, drawn evenly."""
    return round(random.uniform(*duration_s) * 1000)
