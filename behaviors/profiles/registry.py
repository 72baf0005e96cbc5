"""The profiles by name: how a mission's robot behaves."""

from __future__ import annotations

from functools import partial

from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.mission import Mission
from behaviors.operator import Ask, ConfirmedPolicy
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.profiles.profile import MakeProfile, ThesisProfile
from behaviors.recoveries import RecoveryPolicy, ThesisPolicy

PROFILES: dict[str, type[ThesisProfile] | type[AdaptiveProfile]] = {
    "thesis": ThesisProfile,
    "adaptive": AdaptiveProfile,
}
"""What is done in each state, and chosen after a failure."""


def make_policy(profile: str, mission: Mission) -> RecoveryPolicy:
    """The rule by which a profile chooses, with the mission's numbers, as its mind makes it for itself."""
    if profile == "thesis":
        return ThesisPolicy.of(mission.thesis)
    return AdaptivePolicy.of(mission.adaptive)


def supervised(mission: Mission, ask: Ask) -> MakeProfile:
    """The mission's profile with a person who has the last word on every recovery."""
    profile = mission.mission.profile
    return partial(PROFILES[profile], policy=ConfirmedPolicy(make_policy(profile, mission), ask))
