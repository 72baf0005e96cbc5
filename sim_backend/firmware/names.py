"""Patterns for listings of files and modules. Source: docs/firmware.md section 5, "File system"."""

from __future__ import annotations

from collections.abc import Callable

_EXTENSION = 3


def matcher(pattern: str) -> Callable[[str], bool]:
    """Whether names match `pattern`, ignoring case, by the firmware's own rules.

    ``*.*`` matches everything; ``name.*`` the names that begin with ``name.``; ``*.ext`` those that contain ``.ext``
    anywhere; everything else, other wildcards included, only itself.
    """
    pattern = pattern.lower()
    if "*.*" in pattern:
        return lambda _: True
    if ".*" in pattern:
        prefix = pattern[: pattern.index(".*") + 1]
        return lambda name: name.lower().startswith(prefix)
    if pattern.startswith("*."):
        part = pattern[1 : 2 + _EXTENSION]
        return lambda name: part in name.lower()
    return lambda name: name.lower() == pattern
