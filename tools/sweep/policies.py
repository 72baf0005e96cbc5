"""The policies that are compared, by name.

A policy drives one mission on a `Robot`. To compare another one, add a line to `POLICIES`: an entry is a function from
a robot to the mission's report, and it is judged by the journal that it writes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from behaviors.executive import Executive, Report
from behaviors.mission import Mission
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.profiles.profile import MakeProfile, ThesisProfile
from behaviors.recoveries import ThesisPolicy
from sim_backend.simulation import Simulation

from .baselines import Nav2List, RandomWalk
from .oracle import Oracle
from .robot import Robot

NEVER = 10**9
"""Searches for one target before it is given up."""

Policy = Callable[[Robot], Report]


def _executive(make_profile: MakeProfile, **adaptive: object) -> Policy:
    """The mission's executive with a profile; and with other numbers for the adaptive one."""

    def run(robot: Robot) -> Report:
        profile = robot.mission.adaptive.model_copy(update=adaptive)
        mission = robot.mission.model_copy(update={"adaptive": profile})
        return Executive(mission, robot.body, robot.eyes, robot.clock, robot.observers, make_profile).run()

    return run


POLICIES: dict[str, Policy] = {
    "thesis": _executive(ThesisProfile),
    "thesis-unlimited": _executive(partial(ThesisProfile, policy=ThesisPolicy(max_researches=NEVER))),
    "adaptive": _executive(AdaptiveProfile),
    "nav2-list": lambda robot: Nav2List(robot).run(),
    "random-walk": lambda robot: RandomWalk(robot).run(),
}
THESIS_BUDGET = {"rounds": 1, "max_researches": 2}
"""Two searches after the first, and a target given up is not tried again."""
ABLATIONS: dict[str, Policy] = {
    "adaptive-thesis-budget": _executive(AdaptiveProfile, **THESIS_BUDGET),
    "adaptive-one-round": _executive(AdaptiveProfile, rounds=1),
    "adaptive-fixed-wait": _executive(AdaptiveProfile, fixed_wait_s=15.0),
    "adaptive-no-detour": _executive(AdaptiveProfile, detours=False),
    "adaptive-no-viewpoints": _executive(AdaptiveProfile, chooses_viewpoints=False),
    "adaptive-in-order": _executive(AdaptiveProfile, in_order=True),
    "adaptive-no-memory": _executive(AdaptiveProfile, remembers_others=False),
}
"""The adaptive profile without one of its faculties; only when asked for by name."""
ORACLE = "oracle"
NAMES = (*POLICIES, ORACLE)
ALL_NAMES = (*NAMES, *ABLATIONS)
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
    return {**POLICIES, **ABLATIONS}[policy](robot)
