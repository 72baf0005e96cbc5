"""The agents that a sweep compares, by name: profiles, baselines and oracles.

An agent drives one mission through its ports. To compare another one, add a line to `AGENTS`: an entry is a function
that takes `ScenarioRobot` and returns the mission's report. It is evaluated by the journal that it writes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from behaviors.executive import Executive, Report
from behaviors.mission import Mission, ThesisParameters
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.profiles.profile import MakeProfile
from behaviors.profiles.registry import find_profile
from behaviors.profiles.thesis import ThesisProfile
from behaviors.thesis.policy import ThesisPolicy
from nxtdrive.simulated.robot import ScenarioRobot
from sim_backend.simulation import Simulation

from .baselines import Nav2List, RandomWalk
from .oracle import Oracle
from .oracle_eyes import OracleEyes

UNLIMITED = ThesisParameters().model_copy(update={"max_researches": 10**9})
"""The thesis's, but without a limit to the searches for one target; a mission file cannot say so."""

Agent = Callable[[ScenarioRobot], Report]


def _executive(make_profile: MakeProfile, **adaptive: object) -> Agent:
    """Return an agent that runs the executive with a profile, with these parameters of the adaptive one replaced."""

    def run(robot: ScenarioRobot) -> Report:
        profile = robot.mission.adaptive.model_copy(update=adaptive)
        mission = robot.mission.model_copy(update={"adaptive": profile})
        return Executive(mission, robot.ports, robot.observers, make_profile).run()

    return run


AGENTS: dict[str, Agent] = {
    "thesis": _executive(ThesisProfile),
    "thesis-unlimited": _executive(partial(ThesisProfile, policy=ThesisPolicy(UNLIMITED))),
    "adaptive": _executive(AdaptiveProfile),
    "nav2-list": lambda robot: Nav2List(robot).run(),
    "random-walk": lambda robot: RandomWalk(robot).run(),
}
THESIS_BUDGET = {"rounds": 1, "max_researches": 2}
"""Two further searches after the first one, and no second try for a target that was given up."""
ABLATIONS: dict[str, Agent] = {
    "adaptive-thesis-budget": _executive(AdaptiveProfile, **THESIS_BUDGET),
    "adaptive-one-round": _executive(AdaptiveProfile, rounds=1),
    "adaptive-fixed-wait": _executive(AdaptiveProfile, fixed_wait_s=15.0),
    "adaptive-no-detour": _executive(AdaptiveProfile, detours=False),
    "adaptive-no-viewpoints": _executive(AdaptiveProfile, chooses_viewpoints=False),
    "adaptive-in-order": _executive(AdaptiveProfile, in_order=True),
    "adaptive-no-memory": _executive(AdaptiveProfile, remembers_others=False),
    "adaptive-no-floor": _executive(AdaptiveProfile, sees_floor=False),
}
"""The adaptive profile with one capability removed; run only when selected by name."""
ORACLE = "oracle"
ORACLES = {ORACLE: Oracle, "oracle-eyes": OracleEyes}
"""Agents that read the truth; all but the first are run only when selected by name."""
NAMES = (*AGENTS, ORACLE)
ALL_NAMES = (*AGENTS, *ORACLES, *ABLATIONS)
ORACLES_STOP_MM = 30.0
"""The oracles' safety stop distance; with the usual one they would stop at obstacles that they pass closely."""


def equipped(agent: str, mission: Mission) -> Mission:
    """Return the mission with the robot set up for the agent: oracles may pass close to obstacles."""
    if agent not in ORACLES:
        return mission
    robot = mission.robot.model_copy(update={"stop_distance_mm": ORACLES_STOP_MM})
    return mission.model_copy(update={"robot": robot})


def drive(agent: str, robot: ScenarioRobot, simulation: Simulation) -> Report:
    """Run a mission with an agent or with a custom profile; only oracles get the simulation."""
    if agent in ORACLES:
        return ORACLES[agent](robot, simulation).run()
    known = AGENTS.get(agent) or ABLATIONS.get(agent)
    return (known or _executive(find_profile(agent)))(robot)
