"""Driving to a target that was seen, by where it is remembered; and noticing, from what tells first, that it fails."""

from __future__ import annotations

import math
from collections import deque

from behaviors.adaptive.doubt import Doubt, Verdict
from behaviors.adaptive.floor import SONAR_FORWARD_MM
from behaviors.adaptive.memory import Known
from behaviors.adaptive.watch import Percept, Watch
from behaviors.events import Event, Fact, Reason
from behaviors.ports import Pose, StopReason
from behaviors.skills import SHARP_DEG, sighting_values, steering_deg_s

IN_VIEW_SHARE = 0.9
"""Within this share of the reliable view and of the detector's range a target should be found."""
SLOW_MM, SLOWEST = 250.0, 0.5
"""So long before the target it slows down, to this share of its speed."""
SHUT_MM = 600.0
"""An echo from nearer than this, straight ahead, is of something that the robot would touch."""
BEFORE_MM = 250.0
"""Something is before the target when its echo is so much nearer than the picture."""
ECHOES = 2
"""So many such echoes in a row are believed."""
AHEAD_DEG = 10.0
"""A target within this bearing is straight ahead: where the sonar points."""
DECIDE_S = 5.0
"""How long it stands before a target it doubts; after that even odds will do, and after twice that it gives up."""
PROGRESS_S, PROGRESS_MM = 4.0, 120.0
"""A robot that was told to drive should be so much further on after that time."""
RECENT_S = 3.0
"""Somebody who steps in was not there so long ago."""
NEAR_MM, STRETCH_MM = 750.0, 450.0
"""Farther than the first from the target it minds what is remembered on the next stretch; nearer it trusts its eyes."""
ELBOW_MM = 20.0
"""Room beside the robot that the next stretch must leave."""
RETREAT_MM = 80.0
"""What was touched is left so far behind."""


