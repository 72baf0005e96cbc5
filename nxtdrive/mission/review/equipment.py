"""Hints at parts that work badly without an error: a weak radio, a wheel that slips, a deaf sonar, a fogged lens."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from behaviors.events import Event
from behaviors.ports import Point
from nxtdrive.mission.review.reviewed_run import Hints, ReviewedRun, Transition

if TYPE_CHECKING:
    from collections.abc import Mapping

    from nxtdrive.vision.camera import Frame
    from nxtdrive.vision.detection import Image

LOSSES = 3
"""A link that was lost this often in one mission is bad."""
SLIPPED_S = 10.0
"""A wheel that slipped for this long needs attention."""
ROUND_DEG, APART_MM = 270.0, 300.0
"""A robot that has turned this far in all, and was at places this far apart, has faced most things in a room."""
PLAIN = 10
"""Neighbouring pixels of a reduced frame, 0..255, that differ by more show an edge in focus."""
REDUCED = 80, 60
"""Size of such a frame, in which the noise of a sensor is averaged out."""
EXAMINED_S = 0.5
"""Time between two frames that are examined."""


def weak_link(run: ReviewedRun, transition: Transition) -> Hints:
    """Report a link that is lost again and again, once."""
    if transition.event == Event.LINK_LOST:
        run.link_losses += 1
        if run.link_losses == LOSSES:
            text = (
                f"The brick was out of reach {LOSSES} times. Bring robot and computer nearer to each other, or use a "
                "cable; a weak battery has the same effect."
            )
            yield "", text


def slipping_wheel(run: ReviewedRun, transition: Transition) -> Hints:
    """Report a wheel that slipped for long, once."""
    if transition.event == Event.WHEEL_GRIPS and not run.wheel_slipped:
        slipped_s, lost_share = transition.evidence.get("slipped_s", 0.0), transition.evidence.get("lost_share", 0.0)
        if slipped_s >= SLIPPED_S:
            run.wheel_slipped = True
            text = (
                f"The {transition.evidence.get('wheel')} wheel slipped for {slipped_s:.0f} s and lost about "
                f"{100 * lost_share:.0f} % of its way. Wipe its tyre and the floor, and keep cables away from it."
            )
            yield "", text


class Surroundings:
    """What a robot has faced since something began, by its poses."""

    def __init__(self) -> None:
        self._start: Point | None = None
        self._lowest_deg, self._highest_deg, self._apart_mm = math.inf, -math.inf, 0.0

    def faced(self, look: Mapping[str, Any]) -> bool:
        """Add the pose of a look; return whether the robot has faced most things in the room."""
        if (pose := look.get("pose")) is None:
            return False
        x_mm, y_mm, heading_deg = pose
        self._start = self._start or (x_mm, y_mm)
        self._apart_mm = max(self._apart_mm, math.dist(self._start, (x_mm, y_mm)))
        self._lowest_deg, self._highest_deg = min(self._lowest_deg, heading_deg), max(self._highest_deg, heading_deg)
        return self._highest_deg - self._lowest_deg >= ROUND_DEG and self._apart_mm >= APART_MM


class DeafSonar:
    """Checks at each look whether the sonar measures anything; one that fails is reported as such.

    Args:
        port: Of the sonar, 1 to 4; 0 for none.
    """

    def __init__(self, port: int) -> None:
        self._port, self._over = port, not port
        self._range_mm: float | None = None
        self._surroundings = Surroundings()

    def changed(self, sensor: Mapping[str, Any]) -> None:
        """Learn that a sensor failed or answers again."""
        self._over |= sensor.get("sensor") == "sonar" and not sensor.get("answers")

    def look(self, look: Mapping[str, Any]) -> Hints:
        """Report a sonar without echoes, or with always the same, once."""
        if self._over or "range_mm" not in look:
            return
        if look["range_mm"] != self._range_mm:
            self._range_mm, self._surroundings = look["range_mm"], Surroundings()
        if self._surroundings.faced(look):
            self._over = True
            what = "received no echo" if self._range_mm is None else f"measured {self._range_mm:.0f} mm all the time"
            text = (
                f"The sonar has {what} while the robot turned round and drove on. Unless the room is large and empty, "
                f"check its cable, and that nothing covers it; `nxtdrive sensor watch {self._port} --nxt ADDRESS` "
                "shows its echoes."
            )
            yield "", text


class FoggedLens:
    """Checks at each look whether the camera shows anything but blur."""

    def __init__(self) -> None:
        self._examined_s = -math.inf
        self._surroundings: Surroundings | None = None
        self._over = False

    def see(self, frame: Frame) -> None:
        """Examine a frame, if the last one that was is old enough."""
        if self._over or frame.time_s - self._examined_s < EXAMINED_S:
            return
        self._examined_s = frame.time_s
        if strongest_edge(frame.image) > PLAIN:
            self._surroundings = None
        elif self._surroundings is None:
            self._surroundings = Surroundings()

    def look(self, look: Mapping[str, Any]) -> Hints:
        """Report a camera whose frames show no edge wherever the robot looks, once."""
        if self._surroundings is not None and not self._over and self._surroundings.faced(look):
            self._over = True
            text = (
                "The camera shows nothing but blur wherever the robot looks. Wipe its lens, take away what covers it, "
                "focus it, or switch the light on."
            )
            yield "", text


def strongest_edge(image: Image) -> int:
    """Return how much neighbouring pixels of the reduced frame differ at most, 0..255."""
    import cv2

    reduced = cv2.resize(image[..., 1], REDUCED, interpolation=cv2.INTER_AREA)
    across, down = cv2.absdiff(reduced[:, 1:], reduced[:, :-1]), cv2.absdiff(reduced[1:], reduced[:-1])
    return int(max(across.max(), down.max()))
