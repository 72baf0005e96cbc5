"""Use the true map and the true pose, but look for the pictures: the cost of searching without mapping.

It is between the oracle, which need not search, and a profile, which must map the floor as well. The truth shows
whether a sighting is genuine, so look-alikes and wrong distances cost it nothing.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import groupby

import numpy as np

from behaviors.angles import wrapped_deg
from behaviors.ports import Sighting
from nxtdrive.simulated.robot import ScenarioRobot
from sim_backend.evaluation import current_floor_plan
from sim_backend.plane import Point
from sim_backend.scenarios.floor_plan import Floats, FloorPlan, Goal, Mask, Path
from sim_backend.scenarios.room_builder import ROBOT_RADIUS_MM
from sim_backend.simulation import Simulation

from .oracle import INFLATION_MM, MARGINS_MM, Oracle

SPACING_MM = 400.0
"""Between places where a picture may be, and between places to look from."""
FACINGS_DEG = (0.0, 60.0, 120.0, 180.0, 240.0, 300.0)
"""Directions in which a picture may face."""
RANGE_MM, SLANT_DEG = 1900.0, 50.0
"""A scan shows a picture 200 mm high up to this distance and up to this slant. Source: docs/ranges.md
section 1.2."""
WHOLE_TURN_DEG = 380.0
"""With an overlap, since a sighting needs several frames to be confirmed."""
LOOK_ROUND_S = 10.0
"""Duration of a scan."""
GENUINE_DEG = 15.0
"""A sighting within this angle of the true target's bearing is one of the target."""
TURNS = 9
"""It returns to a target at most this often."""
LEG_MM = 1500.0
"""It plans again after this distance: the map is known."""
ARRIVED_MM = 150.0
"""A path to a place ends this near to it."""


class OracleEyes(Oracle):
    """Tour places to look from until a frame shows a target; then continue as the oracle does.

    Args:
        robot: The robot.
        simulation: The source of the ground truth.
    """

    def __init__(self, robot: ScenarioRobot, simulation: Simulation) -> None:
        super().__init__(robot, simulation)
        self._places = ScanPositions(self._walls_and_furniture())
        self._seen: set[str] = set()
        self.queue.rounds = TURNS

    def pursue(self, target: str) -> bool:
        """Find the target and drive to where a stop counts; leave it for later when another one is found first."""
        if target not in self._seen:
            self.enter("search")
            self._find({target, *self.queue.later})
        return target in self._seen and super().pursue(target)

    def preferred(self) -> str:
        """Return a target that was seen."""
        return next((target for target in self.queue.later if target in self._seen), "")

    def _find(self, wanted: set[str]) -> None:
        """Look from place to place until one of the targets is seen, or from all of them."""
        while not self._look_round(wanted):
            self._places.looked(self._here)
            path = self._places.best(self._here, self.mission.adaptive.travel_mm_s)
            if path is None:
                self._places.forget()
                return
            self._go(path.points[-1], wanted)

    @property
    def _here(self) -> Point:
        return self.truth.pose.x_mm, self.truth.pose.y_mm

    def _walls_and_furniture(self) -> FloorPlan:
        floor, truth = current_floor_plan(self._simulation), self.truth
        fixed = (each for each in floor.obstacles if each.name not in truth.pictures and each.name not in truth.people)
        return replace(floor, obstacles=tuple(fixed))

    def _go(self, place: Point, wanted: set[str]) -> None:
        """Drive to a place until one of the targets is seen; a path that is blocked now is left."""
        goal = _spot(place)
        while not wanted & self._seen:
            self.context.check_time()
            path = self.plan(goal)
            if path is None or len(path.points) == 1:
                return
            self.follow(path, LEG_MM)
            self._glance()

    def _look_round(self, wanted: set[str]) -> bool:
        """Turn by a whole turn, or until one of the targets is seen; return whether one was seen, now or before."""
        begin_deg = self.truth.pose.heading_deg
        while not wanted & self._seen and self.truth.pose.heading_deg - begin_deg < WHOLE_TURN_DEG:
            self.context.check_time()
            self.drive(0.0, self.mission.adaptive.scan_deg_s)
            self._glance()
        self.stop()
        return bool(wanted & self._seen)

    def _glance(self) -> None:
        """Remember the targets that the next frame shows."""
        glimpse = self._outages.run(lambda: self.vision.glance(self.mission.mission.targets))
        self._seen |= {name for name, sighting in glimpse.seen.items() if self._genuine(name, sighting)}

    def _genuine(self, target: str, sighting: Sighting) -> bool:
        """Return whether a sighting is where the target is."""
        at, pose = self.truth.pictures.get(target), self.truth.pose
        if at is None:
            return False
        bearing_deg = math.degrees(math.atan2(at.y_mm - pose.y_mm, at.x_mm - pose.x_mm)) - pose.heading_deg
        return abs(wrapped_deg(bearing_deg - sighting.bearing_deg)) <= GENUINE_DEG


