"""Names of detectors: the built-in ones, and those that installed packages offer."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points

BUILT_IN_DETECTORS = ("picture", "haar", "marker", "qr", "color", "onnx")
GROUP = "nxtdrive.detectors"
"""Group of the entry points by which installed packages offer detectors."""


def installed_detectors() -> dict[str, EntryPoint]:
    """Return the detectors that installed packages offer, by name; a built-in one keeps its name."""
    return {entry.name: entry for entry in entry_points(group=GROUP) if entry.name not in BUILT_IN_DETECTORS}


def detector_names() -> list[str]:
    """Return the names of all detectors, the built-in ones first."""
    return [*BUILT_IN_DETECTORS, *sorted(installed_detectors())]
