"""The oracle: drives the same robot with the truth before its eyes. What it does not reach, nobody can be blamed for.

It alone may read the simulation's truth. It sees no pictures: it knows where they are, plans on the true map around
whatever stands there now, and drives by where it really is.
"""

from __future__ import annotations

import math

from behaviors.adaptive.angles import wrapped_deg
from behaviors.events import Event, Reason
from behaviors.ports import StopReason
from sim_backend.simulation import Simulation

from .baseline import Baseline
from .floor_plan import Goal, Way
from .robot import Robot
from .room_builder import ROBOT_RADIUS_MM
from .survey import survey

MARGINS_MM = (50.0, 25.0, 8.0)
"""Room beside the robot: as much as there is a way for."""
BERTH_MM = 150.0
"""And so much more where a little longer way allows it."""
REACH_MM, NEAREST_MM, REACH_DEG = 430.0, 320.0, 65.0
"""It stops well inside of where a stop counts, and no nearer than the safety stop lets it."""
LEG_MM = 600.0
"""It looks at the map again after so far."""
AIM_DEG = 2.0
"""It drives straight on when it is off by no more."""
BACK_OFF_MM = 120.0
"""It leaves what stopped it so far behind."""
PATIENCE_S, LOOK_S = 60.0, 1.0
"""So long without a way, in all, before it gives a target up; and how often it looks for one meanwhile."""


class Oracle(Baseline):
    """Knows everything, and drives as well as the robot can.

    Args:
        robot: What it works with.
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