class Approach:
    """The state arrive.

    Args:
        watch: What to work with.
        minds_map: Whether what is remembered to be in the way stops it, too.
    """

    def __init__(self, watch: Watch, *, minds_map: bool) -> None:
        self._watch = watch
        self._minds_map = minds_map
        self._begun_s = self._stepped_s = self._pictured_s = self._seen_s = watch.now()
        self._doubt = Doubt()
        self._oblique = False
        self._shut = 0
        self._open_s = watch.now()
        self._stood_s: float | None = None
        self._driven: deque[tuple[float, Pose, float]] = deque()

    def call(self) -> Fact:
        """Drive for one slice.

        Returns:
            CONTINUED with the robot driving on under its lease; ARRIVED or ARRIVE_FAILED with the robot at rest.
        """
        watch = self._watch
        end_s = watch.now() + watch.senses.profile.continue_every_s
        while watch.now() < end_s:
            fact = self._step()
            if fact is not None:
                watch.senses.body.stop()
                return fact
        return Fact(Event.CONTINUED, Reason.DRIVING_ON)

    def _step(self) -> Fact | None:
        watch = self._watch
        percept = watch.step()
        if self._blinded(percept):
            return _failed(Reason.CAMERA_LOST, percept, blind_s=percept.time_s - self._pictured_s)
        known = watch.memory.known.get(watch.target)
        if known is None:
            return _failed(Reason.TARGET_LOST, percept)
        bearing_deg, distance_mm = watch.memory.way_to(known.place)
        if not percept.blind:
            self._weigh(percept, bearing_deg, distance_mm)
        fact = self._arrived(percept) or self._hindered(percept, known, bearing_deg, distance_mm)
        if fact is not None:
            return fact
        return self._drive(percept, bearing_deg, distance_mm)

    def _blinded(self, percept: Percept) -> bool:
        """Whether the camera has given no picture for too long; what cannot be seen is not missed meanwhile."""
        since_s, self._stepped_s = self._stepped_s, percept.time_s
        if percept.blind:
            self._seen_s += percept.time_s - since_s
        else:
            self._pictured_s = percept.time_s
        return percept.time_s - self._pictured_s >= self._watch.profile.lost_after_s / 2

    def _weigh(self, percept: Percept, bearing_deg: float, distance_mm: float) -> None:
        """Shift the odds that it is the target."""
        sighting = percept.sighting
        if sighting is not None:
            self._oblique = self._watch.memory.oblique(self._watch.target, sighting)
            self._seen_s = percept.time_s
        if self._should_be_seen(bearing_deg, distance_mm):
            self._doubt.frame(hit=sighting is not None)
        elif sighting is None:
            self._seen_s = max(self._seen_s, percept.time_s - self._watch.profile.lost_after_s / 2)
            self._doubt.forget_misses()

    def _should_be_seen(self, bearing_deg: float, distance_mm: float) -> bool:
        """Whether the place of the target is well within what the camera shows and the detector finds."""
        memory = self._watch.memory
        return (
            abs(bearing_deg) <= IN_VIEW_SHARE * memory.half_view_deg
            and distance_mm <= IN_VIEW_SHARE * memory.seen_from_mm[self._watch.target]
        )

    def _arrived(self, percept: Percept) -> Fact | None:
        """Whether it is there; or whether that is not the target at all."""
        sighting = percept.sighting
        if self._doubt.verdict is Verdict.MISTAKEN:
            return self._mistaken(percept)
        if sighting is None or sighting.distance_mm > self._watch.profile.arrive_mm:
            return None
        decide = self._stood_s is not None and percept.time_s - self._stood_s >= DECIDE_S and self._doubt.odds > 0
        if decide or self._doubt.verdict is Verdict.REAL:
            evidence = {"sighting": sighting_values(sighting), "odds": self._doubt.odds}
            return Fact(Event.ARRIVED, Reason.WITHIN_REACH, evidence)
        return None

    def _mistaken(self, percept: Percept) -> Fact:
        if self._oblique:
            # so far aside the real one flickers, too; it has to be seen from elsewhere first
            return _failed(Reason.TARGET_LOST, percept, odds=self._doubt.odds, oblique=True)
        self._watch.memory.unmask(self._watch.target)
        return _failed(Reason.WRONG_TARGET, percept, odds=self._doubt.odds)

    def _hindered(self, percept: Percept, known: Known, bearing_deg: float, distance_mm: float) -> Fact | None:
        """Why it cannot go on, if so."""
        watch, now_s = self._watch, percept.time_s
        unseen_s = now_s - self._seen_s
        before = (
            percept.range_mm is not None
            and abs(bearing_deg) <= AHEAD_DEG
            and percept.range_mm <= min(SHUT_MM, distance_mm - BEFORE_MM)
        )
        self._shut = self._shut + 1 if before else 0
        if not before:
            self._open_s = now_s
        if self._shut >= ECHOES and distance_mm > watch.profile.arrive_mm:
            return self._blocked(percept, hides=unseen_s > watch.profile.lost_after_s / 2)
        if self._minds_map and distance_mm > NEAR_MM and abs(bearing_deg) <= AHEAD_DEG:
            remembered_mm = self._remembered_mm(known, distance_mm)
            if remembered_mm is not None:
                return _failed(Reason.BLOCKED_LONG, percept, hides=False, remembered=True, range_mm=remembered_mm)
        if unseen_s >= watch.profile.lost_after_s:
            behind = percept.range_mm is not None and percept.range_mm <= distance_mm - BEFORE_MM
            reason = Reason.LOST_BEHIND if behind and abs(bearing_deg) <= AHEAD_DEG else Reason.TARGET_LOST
            return _failed(reason, percept, unseen_s=unseen_s)
        if now_s - self._begun_s >= watch.profile.approach_limit_s:
            return _failed(Reason.APPROACH_TIMEOUT, percept)
        return self._stuck(percept, known)

    def _remembered_mm(self, known: Known, distance_mm: float) -> float | None:
        """How far before the sonar the next stretch is blocked as far as is remembered; None where it is free.

        Beside the beam there may be more than the sonar hears now.
        """
        memory = self._watch.memory
        share = min(1.0, STRETCH_MM / distance_mm)
        x_mm, y_mm = memory.here
        end = x_mm + share * (known.place[0] - x_mm), y_mm + share * (known.place[1] - y_mm)
        blocked_mm = memory.floor.blocked_after_mm(memory.here, end, elbow_mm=ELBOW_MM)
        return None if blocked_mm is None else max(0.0, blocked_mm - SONAR_FORWARD_MM)

    def _blocked(self, percept: Percept, *, hides: bool) -> Fact:
        """Something is before it: perhaps for short if it hides the target, since that may be a person."""
        sudden = percept.time_s - self._open_s < RECENT_S
        reason = Reason.BLOCKED_SHORT if hides else Reason.BLOCKED_LONG
        return _failed(reason, percept, hides=hides, sudden=sudden)

    def _stuck(self, percept: Percept, known: Known) -> Fact | None:
        """Whether it was told to drive and came nowhere: by its wheels, or by the picture that grows no larger."""
        pose = self._watch.memory.pose
        while self._driven and self._driven[0][0] < percept.time_s - PROGRESS_S - 0.5:
            self._driven.popleft()
        if not self._driven or self._driven[0][0] > percept.time_s - PROGRESS_S:
            return None
        _, then, then_mm = self._driven[0]
        moved_mm = math.hypot(pose.x_mm - then.x_mm, pose.y_mm - then.y_mm)
        if moved_mm < PROGRESS_MM:
            return _failed(Reason.NO_PROGRESS, percept, moved_mm=moved_mm)
        if (
            percept.sighting is not None
            and moved_mm > 3 * PROGRESS_MM
            and then_mm - known.distance_mm < PROGRESS_MM / 2
        ):
            return _failed(Reason.SLIPPED, percept, moved_mm=moved_mm)
        return None

    def _drive(self, percept: Percept, bearing_deg: float, distance_mm: float) -> Fact | None:
        """Steer to where it is; stand before what is doubtful."""
        watch, profile = self._watch, self._watch.profile
        sighting = percept.sighting
        known_mm = sighting.distance_mm if sighting else distance_mm
        if known_mm <= profile.arrive_mm:
            return self._stand(percept, bearing_deg)
        ahead = max(0.0, 1.0 - abs(bearing_deg) / SHARP_DEG)
        near = min(1.0, max(SLOWEST, (distance_mm - profile.arrive_mm) / SLOW_MM))
        speed_mm_s = profile.cruise_mm_s * ahead * near
        if ahead < 0.5:
            self._driven.clear()
        else:
            self._driven.append((percept.time_s, watch.memory.pose, known_mm))
        stop = watch.senses.body.drive(speed_mm_s, steering_deg_s(bearing_deg))
        if stop is None:
            return None
        if stop is StopReason.CONTACT:
            return self._touched(percept)
        if stop is StopReason.STALLED:
            return _failed(Reason.NO_PROGRESS, percept)
        unseen = percept.sighting is None
        return self._blocked(percept, hides=unseen and percept.time_s - self._seen_s > 0.3)

    def _touched(self, percept: Percept) -> Fact:
        """It ran into something that it neither saw nor heard: remember it, and back off."""
        watch = self._watch
        watch.memory.floor.block(watch.memory.pose, 0.0)
        watch.senses.body.straight(-RETREAT_MM)
        return _failed(Reason.BLOCKED_LONG, percept, touched=True, hides=percept.sighting is None)

    def _stand(self, percept: Percept, bearing_deg: float) -> Fact | None:
        """Near enough by now: stand and look until it is clear what this is."""
        watch = self._watch
        if abs(bearing_deg) > AHEAD_DEG:
            watch.senses.body.drive(0.0, steering_deg_s(bearing_deg))
        else:
            watch.senses.body.stop()
        self._driven.clear()
        if self._stood_s is None:
            self._stood_s = percept.time_s
        return self._mistaken(percept) if percept.time_s - self._stood_s >= 2 * DECIDE_S else None


def _failed(reason: Reason, percept: Percept, **evidence: object) -> Fact:
    return Fact(Event.ARRIVE_FAILED, reason, {"range_mm": percept.range_mm, **evidence})
