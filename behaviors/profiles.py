"""The profiles by name: how a mission's robot behaves."""

from __future__ import annotations

from behaviors.adaptive.mind import AdaptiveMind
from behaviors.mind import MakeMind, ThesisMind

PROFILES: dict[str, MakeMind] = {"thesis": ThesisMind, "adaptive": AdaptiveMind}
