"""The profiles by name: how a mission's robot behaves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from traceback import walk_tb
from typing import cast

from behaviors.mission import Mission, MissionError
from behaviors.operator import Ask, ConfirmedPolicy
from behaviors.profile_names import ADAPTIVE, THESIS
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.profiles.loading import described, is_signal, load
from behaviors.profiles.profile import MakeProfile, ProfileClass
from behaviors.profiles.thesis import ThesisProfile
from behaviors.recoveries import RecoveryPolicy
from behaviors.return_types import checked

PROFILES: dict[str, ProfileClass] = {THESIS: ThesisProfile, ADAPTIVE: AdaptiveProfile}
"""The built-in profiles, by name."""
FAILED = "Correct it there, or report it to the profile's author."
EXITED = "A profile must not end the program: return from the method, or raise an exception."
external_profiles: dict[str, str] = {}
"""Loaded profiles of other packages, by name, each with its package, in which an exception may have been raised."""


def find_profile(name: str) -> ProfileClass:
    """Return the class of a profile: a built-in one, an installed one, or ``package.module:Class``.

    Raises:
        MissionError: There is no such class, or it is not a profile.
    """
    if built_in := PROFILES.get(name):
        return built_in
    found = load(name)
    package = found.__module__.partition(".")[0]
    if package != __name__.partition(".")[0]:  # another name for a built-in class
        external_profiles[name] = package
    return cast("ProfileClass", found)


def raised_by_profile(error: BaseException, ran: str = "") -> MissionError | None:
    """Return an exception that was raised in the code of an external profile, with its place; None for any other.

    Args:
        error: With its traceback. A MissionError says what is wrong already.
        ran: Name of the profile that ran, if known; otherwise all profiles of that package are named.
    """
    if isinstance(error, MissionError):
        return error
    if is_signal(error):
        return None
    for frame, line in reversed(list(walk_tb(error.__traceback__))):
        package = frame.f_globals.get("__name__", "").partition(".")[0]
        if names := [name for name, its_package in external_profiles.items() if its_package == package]:
            what = f"{frame.f_code.co_filename}:{line}: {described(error)}"
            remedy = EXITED if isinstance(error, SystemExit) else FAILED
            return MissionError(f"profile {either([ran] if ran in names else names)} failed at {what}. {remedy}")
    return None


@contextmanager
def exit_as_error() -> Iterator[None]:
    """Raise ``sys.exit()`` of an external profile within the block as an error: the program would end silently.

    Raises:
        MissionError: The profile exited.
    """
    try:
        yield
    except SystemExit as error:
        if known := raised_by_profile(error):
            raise known from error
        raise


def either(names: Iterable[str]) -> str:
    """Return the names of profiles, joined by "or"."""
    return " or ".join(map(repr, sorted(names)))


def make_policy(profile: str, mission: Mission) -> RecoveryPolicy:
    """Make a profile's own policy with the mission's numbers.

    Raises:
        MissionError: See `find_profile`; or what it makes is no policy.
    """
    with exit_as_error():
        return checked(find_profile(profile).own_policy, RecoveryPolicy, mission)  # type: ignore[type-abstract]


def supervised(mission: Mission, ask: Ask) -> MakeProfile:
    """Make the mission's profile with a person who confirms or replaces every choice."""
    profile = mission.mission.profile
    return partial(find_profile(profile), policy=ConfirmedPolicy(make_policy(profile, mission), ask))
