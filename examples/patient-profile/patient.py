"""A profile for busy floors: an obstacle gets twenty seconds to leave, twice, before the robot goes round."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.evidence import Evidence
from behaviors.mission import Mission
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.recoveries import WAIT, Candidate, Choice

WAIT_S, WAITS = 20.0, 2


@dataclass(frozen=True)
class PatientPolicy:
    """Waits for an obstacle to leave; in all other cases it chooses as the adaptive policy does."""

    otherwise: AdaptivePolicy

    def select(self, evidence: Evidence) -> Choice:
        """Choose what to do after a failure."""
        if evidence.blocker is not None and evidence.repeats.get(WAIT.name, 0) < WAITS:
            return Choice(WAIT, "people need time to leave", wait_s=WAIT_S)
        return self.otherwise.select(evidence)

    def candidates(self, evidence: Evidence) -> Sequence[Candidate]:
        """Return the candidates, for a person who confirms choices and for explain-run."""
        return self.otherwise.candidates(evidence)


class Patient(AdaptiveProfile):
    """The adaptive profile with that policy."""

    @classmethod
    def own_policy(cls, mission: Mission) -> PatientPolicy:
        """Return the policy by which it chooses."""
        return PatientPolicy(AdaptivePolicy(mission.adaptive))
