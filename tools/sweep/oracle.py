"""Drive the same robot by the simulation's ground truth, as an upper bound for all agents.

Only the oracle may read the truth. It uses no camera: it has the true places of the pictures, plans on the true map
around the obstacles of the moment, and drives by its true pose.
"""

from __future__ import annotations

import math

from behaviors.angles import wrapped_deg
from behaviors.events import Event, Reason
from behaviors.ports import StopReason
from nxtdrive.simulated.robot import ScenarioRobot
from sim_backend.evaluation import current_floor_plan
from sim_backend.scenarios.floor_plan import Goal, Path
from sim_backend.scenarios.room_builder import ROBOT_RADIUS_MM
from sim_backend.simulation import Simulation

from .baseline import Baseline

MARGINS_MM = (50.0, 25.0, 8.0)
"""Clearances beside the robot; the largest that leaves a path is used."""
INFLATION_MM = 150.0
"""Additional clearance to keep where that makes the path only a little longer."""
REACH_MM, NEAREST_MM, REACH_DEG = 430.0, 320.0, 65.0
"""It stops well inside the zone in which a stop counts, and no nearer than the safety stop allows."""
LEG_MM = 600.0
"""It plans again after this distance."""
AIM_DEG = 2.0
"""It drives straight on without a turn within this bearing."""
BACK_OFF_MM = 120.0
"""How far it backs away from an obstacle that stopped it."""
WITHOUT_PATH_S, LOOK_S = 60.0, 1.0
"""Total time without a path before it gives a target up, and the planning period in that time."""


class Oracle(Baseline):
    """Plan and drive by the ground truth.

    Args:
        robot: The robot.
        simulation: The source of the ground truth.

    Attributes:
        truth: The ground truth.
    """

    def __init__(self, robot: ScenarioRobot, simulation: Simulation) -> None:
        super().__init__(robot)
        self._simulation = simulation
        self.truth = simulation.truth

    def pursue(self, target: str) -> bool:
        """Drive to where a stop counts."""
        self.enter("search")
        self.queue.current.attempts += 1
        waited_s = 0.0
        while target in self.truth.pictures and waited_s < WITHOUT_PATH_S:
            self.context.check_time()
            path = self.plan(self._stop_before(target))
            if path is None:
                waited_s += LOOK_S
                self.rest(LOOK_S)
            elif len(path.points) == 1:
                self.enter("arrive", Event.TARGET_SEEN, Reason.SIGHTED)
                return True
            else:
                self.follow(path)
        return False

    def plan(self, goal: Goal) -> Path | None:
        """Return the shortest path among the obstacles of the moment, with the largest clearance that leaves one."""
        floor, here = current_floor_plan(self._simulation), self.truth.pose
        for margin_mm in MARGINS_MM:
            path = floor.path((here.x_mm, here.y_mm), goal, ROBOT_RADIUS_MM + margin_mm, inflation_mm=INFLATION_MM)
            if path is not None:
                return path
        return None

    def follow(self, path: Path, most_mm: float = LEG_MM) -> None:
        """Drive the first leg of a path, or its beginning."""
        here = self.truth.pose
        there = path.points[1]
        bearing_deg = math.degrees(math.atan2(there[1] - here.y_mm, there[0] - here.x_mm))
        off_deg = wrapped_deg(bearing_deg - here.heading_deg)
        if abs(off_deg) > AIM_DEG:
            self.turn(off_deg)
        motion = self.straight(min(most_mm, math.dist(path.points[0], there)))
        if motion.stop is not StopReason.DONE:
            self.straight(-BACK_OFF_MM)

    def _stop_before(self, target: str) -> Goal:
        picture = self.truth.pictures[target]
        return Goal(
            target,
            (picture.x_mm, picture.y_mm),
            picture.heading_deg,
            reach_mm=REACH_MM,
            nearest_mm=NEAREST_MM,
            reach_deg=REACH_DEG,
        )
