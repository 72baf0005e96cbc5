"""The adaptive policy: choose the recovery with the fewest expected seconds for a success."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from behaviors.adaptive.chances import Chances, shipped
from behaviors.adaptive.dwell_time import best_wait_s, cost_s, hypotheses
from behaviors.evidence import Evidence
from behaviors.mission import AdaptiveParameters
from behaviors.recoveries import CHANGE_TARGET, DETOUR, MOVE_TO, RESCAN, WAIT, Candidate, Choice, per_success_s

SHORTEST_WAIT_S = 0.5
"""Shorter waits are not proposed."""
WORTHWHILE_CHANCE = 0.02
"""A rescan with a smaller chance is not proposed while there is another viewpoint."""
BESIDE_STILL_MM = 1000.0
"""A detour around a still object over this much unknown floor is estimated to be passable with probability 1/e. How
often such detours succeed is counted."""
BESIDE_MOVING_MM = 100.0
"""The same around one that moves: people come through doors, and beside a door is a wall."""
USUAL = AdaptiveParameters()


class AdaptivePolicy:
    """Weighs candidates by their expected seconds for a success.

    Args:
        parameters: The mission's numbers.
        chances: How often choices succeed; by default as counted in many missions and in the user's own.
    """

    def __init__(self, parameters: AdaptiveParameters = USUAL, chances: Chances | None = None) -> None:
        self._parameters = parameters
        self._chances = chances or Chances(shipped(), parameters.chances)

    def select(self, evidence: Evidence) -> Choice:
        """Choose the best candidate, or another target."""
        limits = self._parameters
        if limits.max_researches is not None and evidence.researches >= limits.max_researches:
            return Choice(CHANGE_TARGET, f"searched again {evidence.researches} times")
        best = min(self.candidates(evidence), key=lambda candidate: candidate.expected_s, default=None)
        if best is None:
            return Choice(CHANGE_TARGET, "everything was tried here")
        if evidence.targets_left > 1 and evidence.blocker is None and evidence.spent_s >= limits.search_budget_s:
            return Choice(CHANGE_TARGET, f"{evidence.spent_s:.0f} s without a sighting that still counts")
        return best.choice

    def candidates(self, evidence: Evidence) -> list[Candidate]:
        """Return all candidates but those that were tried too often at this place.

        After that many failures here for one reason, whatever was chosen, the next choice leads away from here, if
        only to another target. When even that ended here for the same reason, nothing is left.
        """
        repeats = self._parameters.repeats
        if evidence.run > repeats or (evidence.failures > repeats and evidence.targets_left > 1):
            return list(self._others(evidence))
        past = self._untried(self._past_the_blocker(evidence), evidence)
        # where there is a detour, looking elsewhere would only lead back to the obstacle
        looking = [] if past and evidence.detour else self._untried(self._looking(evidence), evidence)
        return [*past, *looking, *self._others(evidence)]

    def _untried(self, candidates: Iterable[Candidate], evidence: Evidence) -> list[Candidate]:
        """Return the candidates that were not tried too often here; after repeated failures, only those elsewhere."""
        repeats = self._parameters.repeats

        def may_be_repeated(choice: Choice) -> bool:
            # a place that was tried from here is not offered again, so moving off is never the same twice
            goes_to_a_place = choice.kind is MOVE_TO and bool(choice.route)
            return goes_to_a_place or evidence.repeats.get(choice.kind.name, 0) < repeats

        def leads_away(choice: Choice) -> bool:
            return choice.kind in (MOVE_TO, DETOUR)

        stays = evidence.failures < repeats
        return [each for each in candidates if may_be_repeated(each.choice) and (stays or leads_away(each.choice))]

    def _past_the_blocker(self, evidence: Evidence) -> Iterator[Candidate]:
        blocker, detour = evidence.blocker, evidence.detour
        if blocker is None:
            return
        past, around = None, "there is no path around it"
        if detour:
            passable_mm = BESIDE_MOVING_MM if blocker.moving else BESIDE_STILL_MM
            passable = math.exp(-detour.unknown_mm / passable_mm)
            chance, situation = self._chances.of(DETOUR, evidence, passable)
            around = f"going round takes {detour.extra_s:.0f} s longer, with a chance of {chance:.0%}"
            choice = Choice(DETOUR, f"{around}, and waiting is not expected to pay", route=detour.route)
            past = Candidate(choice, detour.extra_s, chance, situation=situation)
        mixture = hypotheses(blocker)
        wait_s = self._parameters.fixed_wait_s
        if wait_s is None:
            wait_s = best_wait_s(mixture, past.expected_s if past else math.inf)
        if wait_s >= SHORTEST_WAIT_S:
            leaves = sum(each.weight * (1.0 - each.survival(wait_s)) for each in mixture)
            chance, situation = self._chances.of(WAIT, evidence, leaves)
            choice = Choice(WAIT, f"it may leave; {around}", wait_s=wait_s)
            # a detour leads to where the path beyond the blocker does, so neither counts what is done there
            otherwise_s, then_s = (past.expected_s, 0.0) if past else (None, self._look_beyond_s(evidence))
            yield Candidate(choice, cost_s(mixture, wait_s, 0.0), chance, otherwise_s, then_s, situation)
        if past:
            yield past

    def _look_beyond_s(self, evidence: Evidence) -> float:
        """Return the expected seconds for a success by looking from the place beyond the blocker."""
        place = evidence.blocked
        if place is None:
            return 0.0
        best = max(each.chance for each in (place, *evidence.viewpoints))
        chance, _ = self._chances.of(MOVE_TO, evidence, place.chance, best)
        return per_success_s(place.seconds, chance)

    def _others(self, evidence: Evidence) -> Iterator[Candidate]:
        for each in evidence.others:
            why = f"{each.target} was seen {each.age_s:.0f} s ago, {each.travel_s:.0f} s from here"
            choice = Choice(CHANGE_TARGET, f"{why}; it can be reached sooner", instead=each.target)
            chance, situation = self._chances.of(CHANGE_TARGET, evidence, each.chance)
            yield Candidate(choice, each.travel_s, chance, situation=situation)

    def _looking(self, evidence: Evidence) -> Iterator[Candidate]:
        here = evidence.here
        in_sight = evidence.blocker is not None and not evidence.blocker.hides
        if not in_sight and here is not None and (here.chance >= WORTHWHILE_CHANCE or not evidence.viewpoints):
            chance, situation = self._chances.of(RESCAN, evidence, here.chance)
            choice = Choice(RESCAN, f"{chance:.0%} chance that it was overlooked here")
            yield Candidate(choice, here.seconds, chance, situation=situation)
        best = max((each.chance for each in evidence.viewpoints), default=0.0)
        for each in evidence.viewpoints:
            chance, situation = self._chances.of(MOVE_TO, evidence, each.chance, best)
            why = f"{each.seconds:.0f} s to go there and look, {chance:.0%} chance to see it"
            yield Candidate(Choice(MOVE_TO, why, route=each.route), each.seconds, chance, situation=situation)
