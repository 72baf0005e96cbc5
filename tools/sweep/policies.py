"""The policies that are compared, by name.

A policy drives one mission on a `Robot`. To compare another mind, add a line to `POLICIES`: an entry is anything that
takes a robot and returns the mission's report, and whatever journal it writes is what it is judged by.
"""

from __future__ import annotations

from collections.abc import Callable

from behaviors.executive import Executive, Report
from behaviors.mission import Mission
from behaviors.recovery import RecoveryPolicy, ThesisPolicy
from sim_backend.simulation import Simulation

from .baselines import Nav2List, RandomWalk
from .oracle import Oracle
from .robot import Robot

NEVER = 10**9

Policy = Callable[[Robot], Report]


def _executive(recovery: RecoveryPolicy | None = None) -> Policy:
    """The mission's executive with a rule for its recoveries; the mission's own profile when None."""
    return lambda robot: Executive(robot.mission, robot.body, robot.eyes, robot.clock, robot.observers, recovery).run()


POLICIES: dict[str, Policy] = {
    "thesis": _executive(),
    "thesis-unlimited": _executive(ThesisPolicy(max_researches=NEVER)),
    "nav2-list": lambda robot: Nav2List(robot).run(),
    "random-walk": lambda robot: RandomWalk(robot).run(),
}
ORACLE = "oracle"
NAMES = (*POLICIES, ORACLE)
ORACLES_STOP_MM = 30.0
"""Its safety stop's distance; the usual one stops it before what it is about to pass."""


def equipped(policy: str, mission: Mission) -> Mission:
    """The mission with the robot that the policy drives: who knows where everything is may pass close by it."""
    if policy != ORACLE:
        return mission
    robot = mission.robot.model_copy(update={"stop_distance_mm": ORACLES_STOP_MM})
    return mission.model_copy(update={"robot": robot})


def drive(policy: str, robot: Robot, simulation: Simulation) -> Report:
    """Let a policy drive a mission; only the oracle is shown the simulation."""
    if policy == ORACLE:
        return Oracle(robot, simulation).run()
    return POLICIES[policy](robot)