class ScanPositions:
    """Places to look from, and which of the possible pictures each of them shows.

    Args:
        floor: Walls and furniture.
    """

    def __init__(self, floor: FloorPlan) -> None:
        self._floor, self._radius_mm = floor, ROBOT_RADIUS_MM + MARGINS_MM[-1]
        x, y = (np.arange(SPACING_MM / 2, side, SPACING_MM) for side in floor.size_mm)
        grid = np.stack([each.ravel() for each in np.meshgrid(x, y, indexing="ij")], axis=-1)
        clearance_mm = floor.clearance_mm(grid)
        self._possible = [
            Goal("", (px, py), facing, reach_mm=RANGE_MM, reach_deg=SLANT_DEG)
            for px, py in grid[clearance_mm > 0.0].tolist()
            for facing in FACINGS_DEG
        ]
        self._places = grid[clearance_mm >= self._radius_mm]
        self._shown = self._shows(self._places)
        self._unseen = np.ones(len(self._possible), dtype=np.bool_)
        self._untried = np.ones(len(self._places), dtype=np.bool_)

    def forget(self) -> None:
        """Begin a search: every possible picture is unseen."""
        self._unseen[:] = self._untried[:] = True

    def looked(self, place: Point) -> None:
        """Note that a scan from a place showed nothing."""
        self._unseen &= ~self._shows(np.array([place]))[0]
        self._untried &= self._away_mm(place) > SPACING_MM / 2

    def best(self, here: Point, speed_mm_s: float) -> Path | None:
        """Return the path to the place that shows the most unseen pictures in a second; None if none shows any."""
        news = (self._shown @ self._unseen.astype(np.float64)) * self._untried
        at_most = news / (LOOK_ROUND_S + self._away_mm(here) / speed_mm_s)
        best, most = None, 0.0
        for i in np.argsort(-at_most):
            if at_most[i] <= most:
                break
            x, y = self._places[i].tolist()
            path = self._floor.path(here, _spot((x, y)), self._radius_mm, inflation_mm=INFLATION_MM)
            if path is None:
                self._shown[i] = False  # there is no path to it
            elif (worth := news[i] / (LOOK_ROUND_S + path.length_mm / speed_mm_s)) > most:
                best, most = path, worth
        return best

    def _away_mm(self, place: Point) -> Floats:
        return np.asarray(np.hypot(*(self._places - np.asarray(place)).T))

    def _shows(self, places: Floats) -> Mask:
        """Return which possible pictures a scan from each place shows, (places, pictures)."""
        shown = []
        for _, goals in groupby(self._possible, key=lambda goal: goal.at_mm):
            same = list(goals)
            free = self._floor.sees(places, same[0])
            shown += [goal.covers(places) & free for goal in same]
        return np.stack(shown, axis=-1)


def _spot(place: Point) -> Goal:
    """Return a goal that any path to a place reaches."""
    return Goal("", place, 0.0, reach_mm=ARRIVED_MM, reach_deg=180.0)
