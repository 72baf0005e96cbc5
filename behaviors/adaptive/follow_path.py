"""Driving along a way over the floor map, with open eyes; the states move_to and detour."""

from __future__ import annotations

import math
from itertools import pairwise

from behaviors.adaptive.path_planner import PathPlanner
from behaviors.adaptive.perception import Observation, Perception
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Failure
from behaviors.ports import Point, StopReason
from behaviors.skills import sighting_values, steering_deg_s

NEAR_MM = 90.0
"""A corner of a way is passed when the robot is so near."""
PIVOT_DEG = 30.0
"""At a sharper bearing it turns on the spot."""
STEER_PER_S, STEER_LIMIT_DEG_S = 2.0, 90.0
"""It steers harder than in an approach: on the way no picture has to stay sharp."""
RENEW_S = 1.5
"""The way is planned anew so often: on the way more is seen of it."""
STOPS = 3
"""When the robot was stopped more often than this, there is no way."""
ELBOW_MM = 70.0
"""With less room beside the straight way to the target it goes on along its own."""
STANDOFF_MM = 300.0
"""The last stretch before the target need not be free: the target itself echoes."""
FAR_ENOUGH_MM = 400.0
"""From so far along a way that leads no further it is worth looking round."""
LEEWAY, LEEWAY_S = 2.0, 8.0
"""A way that takes so many times longer than its length would, and so much more, is none."""
RETREAT_MM = 90.0
"""What was touched, or holds the wheels, is left so far behind."""
SLOW_MM, SLOW_SHARE = 450.0, 0.6
"""An echo from nearer than this slows it down to this share: beside the beam there may be more."""


class FollowPathSkill:
    """A way to a place.

    Args:
        perception: What to work with.
        route: Points to drive through. It ends early when the target is seen and the straight way to it free.
    """

    def __init__(self, perception: Perception, route: tuple[Point, ...]) -> None:
        self._perception = perception
        self._route = list(route)
        self._goal = route[-1]
        self._begin = perception.world.here
        self._stops = 0
        self._end_s = math.inf

    def call(self) -> Fact:
        """Drive there; the robot is at rest afterwards."""
        perception = self._perception
        begun_s = perception.now()
        length_mm = sum(math.dist(one, other) for one, other in pairwise([perception.world.here, *self._route]))
        self._end_s = begun_s + LEEWAY_S + LEEWAY * length_mm / perception.profile.cruise_mm_s
        while self._route:
            fact = self._leg(self._route[0])
            if fact is not None:
                perception.context.body.stop()
                return fact
        perception.context.body.stop()
        return Fact(Event.RECOVERY_DONE, Reason.THERE, {"travel_s": perception.now() - begun_s})

    def _leg(self, point: Point) -> Fact | None:
        """Drive to the next corner of the way; None when it was reached or the way was planned anew."""
        perception = self._perception
        renew_s = perception.now() + RENEW_S
        while True:
            observation = perception.step()
            if (fact := self._seen(observation)) is not None:
                return fact
            bearing_deg, distance_mm = perception.world.way_to(point)
            if distance_mm <= NEAR_MM:
                self._route.pop(0)
                return None
            if observation.time_s > self._end_s or self._stops > STOPS:
                return self._no_way(observation)
            if observation.time_s >= renew_s:
                return self._plan_anew(observation)
            stop = perception.context.body.drive(*self._speeds(bearing_deg, observation))
            if stop is not None:
                return self._stopped(stop, observation)

    def _speeds(self, bearing_deg: float, observation: Observation) -> tuple[float, float]:
        """How fast to drive, mm/s, and to turn, deg/s."""
        share = max(0.0, 1.0 - abs(bearing_deg) / PIVOT_DEG)
        if observation.range_mm is not None and observation.range_mm < SLOW_MM:
            share *= SLOW_SHARE
        return self._perception.profile.cruise_mm_s * share, steering_deg_s(bearing_deg, STEER_PER_S, STEER_LIMIT_DEG_S)

    def _seen(self, observation: Observation) -> Fact | None:
        """Whether the target came into view, and can be driven to."""
        world = self._perception.world
        known = world.known.get(self._perception.target)
        if observation.sighting is None or known is None:
            return None
        if not world.floor.clear_between(world.here, known.place, STANDOFF_MM, ELBOW_MM):
            return None
        return Fact(Event.TARGET_SEEN, Reason.SIGHTED, {"sighting": sighting_values(observation.sighting)})

    def _stopped(self, stop: StopReason, observation: Observation) -> Fact | None:
        """Remember what was in the way, and look for another way."""
        perception = self._perception
        self._stops += 1
        near_mm = observation.range_mm if stop is StopReason.OBSTACLE else 0.0
        if near_mm is not None:
            perception.world.floor.block(perception.world.pose, near_mm)
        if stop is not StopReason.OBSTACLE:
            perception.context.body.straight(-RETREAT_MM)
        return self._plan_anew(perception.step())

    def _plan_anew(self, observation: Observation) -> Fact | None:
        """Take the best way from here, by what is known by now."""
        world = self._perception.world
        routes = PathPlanner(world.floor, world.here, self._perception.profile.cruise_mm_s)
        if not routes.reaches(self._goal):
            return self._no_way(observation)
        self._route = list(routes.route_to(self._goal))
        return None

    def _no_way(self, observation: Observation) -> Fact:
        """It goes no further; from far enough along the way it is worth looking round, too."""
        world = self._perception.world
        if math.dist(world.here, self._begin) >= FAR_ENOUGH_MM:
            return Fact(Event.RECOVERY_DONE, Reason.NO_WAY, {"stops": self._stops})
        return Failure(Event.RECOVERY_FAILED, Reason.NO_WAY, {"range_mm": observation.range_mm, "stops": self._stops})
