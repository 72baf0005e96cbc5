"""The version of nxtdrive that runs."""

from __future__ import annotations


def installed_version() -> str:
    """Return the installed version; ``0+checkout`` where it runs from a checkout without being installed."""
    from importlib.metadata import PackageNotFoundError, version  # slow to import

    try:
        return version("nxtdrive")
    except PackageNotFoundError:
        return "0+checkout"
