"""Driving along a planned path while looking for the target; the skill of the recoveries that lead elsewhere."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from behaviors.adaptive.path_planner import PathPlanner
from behaviors.adaptive.perception import Observation, Perception
from behaviors.adaptive.retreat import Retreat
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Blocker, Failure
from behaviors.ports import Point, StopReason
from behaviors.skills import sighted

PASSED_MM = 90.0
"""A waypoint is passed when the robot is this near to it."""
BESIDE_MM = 250.0
"""A waypoint is also passed when the robot is beside or beyond it and this near to it."""
PIVOT_DEG = 30.0
"""At a larger bearing the robot turns on the spot."""
TURNED_DEG = 6.0
"""After a stop before an obstacle it does so at a larger bearing than this, since the safety stop would hold it again
until it has turned away."""
STEER_PER_S = 2.0
"""Turn rate per degree of bearing, 1/s: more than in an approach, since no picture has to stay sharp."""
STEER_LIMIT_DEG_S = 90.0
"""Fastest turn."""
RENEW_S = 1.5
"""The path is planned again this often, since more of it comes into view."""
KEPT, KEPT_S = 1.25, 0.3
"""The old path is kept unless it takes more than this many times the time of the best one, plus this time; both are
times between cells of the map."""
LONGER, LONGER_S = 1.5, 3.0
"""A path that turns out to take more than this many times as long as when it was chosen, plus this time, is abandoned:
something else may be the better choice now."""
MAX_STOPS = 3
"""A robot that was stopped more often than this has no path."""
CLEARANCE_MM = 70.0
"""With less room beside the straight path to the target the robot stays on its own: more than a planned path leaves,
since the last stretch is driven by eye."""
STANDOFF_MM = 300.0
"""The last stretch before the target need not be free: the target itself echoes."""
FAR_ENOUGH_MM = 400.0
"""This far along a path that leads no farther it is worth scanning."""
LEEWAY, LEEWAY_S = 2.0, 8.0
"""A path may take this many times the time that its length takes at cruising speed, plus this time."""
RETREAT_MM = 90.0
"""The robot backs off this far from what it touched or what holds its wheels."""
SLOW_MM = 450.0
"""An echo from nearer than this slows it down, since there may be more beside the beam."""
SLOW_SHARE = 0.6
"""Share of the cruising speed at which it then drives."""


class FollowPathSkill:
    """Drives to a place.

    Args:
        perception: What to work with.
        route: Waypoints. The robot stops early when it sees the target and the straight path to it is free.
    """

    def __init__(self, perception: Perception, route: tuple[Point, ...]) -> None:
        self._perception = perception
        self._route = list(route)
        self._goal = route[-1]
        self._begin = self._from = perception.world.here
        self._stops = 0
        self._turns_away = False
        self._end_s = self._promised_s = math.inf
        self._retreat: Retreat | None = None
        self._blocker: Blocker | None = None

    def call(self) -> Fact:
        """Drive there; the robot is at rest afterwards."""
        perception = self._perception
        begun_s = perception.now()
        length_mm = sum(math.dist(one, other) for one, other in pairwise([perception.world.here, *self._route]))
        self._end_s = begun_s + LEEWAY_S + LEEWAY * length_mm / perception.parameters.cruise_mm_s
        self._promised_s = begun_s + LONGER_S + LONGER * self._seconds(perception.world.paths_from_here())
        while self._route:
            fact = self._back_off(self._retreat) if self._retreat else self._drive()
            if fact is not None:
                perception.context.body.stop()
                return fact
        self._make_room()
        return Fact(Event.RECOVERY_DONE, Reason.THERE, {"travel_s": perception.now() - begun_s})

    def _make_room(self) -> None:
        """Stop, and without a sonar back off: the robot may stand beside something that it would touch in a turn."""
        body = self._perception.context.body
        body.stop()
        if self._perception.sonar.silent:
            body.straight(-RETREAT_MM)

    def _drive(self) -> Fact | None:
        """Drive along the path; None at its end, or when it was planned again after a stop."""
        perception = self._perception
        renew_s = perception.now() + RENEW_S
        while True:
            observation = perception.step()
            if (fact := self._seen(observation)) is not None:
                return fact
            if observation.time_s > self._end_s or self._stops > MAX_STOPS:
                return self._no_path(observation)
            if observation.time_s >= renew_s:
                if (fact := self._replan(observation, Reason.PATH_RENEWED)) is not None:
                    return fact
                renew_s = observation.time_s + RENEW_S
            while self._route and self._passed(self._route[0]):
                self._from = self._route.pop(0)
            if not self._route:
                return None
            bearing_deg, _ = perception.world.pose.polar_to(self._route[0])
            stop = perception.drive(*self._speeds(bearing_deg, observation))
            if stop is not None:
                return self._stopped(stop, observation)

    def _passed(self, point: Point) -> bool:
        """Return whether the robot is at, beside or beyond a waypoint: it is not always near one when it looks."""
        (x_mm, y_mm), (begin_x, begin_y) = self._perception.world.here, self._from
        ahead = (point[0] - x_mm) * (point[0] - begin_x) + (point[1] - y_mm) * (point[1] - begin_y)
        left_mm = math.hypot(point[0] - x_mm, point[1] - y_mm)
        return left_mm <= PASSED_MM or (ahead <= 0 and left_mm <= BESIDE_MM)

    def _speeds(self, bearing_deg: float, observation: Observation) -> tuple[float, float]:
        """Return how fast to drive, mm/s, and to turn, deg/s."""
        perception = self._perception
        speed_mm_s = perception.parameters.travel_mm_s
        if perception.sonar.silent:
            speed_mm_s = perception.parameters.cruise_mm_s
        elif observation.range_mm is not None and observation.range_mm < SLOW_MM:
            speed_mm_s = SLOW_SHARE * perception.parameters.cruise_mm_s
        self._turns_away = self._turns_away and abs(bearing_deg) > TURNED_DEG
        share = 0.0 if self._turns_away else max(0.0, 1.0 - abs(bearing_deg) / PIVOT_DEG)
        return share * speed_mm_s, perception.steering_deg_s(bearing_deg, STEER_PER_S, STEER_LIMIT_DEG_S)

    def _seen(self, observation: Observation) -> Fact | None:
        """Return a fact when the target came into view and can be driven to."""
        world = self._perception.world
        known = world.targets.known.get(self._perception.target)
        if observation.sighting is None or known is None:
            return None
        if not world.floor.clear_between(world.here, known.place, STANDOFF_MM, CLEARANCE_MM):
            return None
        if not world.new_approach(self._perception.target, world.here):
            return None  # a sighting from where an approach failed is nothing new
        return sighted(observation.sighting)

    def _stopped(self, stop: StopReason, observation: Observation) -> Fact | None:
        """Map the obstacle, and plan again."""
        perception, pose, floor = self._perception, self._perception.world.pose, self._perception.world.floor
        self._stops += 1
        self._turns_away = stop is StopReason.OBSTACLE
        self._blocker = None
        if stop is not StopReason.OBSTACLE:
            floor.mark_obstacle(pose, 0.0)
            self._retreat = Retreat(perception, RETREAT_MM, stop)
            return self._back_off(self._retreat)
        if (near_mm := observation.range_mm) is not None:
            if floor.appeared(pose, near_mm):
                self._blocker = Blocker(near_mm, moving=True, hides=True)
            floor.mark_obstacle(pose, near_mm)
        return self._replan(perception.step(), Reason.OBSTACLE_AHEAD)

    def _back_off(self, retreat: Retreat) -> Fact | None:
        """Complete a retreat, and plan again."""
        perception = self._perception
        retreat.call()
        self._retreat = None
        perception.context.report(Fact(Event.RETREATED, Reason.RETREATED))
        return self._replan(perception.step(), Reason.RETREATED)

    def _replan(self, observation: Observation, reason: Reason) -> Fact | None:
        """Take the best path from here, by what is known now."""
        world = self._perception.world
        paths = world.paths_from_here()
        left_s = self._seconds(paths)
        if not paths.reaches(self._goal) or observation.time_s + left_s > self._promised_s:
            return self._no_path(observation)
        # a path that takes hardly longer than the best one is kept; else the robot would oscillate between two
        if reason is Reason.PATH_RENEWED and paths.seconds_along(tuple(self._route)) <= KEPT * left_s + KEPT_S:
            return None
        self._route, self._from = list(paths.route_to(self._goal)), world.here
        route = [[round(x_mm), round(y_mm)] for x_mm, y_mm in self._route]
        self._perception.context.report(Fact(Event.REPLANNED, reason, {"route": route}))
        return None

    def _seconds(self, paths: PathPlanner) -> float:
        """Return the time to the destination, infinity if no path leads there."""
        return float(paths.seconds_to(np.array([self._goal]))[0])

    def _no_path(self, observation: Observation) -> Fact:
        """Report that there is no path; far enough along the old one a scan is still worthwhile."""
        if self._blocker is None and math.dist(self._perception.world.here, self._begin) >= FAR_ENOUGH_MM:
            self._make_room()
            return Fact(Event.RECOVERY_DONE, Reason.NO_WAY, {"stops": self._stops})
        measured = {"range_mm": observation.range_mm, "stops": self._stops}
        return Failure(Event.RECOVERY_FAILED, Reason.NO_WAY, measured, self._blocker)
