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
"""All profiles, by name."""


def make_policy(profile: str, mission: Mission) -> RecoveryPolicy:
    """Make a profile's own policy with the mission's numbers."""
    if profile == "thesis":
        return ThesisPolicy.of(mission.thesis)
    return AdaptivePolicy.of(mission.adaptive)


def supervised(mission: Mission, ask: Ask) -> MakeProfile:
    """Make the mission's profile with a person who confirms or replaces every choice."""
    profile = mission.mission.profile
    return partial(PROFILES[profile], policy=ConfirmedPolicy(make_policy(profile, mission), ask))
