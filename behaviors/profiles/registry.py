"""The profiles by name: how a mission's robot behaves."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from functools import partial
from importlib import import_module
from pathlib import Path
from traceback import walk_tb
from typing import Any

from behaviors.mission import Mission, MissionError
from behaviors.operator import Ask, ConfirmedPolicy
from behaviors.profile_names import ADAPTIVE, THESIS, installed_profiles
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.profiles.profile import MakeProfile, ProfileClass, ThesisProfile
from behaviors.recoveries import RecoveryPolicy

PROFILES: dict[str, ProfileClass] = {THESIS: ThesisProfile, ADAPTIVE: AdaptiveProfile}
"""The built-in profiles, by name."""
loaded_from_elsewhere: dict[str, str] = {}
"""Loaded profiles that are not built in, each with its package: an exception may come from there."""
NEEDED = ("own_policy", "skill", "learn", "evidence", "select")


def find_profile(name: str) -> ProfileClass:
    """Return the class of a profile: a built-in one, an installed one, or ``package.module:Class``.

    Raises:
        MissionError: There is no such class, or it is no profile.
    """
    if built_in := PROFILES.get(name):
        return built_in
    try:
        entry = installed_profiles().get(name)
        found: Any = entry.load() if entry else _imported(name)
    except Exception as error:  # the module of another package may raise anything
        reason = f"{type(error).__name__}: {error}"
        remedy = "name it as module:Class in the folder of module.py, or install its package (docs/profiles.md)."
        raise MissionError(f"profile {name!r} cannot be loaded: {reason}; {remedy}") from error
    missing = [each for each in NEEDED if not callable(getattr(found, each, None))]
    if missing:
        raise MissionError(f"profile {name!r} lacks {', '.join(missing)}; docs/profiles.md says what a profile has.")
    package = found.__module__.partition(".")[0]
    if package != __name__.partition(".")[0]:  # another name for a class of ours
        loaded_from_elsewhere[name] = package
    return found  # type: ignore[no-any-return]


def raised_by_profile(error: Exception, ran: str = "") -> MissionError | None:
    """Return an exception that the code of a profile from elsewhere let pass, with its place in words; else None.

    Args:
        error: With its traceback.
        ran: Name of the profile that ran, if known; otherwise all profiles of that package are named.
    """
    for frame, line in reversed(list(walk_tb(error.__traceback__))):
        package = frame.f_globals.get("__name__", "").partition(".")[0]
        if names := [name for name, its_package in loaded_from_elsewhere.items() if its_package == package]:
            what = f"{frame.f_code.co_filename}:{line}: {type(error).__name__}: {error}"
            return MissionError(f"profile {either([ran] if ran in names else names)} failed at {what}")
    return None


def either(names: Iterable[str]) -> str:
    """Return the names of profiles one of which is meant."""
    return " or ".join(map(repr, sorted(names)))


def _imported(name: str) -> object:
    """Import a class from a module, even one in the current folder, as ``python -m`` does."""
    module, _, attribute = name.partition(":")
    if not attribute:
        raise ModuleNotFoundError(f"no installed package offers {name!r}")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    return getattr(import_module(module), attribute)


def make_policy(profile: str, mission: Mission) -> RecoveryPolicy:
    """Make a profile's own policy with the mission's numbers.

    Raises:
        MissionError: See `find_profile`.
    """
    return find_profile(profile).own_policy(mission)


def supervised(mission: Mission, ask: Ask) -> MakeProfile:
    """Make the mission's profile with a person who confirms or replaces every choice."""
    profile = mission.mission.profile
    return partial(find_profile(profile), policy=ConfirmedPolicy(make_policy(profile, mission), ask))
