"""Why a robot did what it did, and what another policy would have done."""

from __future__ import annotations

from dataclasses import dataclass

from behaviors.mission import Mission
from behaviors.operator import OperatorChoice
from behaviors.profiles.registry import make_policy
from nxtdrive.recording.decisions import Decision, Replay, decisions, profile_of, replay, weighed_by
from nxtdrive.recording.run_reader import PastRun

DEFAULTS = Mission.model_validate(
    {"mission": {"targets": ["any"]}, "target": {"any": {"detector": "color", "color": "red"}}}
)
"""Stands in for the mission of a journal without one: only the profiles' numbers are asked for."""


@dataclass(frozen=True, slots=True)
class Explained:
    """One decision.

    Attributes:
        decision: As the journal has it.
        candidates: What could have been done as the run's policy weighs it; empty if it does not weigh.
        replay: What the policy that was asked for makes of its evidence.
    """

    decision: Decision
    candidates: tuple[OperatorChoice, ...]
    replay: Replay


@dataclass(frozen=True, slots=True)
class Explanation:
    """A whole run.

    Attributes:
        run: What was read.
        profile: Whose decisions these are.
        policy: Whose choices `Explained.replay` has; the same profile's if no other was asked for.
        decisions: All of them, in order.
    """

    run: PastRun
    profile: str
    policy: str
    decisions: tuple[Explained, ...]


def explain(run: PastRun, policy: str | None = None) -> Explanation:
    """Explain a run.

    Args:
        run: As read.
        policy: Name of the profile that is given each decision's evidence again; the run's own when None.
    """
    mission = run.mission or DEFAULTS
    made = decisions(run.records)
    profile = profile_of(run.mission, made)
    policy = policy or profile
    own, asked = make_policy(profile, mission), make_policy(policy, mission)
    explained = (Explained(each, weighed_by(own, each), replay(asked, each)) for each in made)
    return Explanation(run, profile, policy, tuple(explained))
