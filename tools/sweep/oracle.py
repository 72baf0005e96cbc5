"""The oracle: drives the same robot by the simulation's truth, which only it may read; a bound for all policies.

It uses no camera: it knows where the pictures are, plans on the true map around what stands there now, and drives by
its true pose.
"""

from __future__ import annotations

import math

from behaviors.angles import wrapped_deg
from behaviors.events import Event, Reason
from behaviors.ports import StopReason
from sim_backend.simulation import Simulation

from .baseline import Baseline
from .floor_plan import Goal, Way
from .robot import Robot
from .room_builder import ROBOT_RADIUS_MM
from .survey import survey

MARGINS_MM = (50.0, 25.0, 8.0)
"""Clearances beside the robot; the largest for which there is a way is used."""
BERTH_MM = 150.0
"""Additional clearance where a slightly longer way allows it."""
REACH_MM, NEAREST_MM, REACH_DEG = 430.0, 320.0, 65.0
"""It stops well inside of where a stop counts, and no nearer than the safety stop lets it."""
LEG_MM = 600.0
"""It plans again after this distance."""
AIM_DEG = 2.0
"""It drives straight on within this bearing."""
BACK_OFF_MM = 120.0
"""How far it backs off from what stopped it."""
PATIENCE_S, LOOK_S = 60.0, 1.0
"""Total time without a way before it gives a target up, and how often it plans meanwhile."""


class Oracle(Baseline):
    """Plans by the truth.

    Args:
        robot: The robot.
        simulation: The truth.
    """

    def __init__(self, robot: Robot, simulation: Simulation) -> None:
        super().__init__(robot)
        self._simulation = simulation

    def pursue(self, target: str) -> bool:
        """Drive to where a stop counts."""
        self.enter("search")
        self.queue.current.attempts += 1
        waited_s = 0.0
        while target in self._simulation.truth.pictures and waited_s < PATIENCE_S:
            self.context.check_time()
            way = self._plan(target)
            if way is None:
                waited_s += LOOK_S
                self.rest(LOOK_S)
            elif len(way.points) == 1:
                self.enter("arrive", Event.TARGET_SEEN, Reason.SIGHTED)
                return True
            else:
                self._drive(way)
        return False

    def _plan(self, target: str) -> Way | None:
        """The shortest way there among what stands there now, with as much room as there is a way for."""
        truth = self._simulation.truth
        plan, picture, here = survey(self._simulation), truth.pictures[target], truth.pose
        goal = Goal(
            target,
            (picture.x_mm, picture.y_mm),
            picture.heading_deg,
            reach_mm=REACH_MM,
            nearest_mm=NEAREST_MM,
            reach_deg=REACH_DEG,
        )
        for margin_mm in MARGINS_MM:
            way = plan.way((here.x_mm, here.y_mm), goal, ROBOT_RADIUS_MM + margin_mm, berth_mm=BERTH_MM)
            if way is not None:
                return way
        return None

    def _drive(self, way: Way) -> None:
        """Drive the first leg of a way, or its beginning."""
        here = self._simulation.truth.pose
        there = way.points[1]
        bearing_deg = math.degrees(math.atan2(there[1] - here.y_mm, there[0] - here.x_mm))
        off_deg = wrapped_deg(bearing_deg - here.heading_deg)
        if abs(off_deg) > AIM_DEG:
            self.turn(off_deg)
        motion = self.straight(min(LEG_MM, math.dist(way.points[0], there)))
        if motion.stop is not StopReason.DONE:
            self.straight(-BACK_OFF_MM)
