"""Whether a target is seen from far aside: then it looks clearly narrower than at its widest."""

from __future__ import annotations

from behaviors.ports import Sighting

UPRIGHT = 0.7
"""Width over height of an upright print."""
NARROW = 0.72
"""A print that looks narrower than this share of it is seen from far aside, 44 degrees."""


class Slant:
    """Remembers how wide each target looks at most, and whether it was seen from far aside when it was last whole."""

    def __init__(self) -> None:
        self._widest: dict[str, float] = {}
        self._oblique: dict[str, bool] = {}

    def oblique(self, sighting: Sighting) -> bool:
        """Whether this sighting, or the last whole one, is from far aside."""
        if not sighting.cut:
            _, _, width, height = sighting.box
            aspect = width / max(1, height)
            widest = self._widest[sighting.target] = max(self._widest.get(sighting.target, UPRIGHT), aspect)
            self._oblique[sighting.target] = aspect < NARROW * widest
        return self._oblique.get(sighting.target, False)
