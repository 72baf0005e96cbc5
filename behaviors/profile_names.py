"""Names of profiles: the built-in ones, installed ones, and classes given as ``package.module:Class``."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points

from pydantic import ValidationInfo

THESIS, ADAPTIVE = "thesis", "adaptive"
BUILT_IN_PROFILES = (THESIS, ADAPTIVE)
GROUP = "nxtdrive.profiles"
"""Group of the entry points by which installed packages offer profiles."""
PAST = "past"
"""Context in which the mission of a past run is validated."""


def installed_profiles() -> dict[str, EntryPoint]:
    """Return the profiles that installed packages offer, by name; a built-in one keeps its name."""
    return {entry.name: entry for entry in entry_points(group=GROUP) if entry.name not in BUILT_IN_PROFILES}


def named_profiles() -> list[str]:
    """Return the names of the built-in profiles and of the installed ones."""
    return [*BUILT_IN_PROFILES, *sorted(installed_profiles())]


def offered_profile(name: str) -> str:
    """Return the name of a profile if a client may choose it: a built-in or an installed one.

    A class as ``package.module:Class`` is refused, because to load it is to run its module.

    Raises:
        ValueError: It may not; the text says which there are.
    """
    if name not in (known := named_profiles()):
        raise ValueError(f"There is no profile {name!r} here: choose {', '.join(known)}.")
    return name


def profile_name(name: str) -> str:
    """Return the name of a profile if it can be one; its class is not imported.

    Raises:
        ValueError: No profile has this name; the text says which there are.
    """
    if name in BUILT_IN_PROFILES or ":" in name or name in installed_profiles():
        return name
    known = ", ".join(named_profiles())
    raise ValueError(f"must be {known}, a class as package.module:Class, or an installed profile")


def profile_in_mission(name: str, info: ValidationInfo) -> str:
    """Return the name of a mission's profile; that of a past mission (`PAST`) may be of a package not installed here.

    Raises:
        ValueError: See `profile_name`.
    """
    return name if info.context == PAST else profile_name(name)
