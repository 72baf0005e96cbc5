"""Why a robot did what it did, and what another policy would have done."""

from __future__ import annotations

from dataclasses import dataclass

from behaviors.mission import Mission, MissionError
from behaviors.operator import OperatorChoice
from behaviors.profile_names import ADAPTIVE
from behaviors.profiles.registry import exit_as_error, make_policy
from behaviors.recoveries import RecoveryPolicy
from nxtdrive.recording.decision_costs import DecisionCosts, decision_costs
from nxtdrive.recording.decisions import Decision, Replay, decisions, replay, weighed_by
from nxtdrive.recording.run_reader import PastRun

DEFAULTS = Mission.model_validate(
    {"mission": {"targets": ["any"]}, "target": {"any": {"detector": "color", "color": "red"}}}
)
"""Used for a journal without a mission: only the profiles' parameters are needed."""


@dataclass(frozen=True, slots=True)
class ExplainedDecision:
    """One decision.

    Attributes:
        decision: As the journal has it.
        candidates: The alternatives as the run's policy weighs them; empty if it does not weigh.
        replay: What the other policy would have chosen with its evidence.
        what_if: The cost of each candidate by ``nxtdrive what-if``; None if that was not run.
    """

    decision: Decision
    candidates: tuple[OperatorChoice, ...]
    replay: Replay
    what_if: DecisionCosts | None = None


@dataclass(frozen=True, slots=True)
class Explanation:
    """A whole run.

    Attributes:
        run: What was read.
        profile: The profile that made the decisions; None if the run's mission cannot be read.
        policy: The profile whose policy `ExplainedDecision.replay` is about; the same if no other was given.
        decisions: All of them, in order.
        unavailable: Why the run's own policy cannot be loaded here; then no decision has candidates.
    """

    run: PastRun
    profile: str | None
    policy: str | None
    decisions: tuple[ExplainedDecision, ...]
    unavailable: str = ""

    @property
    def other_policy(self) -> str | None:
        """The profile that `ExplainedDecision.replay` is about if it is not the run's own."""
        return self.policy if self.policy != self.profile else None


def explain(run: PastRun, policy: str | None = None) -> Explanation:
    """Explain a run; where its profile is not known, alternatives in the evidence are weighed as the adaptive one does.

    Args:
        run: As read.
        policy: Name of the profile whose policy gets each decision's evidence again; the run's own when None.

    Raises:
        MissionError: The class of `policy` cannot be loaded (that of the run's own need not be here), or one exited.
    """
    mission = run.mission or DEFAULTS
    made = decisions(run.records)
    profile = run.mission.mission.profile if run.mission else None
    own, unavailable = _own_policy(profile or ADAPTIVE, mission)
    asked = make_policy(policy, mission) if policy else own if profile else None
    known = decision_costs(run.path.parent)
    with exit_as_error():
        explained = tuple(
            ExplainedDecision(each, weighed_by(own, each), replay(asked, each), known.get(i))
            for i, each in enumerate(made, 1)
        )
    return Explanation(run, profile, policy or profile, explained, unavailable)


def _own_policy(profile: str, mission: Mission) -> tuple[RecoveryPolicy | None, str]:
    """Return a run's own policy, or why it cannot be loaded here: the run may come from another folder or computer."""
    try:
        return make_policy(profile, mission), ""
    except MissionError as error:
        return None, str(error)
