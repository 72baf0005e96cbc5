"""Confirm a target when it is detected again in the same place, and keep it while it stays near there."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from behaviors.ports import Sighting

NEEDED, WINDOW = 2, 3
"""Number of frames that must agree, among this number of latest ones."""
MEMORY_S = 2.0
"""Age beyond which a detection no longer counts."""
BEARING_GATE_DEG, DISTANCE_GATE = 10.0, 1.35
"""Largest difference in bearing of agreeing detections, and largest ratio of their distances."""


class Confirmation:
    """Decides, frame by frame, whether one target is confirmed.

    The first sighting needs agreeing detections in `NEEDED` of the last `WINDOW` frames. From then on one agreeing
    detection is enough, until none has come for `MEMORY_S`: a frame or two without a detection lose nothing.

    Attributes:
        awaited: Whether the latest frame has detections, but none that is confirmed: the next frame may confirm one.
    """

    def __init__(self) -> None:
        self._recent: deque[tuple[float, Sequence[Sighting]]] = deque(maxlen=WINDOW - 1)
        self._track: tuple[float, Sighting] | None = None
        self.awaited = False

    def track(self, time_s: float) -> Sighting | None:
        """Return the last confirmed sighting, if it still counts at `time_s`."""
        if self._track is None or time_s - self._track[0] > MEMORY_S:
            return None
        return self._track[1]

    def update(self, time_s: float, seen: Sequence[Sighting]) -> Sighting | None:
        """Add the detections in the frame taken at `time_s`, best first; return the confirmed one of them, or None."""
        track = self.track(time_s)
        chosen = next((one for one in seen if track and self._agree(one, track)), None)
        if chosen is None:
            chosen = next((one for one in seen if self._votes(time_s, one) >= NEEDED), None)
        self._recent.append((time_s, seen))
        self.awaited = chosen is None and len(seen) > 0
        if chosen is not None:
            self._track = (time_s, chosen)
        return chosen

    def _votes(self, time_s: float, one: Sighting) -> int:
        """Count the frames that show it, this one included."""
        recent = (seen for then_s, seen in self._recent if time_s - then_s <= MEMORY_S)
        return 1 + sum(any(self._agree(one, other) for other in seen) for seen in recent)

    def _agree(self, one: Sighting, other: Sighting) -> bool:
        """Return whether both may be of one place; one that is cut off may be nearer than it looks."""
        if abs(one.bearing_deg - other.bearing_deg) > BEARING_GATE_DEG:
            return False
        near, far = sorted((one, other), key=lambda sighting: sighting.distance_mm)
        return far.bound or far.distance_mm <= near.distance_mm * DISTANCE_GATE
