"""Confirmation: a target is believed when it is seen again in the same place, and kept while it stays near there."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from behaviors.ports import Sighting


class Confirmation:
    """Decides, frame by frame, whether one target is confirmed.

    The first sighting needs agreeing detections in `needed` of the last `window` frames. From then on one agreeing
    detection is enough, until none has come for `memory_s`: a frame or two without a detection lose nothing.

    Args:
        needed: Frames that must agree; 1 confirms every detection at once.
        window: Number of latest frames among which they are counted.
        memory_s: Age beyond which a detection no longer counts.
        bearing_gate_deg: Largest difference in bearing of agreeing detections.
        distance_gate: Largest ratio of their distances.
    """

    def __init__(
        self,
        *,
        needed: int = 2,
        window: int = 3,
        memory_s: float = 2.0,
        bearing_gate_deg: float = 10.0,
        distance_gate: float = 1.35,
    ) -> None:
        if not 1 <= needed <= window:
            raise ValueError(f"needed must lie between 1 and the window of {window}, not at {needed}")
        self._needed = needed
        self._memory_s = memory_s
        self._bearing_gate_deg = bearing_gate_deg
        self._distance_gate = distance_gate
        self._recent: deque[tuple[float, Sequence[Sighting]]] = deque(maxlen=window - 1)
        self._track: tuple[float, Sighting] | None = None

    def track(self, time_s: float) -> Sighting | None:
        """Return the last confirmed sighting, if it still counts at `time_s`."""
        if self._track is None or time_s - self._track[0] > self._memory_s:
            return None
        return self._track[1]

    def update(self, time_s: float, seen: Sequence[Sighting]) -> Sighting | None:
        """Add the detections in the frame taken at `time_s`, best first; return the confirmed one of them, or None."""
        track = self.track(time_s)
        chosen = next((one for one in seen if track and self._agree(one, track)), None)
        if chosen is None:
            chosen = next((one for one in seen if self._votes(time_s, one) >= self._needed), None)
        self._recent.append((time_s, seen))
        if chosen is not None:
            self._track = (time_s, chosen)
        return chosen

    def _votes(self, time_s: float, one: Sighting) -> int:
        """Count the frames that show it, this one included."""
        recent = (seen for then_s, seen in self._recent if time_s - then_s <= self._memory_s)
        return 1 + sum(any(self._agree(one, other) for other in seen) for seen in recent)

    def _agree(self, one: Sighting, other: Sighting) -> bool:
        """Return whether both may be of one place; one that is cut off may be nearer than it looks."""
        if abs(one.bearing_deg - other.bearing_deg) > self._bearing_gate_deg:
            return False
        near, far = sorted((one, other), key=lambda sighting: sighting.distance_mm)
        return far.bound or far.distance_mm <= near.distance_mm * self._distance_gate
