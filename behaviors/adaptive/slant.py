"""Whether a target is seen from far to the side: then it looks clearly narrower than at its widest."""

from __future__ import annotations

import math

from behaviors.ports import Sighting

UPRIGHT = 0.7
"""Width over height of an upright print."""
NARROW = 0.72
"""A print that looks narrower than this share of it is seen from far to the side, 44 degrees."""


class Slant:
    """How wide each target looks at most, and whether its last whole sighting was from far to the side."""

    def __init__(self) -> None:
        self._widest: dict[str, float] = {}
        self._oblique: dict[str, bool] = {}

    def degrees(self, sighting: Sighting) -> float | None:
        """Return the slant of a sighting in degrees, 0..90, by how narrow it looks; None if it is cut off."""
        if sighting.cut:
            return None
        widest = max(self._widest.get(sighting.target, UPRIGHT), _aspect(sighting))
        return math.degrees(math.acos(_aspect(sighting) / widest))

    def oblique(self, sighting: Sighting) -> bool:
        """Update with a sighting; return whether it, or if it is cut off the last whole one, is from the side."""
        if not sighting.cut:
            aspect = _aspect(sighting)
            widest = self._widest[sighting.target] = max(self._widest.get(sighting.target, UPRIGHT), aspect)
            self._oblique[sighting.target] = aspect < NARROW * widest
        return self.was_oblique(sighting.target)

    def was_oblique(self, target: str) -> bool:
        """Return whether the last whole sighting was from far to the side."""
        return self._oblique.get(target, False)


def _aspect(sighting: Sighting) -> float:
    """Return width over height."""
    _, _, width, height = sighting.box
    return width / max(1, height)
