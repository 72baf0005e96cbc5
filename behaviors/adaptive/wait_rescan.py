"""Standing and watching; the states wait and rescan."""

from __future__ import annotations

from behaviors.adaptive.perception import Observation, Perception
from behaviors.events import Event, Fact, Reason
from behaviors.skills import sighting_values

SHUT_MM, BEFORE_MM = 650.0, 200.0
"""What is straight ahead is still in the way when it is nearer than the first, and by the second nearer than the
target; both are a little wider than what stopped the approach, since echoes vary."""
CLEAR, CLEAR_UNSEEN = 2, 10
"""So many echoes in a row must say that the way is free, when the target is in view and when it is not."""
IN_VIEW_S = 1.0
"""What was seen so short a time ago is in view."""
AIM_DEG = 4.0
"""It looks straight at where the target should be, give or take this."""
GLANCES_S = 1.5
"""A second look is so long, at each of the bearings around where the target should be."""
BESIDE_DEG = (0.0, 18.0, -36.0)
"""Turns between these looks: at the place itself, to the right of it, to the left."""


class WaitSkill:
    """The state wait: until the way is free, or until it has lasted long enough.

    Args:
        perception: What to work with.
        wait_s: How long at most.
    """

    def __init__(self, perception: Perception, wait_s: float) -> None:
        self._perception = perception
        self._left_s = wait_s
        self._clear = 0

    def call(self) -> Fact:
        """Wait; the robot is at rest. TARGET_SEEN or RECOVERY_DONE when the way is free, else RECOVERY_FAILED."""
        perception = self._perception
        perception.context.body.stop()
        perception.context.body.keep_alive()
        begun_s = then_s = perception.now()
        range_mm = None
        while self._left_s > 0:
            observation = perception.step()
            range_mm = range_mm if observation.range_mm is None else observation.range_mm
            self._left_s -= observation.time_s - then_s
            then_s = observation.time_s
            self._clear = 0 if self._shut(observation) else self._clear + 1
            if self._clear >= CLEAR:
                if observation.sighting is not None:
                    return Fact(
                        Event.TARGET_SEEN, Reason.WAY_CLEAR, {"sighting": sighting_values(observation.sighting)}
                    )
                if self._clear >= CLEAR_UNSEEN:
                    return Fact(Event.RECOVERY_DONE, Reason.WAY_CLEAR, {"waited_s": observation.time_s - begun_s})
        waited_s = perception.now() - begun_s
        evidence = {"waited_s": waited_s, "range_mm": range_mm, "hides": not self._in_view()}
        return Fact(Event.RECOVERY_FAILED, Reason.BLOCKED_LONG, evidence)

    def _shut(self, observation: Observation) -> bool:
        world = self._perception.world
        known = world.known.get(self._perception.target)
        limit_mm = SHUT_MM if known is None else min(SHUT_MM, world.way_to(known.place)[1] - BEFORE_MM)
        return observation.range_mm is not None and observation.range_mm <= limit_mm

    def _in_view(self) -> bool:
        """Whether the target was seen a moment ago."""
        known = self._perception.world.known.get(self._perception.target)
        return known is not None and self._perception.now() - known.time_s < IN_VIEW_S


class RescanSkill:
    """The state rescan: a longer look at where the target was, or should be, for what was merely missed.

    Args:
        perception: What to work with.
    """

    def __init__(self, perception: Perception) -> None:
        self._perception = perception

    def call(self) -> Fact:
        """Look again; the robot is at rest afterwards."""
        perception = self._perception
        body = perception.context.body
        body.stop()
        begun_s = perception.now()
        known = perception.world.known.get(perception.target)
        if known is None:
            return Fact(Event.RECOVERY_DONE, Reason.THERE, {})
        bearing_deg, _ = perception.world.way_to(known.place)
        if abs(bearing_deg) > AIM_DEG:
            body.turn(bearing_deg)
        for turn_deg in BESIDE_DEG:
            if turn_deg:
                body.turn(turn_deg)
            if (fact := self._look()) is not None:
                return fact
        perception.world.forget(perception.target)
        return Fact(Event.RECOVERY_FAILED, Reason.NEVER_SEEN, {"rescan_s": perception.now() - begun_s})

    def _look(self) -> Fact | None:
        """Look for some time."""
        perception = self._perception
        end_s = perception.now() + GLANCES_S
        while perception.now() < end_s:
            observation = perception.step()
            if observation.sighting is not None:
                return Fact(Event.TARGET_SEEN, Reason.SIGHTED, {"sighting": sighting_values(observation.sighting)})
        return None
