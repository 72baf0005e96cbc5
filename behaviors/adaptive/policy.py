"""The adaptive rule: of everything that can be done, what is expected to lead on in the fewest seconds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from behaviors.adaptive.dwell_time import best_wait_s, cost_s, hypotheses
from behaviors.mission import AdaptiveParameters
from behaviors.recovery import Candidate, Choice, Evidence, Recovery

DETOUR_CHANCE, WAIT_CHANCE = 0.8, 0.9
"""How often going round leads on; and waiting, when going round is left if it was in vain."""
SHORTEST_WAIT_S = 0.5
"""A wait shorter than this is none."""
WORTH_A_LOOK = 0.02
"""With less of a chance it is not looked for again from here, as long as there is anywhere else to look from."""


@dataclass(frozen=True, slots=True)
class AdaptivePolicy:
    """Weighs the candidates by the seconds a success is expected to cost.

    Attributes:
        search_budget_s: So long a target is searched for in vain while another one waits.
        repeats: The same recovery is not chosen more often for one target at one place.
        fixed_wait_s: Wait so long, whatever is in the way; None to reckon it.
        max_researches: Searches for one target after the first, in each round; None for as many as there is time for.
    """

    search_budget_s: float = 42.0
    repeats: int = 2
    fixed_wait_s: float | None = None
    max_researches: int | None = None

    @classmethod
    def of(cls, profile: AdaptiveParameters) -> AdaptivePolicy:
        """The rule with a mission's numbers."""
        return cls(profile.search_budget_s, profile.repeats, profile.fixed_wait_s, profile.max_researches)

    def select(self, evidence: Evidence) -> Choice:
        """The best candidate, or another target."""
        if self.max_researches is not None and evidence.researches >= self.max_researches:
            return Choice(Recovery.CHANGE_TARGET, f"searched again {evidence.researches} times")
        best = min(self.options(evidence), key=lambda option: option.expected_s, default=None)
        if best is None:
            return Choice(Recovery.CHANGE_TARGET, "everything was tried here")
        if evidence.targets_left > 1 and evidence.blocker is None and evidence.spent_s >= self.search_budget_s:
            return Choice(Recovery.CHANGE_TARGET, f"searched in vain for {evidence.spent_s:.0f} s")
        return best.choice

    def options(self, evidence: Evidence) -> list[Candidate]:
        """All candidates but those that have been tried too often at this place."""
        past = self._untried(self._past_the_blocker(evidence), evidence)
        # where there is a way round, looking elsewhere would only lead back to what is in the way
        looking = [] if past and evidence.detour else self._untried(_looking(evidence), evidence)
        return [*past, *looking, *_others(evidence)]

    def _untried(self, candidates: Iterable[Candidate], evidence: Evidence) -> list[Candidate]:
        # a place that was tried from here is not offered again, so moving off is never the same twice
        return [
            each
            for each in candidates
            if (each.choice.kind is Recovery.MOVE_TO and each.choice.route)
            or evidence.repeats.get(each.choice.kind, 0) < self.repeats
        ]

    def _past_the_blocker(self, evidence: Evidence) -> Iterator[Candidate]:
        blocker, detour = evidence.blocker, evidence.detour
        if blocker is None:
            return
        round_s = detour.extra_s if detour else math.inf
        things = hypotheses(blocker)
        wait_s = best_wait_s(things, round_s) if self.fixed_wait_s is None else self.fixed_wait_s
        if wait_s >= SHORTEST_WAIT_S:
            why = (
                f"it may leave; going round takes {round_s:.0f} s" if detour else "it may leave; there is no way round"
            )
            leaves = sum(kind.weight * (1.0 - kind.survival(wait_s)) for kind in things)
            yield Candidate(
                Choice(Recovery.WAIT, why, wait_s=wait_s),
                cost_s(things, wait_s, round_s),
                WAIT_CHANCE if detour else leaves,
            )
        if detour:
            why = f"going round takes {round_s:.0f} s, and waiting is not expected to pay"
            yield Candidate(Choice(Recovery.DETOUR, why, route=detour.route), round_s, DETOUR_CHANCE)


def _others(evidence: Evidence) -> Iterator[Candidate]:
    for each in evidence.others:
        why = f"{each.target} was seen {each.age_s:.0f} s ago, {each.travel_s:.0f} s from here; it can be had sooner"
        choice = Choice(Recovery.CHANGE_TARGET, why, instead=each.target)
        yield Candidate(choice, each.travel_s, each.chance)


def _looking(evidence: Evidence) -> Iterator[Candidate]:
    here = evidence.here
    in_sight = evidence.blocker is not None and not evidence.blocker.hides
    if not in_sight and here is not None and (here.chance >= WORTH_A_LOOK or not evidence.viewpoints):
        why = f"it may have been missed here: {here.chance:.0%}"
        yield Candidate(Choice(Recovery.RESCAN, why), here.seconds, here.chance)
    for each in evidence.viewpoints:
        why = f"{each.travel_s:.0f} s from here the chance to see it is {each.chance:.0%}"
        yield Candidate(Choice(Recovery.MOVE_TO, why, route=each.route), each.seconds, each.chance)
