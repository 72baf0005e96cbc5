"""Confirms a target that is detected repeatedly in the same place, and keeps it while it stays near there."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from nxtdrive.vision.detection import Detection


@dataclass(frozen=True, slots=True)
class Seen:
    """A detection with its bearing and distance.

    Attributes:
        detection: The detection, in pixels.
        bearing_deg: Positive right.
        distance_mm: From the camera.
    """

    detection: Detection
    bearing_deg: float
    distance_mm: float


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
        self._recent: deque[tuple[float, Sequence[Seen]]] = deque(maxlen=window - 1)
        self._track: tuple[float, Seen] | None = None

    def track(self, time_s: float) -> Seen | None:
        """Return where the confirmed target was last, or None if that is too long before `time_s`."""
        if self._track is None or time_s - self._track[0] > self._memory_s:
            return None
        return self._track[1]

    def update(self, time_s: float, seen: Sequence[Seen]) -> Seen | None:
        """Add all detections of the frame taken at `time_s`, best first; return the confirmed one, or None."""
        track = self.track(time_s)
        chosen = next((one for one in seen if track and self._agree(one, track)), None)
        if chosen is None:
            chosen = next((one for one in seen if self._votes(time_s, one) >= self._needed), None)
        self._recent.append((time_s, seen))
        if chosen is not None:
            self._track = (time_s, chosen)
        return chosen

    def _votes(self, time_s: float, one: Seen) -> int:
        """Count the frames that agree with a detection, its own included."""
        recent = (seen for then_s, seen in self._recent if time_s - then_s <= self._memory_s)
        return 1 + sum(any(self._agree(one, other) for other in seen) for seen in recent)

    def _agree(self, one: Seen, other: Seen) -> bool:
        near, far = sorted((one.distance_mm, other.distance_mm))
        return abs(one.bearing_deg - other.bearing_deg) <= self._bearing_gate_deg and far <= near * self._distance_gate
