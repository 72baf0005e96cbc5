"""Driving along a way over the floor map, with open eyes; the states move_to and detour."""

from __future__ import annotations

from behaviors.adaptive.routes import Routes
from behaviors.adaptive.watch import Percept, Watch
from behaviors.events import Event, Fact, Reason
from behaviors.ports import Stop
from behaviors.recovery import Point
from behaviors.skills import sighting_values

NEAR_MM = 90.0
"""A corner of a way is passed when the robot is so near."""
PIVOT_DEG = 30.0
"""At a sharper bearing it turns on the spot."""
STEER_PER_S, STEER_LIMIT_DEG_S = 2.0, 90.0
PLANS = 4
"""So often a way is planned anew before there is said to be none."""
RETREAT_MM = 90.0
SLOW_MM = 450.0
"""An echo from nearer than this slows it down: beside the beam there may be more."""
LEG_LIMIT_S = 30.0


class Travel:
    """A way to a place.

    Args:
        watch: What to work with.
        route: Points to drive through.
        ends_on_sight: Whether a sighting ends it at once; otherwise only when the straight way to the target is free.
    """

    def __init__(self, watch: Watch, route: tuple[Point, ...], *, ends_on_sight: bool) -> None:
        self._watch = watch
        self._route = list(route)
        self._goal = route[-1]
        self._ends_on_sight = ends_on_sight
        self._plans = 0

    def call(self) -> Fact:
        """Drive there; the robot is at rest afterwards."""
        watch = self._watch
        begun_s = watch.now()
        try:
            while self._route:
                fact = self._leg(self._route[0])
                if fact is not None:
                    return fact
        finally:
            watch.senses.body.stop()
        return Fact(Event.RECOVERY_DONE, Reason.THERE, {"travel_s": watch.now() - begun_s})

    def _leg(self, point: Point) -> Fact | None:
        """Drive to the next corner of the way; None when it was reached or the way was planned anew."""
        watch = self._watch
        end_s = watch.now() + LEG_LIMIT_S
        while watch.now() < end_s:
            percept = watch.step()
            if (fact := self._seen(percept)) is not None:
                return fact
            bearing_deg, distance_mm = watch.memory.way_to(point)
            if distance_mm <= NEAR_MM:
                self._route.pop(0)
                return None
            if not watch.memory.floor.clear_between(watch.memory.here, point):
                return self._plan_anew(percept)
            stop = watch.senses.body.drive(*self._speeds(bearing_deg, percept))
            if stop is not None:
                return self._stopped(stop, percept)
        return self._plan_anew(percept)

    def _speeds(self, bearing_deg: float, percept: Percept) -> tuple[float, float]:
        """How fast to drive and to turn."""
        turn_deg_s = max(-STEER_LIMIT_DEG_S, min(STEER_LIMIT_DEG_S, STEER_PER_S * bearing_deg))
        share = max(0.0, 1.0 - abs(bearing_deg) / PIVOT_DEG)
        if percept.range_mm is not None and percept.range_mm < SLOW_MM:
            share *= 0.6
        return self._watch.profile.cruise_mm_s * share, turn_deg_s

    def _seen(self, percept: Percept) -> Fact | None:
        """Whether the target came into view, and can be driven to."""
        memory = self._watch.memory
        known = memory.known.get(self._watch.target)
        if percept.sighting is None or known is None:
            return None
        if not self._ends_on_sight and not memory.floor.clear_between(memory.here, known.place, 300.0):
            return None
        return Fact(Event.TARGET_SEEN, Reason.SIGHTED, {"sighting": sighting_values(percept.sighting)})

    def _stopped(self, stop: Stop, percept: Percept) -> Fact | None:
        """Remember what was in the way, and look for another one."""
        watch = self._watch
        memory = watch.memory
        near_mm = 0.0 if stop is Stop.CONTACT else percept.range_mm
        if near_mm is not None:
            memory.floor.block(memory.pose, near_mm)
        watch.senses.body.straight(-RETREAT_MM)
        return self._plan_anew(percept)

    def _plan_anew(self, percept: Percept) -> Fact | None:
        watch = self._watch
        memory = watch.memory
        self._plans += 1
        watch.senses.body.stop()
        watch.step()  # backing up took time; and a plan is made from where the robot is now
        routes = Routes(memory.floor, memory.here, watch.profile.cruise_mm_s)
        if self._plans > PLANS or not routes.reaches(self._goal):
            return Fact(Event.RECOVERY_FAILED, Reason.NO_WAY, {"range_mm": percept.range_mm, "plans": self._plans})
        self._route = list(routes.route_to(self._goal))
        return None
