"""Driving along a planned path while looking for the target; the skill of the recoveries that lead elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from behaviors.adaptive.path_planner import PathPlanner
from behaviors.adaptive.perception import Observation, Perception
from behaviors.adaptive.retreat import Retreat
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Blocker, Failure
from behaviors.ports import Point, StopReason
from behaviors.skills import sighted


@dataclass(frozen=True, slots=True)
class PathTuning:
    """Tuning constants of following a path.

    Attributes:
        passed_mm: A waypoint is passed when the robot is this near to it.
        beside_mm: A waypoint is also passed when the robot is beside or beyond it and this near to it.
        pivot_deg: At a larger bearing the robot turns on the spot.
        turned_deg: After a stop before an obstacle it does so at a larger bearing than this, since the safety stop
            would hold it again until it has turned away.
        steer_per_s: Turn rate per degree of bearing, 1/s: more than in an approach, since no picture has to stay sharp.
        steer_limit_deg_s: Fastest turn.
        renew_s: The path is planned again this often, since more of it comes into view.
        kept: The old path is kept unless it takes more than this many times the time of the best one, plus `kept_s`.
        kept_s: See `kept`; times are those between cells of the map.
        longer: A path that turns out to take more than this many times as long as when it was chosen, plus `longer_s`,
            is abandoned: something else may be the better choice now.
        longer_s: See `longer`.
        stops: A robot that was stopped more often than this has no path.
        clearance_mm: With less room beside the straight path to the target the robot stays on its own: more than a
            planned path leaves, since the last stretch is driven by eye.
        standoff_mm: The last stretch before the target need not be free: the target itself echoes.
        far_enough_mm: This far along a path that leads no farther it is worth scanning.
        leeway: A path may take this many times the time that its length takes at cruising speed, plus `leeway_s`.
        leeway_s: See `leeway`.
        retreat_mm: The robot backs off this far from what it touched or what holds its wheels.
        slow_mm: An echo from nearer than this slows it down, since there may be more beside the beam.
        slow_share: Share of the cruising speed at which it then drives.
    """

    passed_mm: float = 90.0
    beside_mm: float = 250.0
    pivot_deg: float = 30.0
    turned_deg: float = 6.0
    steer_per_s: float = 2.0
    steer_limit_deg_s: float = 90.0
    renew_s: float = 1.5
    kept: float = 1.25
    kept_s: float = 0.3
    longer: float = 1.5
    longer_s: float = 3.0
    stops: int = 3
    clearance_mm: float = 70.0
    standoff_mm: float = 300.0
    far_enough_mm: float = 400.0
    leeway: float = 2.0
    leeway_s: float = 8.0
    retreat_mm: float = 90.0
    slow_mm: float = 450.0
    slow_share: float = 0.6


TUNING = PathTuning()


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
        self._end_s = begun_s + TUNING.leeway_s + TUNING.leeway * length_mm / perception.parameters.cruise_mm_s
        self._promised_s = begun_s + TUNING.longer_s + TUNING.longer * self._seconds(perception.world.paths_from_here())
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
            body.straight(-TUNING.retreat_mm)

    def _drive(self) -> Fact | None:
        """Drive along the path; None at its end, or when it was planned again after a stop."""
        perception = self._perception
        renew_s = perception.now() + TUNING.renew_s
        while True:
            observation = perception.step()
            if (fact := self._seen(observation)) is not None:
                return fact
            if observation.time_s > self._end_s or self._stops > TUNING.stops:
                return self._no_path(observation)
            if observation.time_s >= renew_s:
                if (fact := self._replan(observation, Reason.PATH_RENEWED)) is not None:
                    return fact
                renew_s = observation.time_s + TUNING.renew_s
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
        return left_mm <= TUNING.passed_mm or (ahead <= 0 and left_mm <= TUNING.beside_mm)

    def _speeds(self, bearing_deg: float, observation: Observation) -> tuple[float, float]:
        """Return how fast to drive, mm/s, and to turn, deg/s."""
        perception = self._perception
        speed_mm_s = perception.parameters.travel_mm_s
        if perception.sonar.silent:
            speed_mm_s = perception.parameters.cruise_mm_s
        elif observation.range_mm is not None and observation.range_mm < TUNING.slow_mm:
            speed_mm_s = TUNING.slow_share * perception.parameters.cruise_mm_s
        self._turns_away = self._turns_away and abs(bearing_deg) > TUNING.turned_deg
        share = 0.0 if self._turns_away else max(0.0, 1.0 - abs(bearing_deg) / TUNING.pivot_deg)
        return share * speed_mm_s, perception.steering_deg_s(bearing_deg, TUNING.steer_per_s, TUNING.steer_limit_deg_s)

    def _seen(self, observation: Observation) -> Fact | None:
        """Return a fact when the target came into view and can be driven to."""
        world = self._perception.world
        known = world.targets.known.get(self._perception.target)
        if observation.sighting is None or known is None:
            return None
        if not world.floor.clear_between(world.here, known.place, TUNING.standoff_mm, TUNING.clearance_mm):
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
            self._retreat = Retreat(perception, TUNING.retreat_mm, stop)
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
        if (
            reason is Reason.PATH_RENEWED
            and paths.seconds_along(tuple(self._route)) <= TUNING.kept * left_s + TUNING.kept_s
        ):
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
        if self._blocker is None and math.dist(self._perception.world.here, self._begin) >= TUNING.far_enough_mm:
            self._make_room()
            return Fact(Event.RECOVERY_DONE, Reason.NO_WAY, {"stops": self._stops})
        measured = {"range_mm": observation.range_mm, "stops": self._stops}
        return Failure(Event.RECOVERY_FAILED, Reason.NO_WAY, measured, self._blocker)
