"""Driving to a target that was seen, by where it is remembered; and noticing, from what tells first, that it fails."""

from __future__ import annotations

import math
from collections import deque

from behaviors.adaptive.occupancy_grid import SONAR_FORWARD_MM
from behaviors.adaptive.perception import Observation, Perception
from behaviors.adaptive.target_verifier import TargetVerifier, Verdict
from behaviors.adaptive.world_model import TargetEstimate
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


class ApproachSkill:
    """The state arrive.

    Args:
        perception: What to work with.
        minds_map: Whether what is remembered to be in the way stops it, too.
    """

    def __init__(self, perception: Perception, *, minds_map: bool) -> None:
        self._perception = perception
        self._minds_map = minds_map
        self._begun_s = self._seen_s = perception.now()
        self._verifier = TargetVerifier()
        self._oblique = False
        self._shut = 0
        self._open_s = perception.now()
        self._stood_s: float | None = None
        self._driven: deque[tuple[float, Pose, float]] = deque()

    def call(self) -> Fact:
        """Drive for one slice.

        Returns:
            CONTINUED with the robot driving on under its lease; ARRIVED or ARRIVE_FAILED with the robot at rest.
        """
        perception = self._perception
        end_s = perception.now() + perception.context.profile.continue_every_s
        while perception.now() < end_s:
            fact = self._step()
            if fact is not None:
                perception.context.body.stop()
                return fact
        return Fact(Event.CONTINUED, Reason.DRIVING_ON)

    def _step(self) -> Fact | None:
        perception = self._perception
        observation = perception.step()
        known = perception.world.known.get(perception.target)
        if known is None:
            return _failed(Reason.TARGET_LOST, observation)
        bearing_deg, distance_mm = perception.world.way_to(known.place)
        self._weigh(observation, bearing_deg, distance_mm)
        fact = self._arrived(observation) or self._hindered(observation, known, bearing_deg, distance_mm)
        if fact is not None:
            return fact
        return self._drive(observation, bearing_deg, distance_mm)

    def _weigh(self, observation: Observation, bearing_deg: float, distance_mm: float) -> None:
        """Shift the odds that it is the target."""
        sighting = observation.sighting
        if sighting is not None:
            self._oblique = self._perception.world.oblique(self._perception.target, sighting)
            self._seen_s = observation.time_s
        if self._should_be_seen(bearing_deg, distance_mm):
            self._verifier.frame(hit=sighting is not None)
        elif sighting is None:
            self._seen_s = max(self._seen_s, observation.time_s - self._perception.profile.lost_after_s / 2)
            self._verifier.forget_misses()

    def _should_be_seen(self, bearing_deg: float, distance_mm: float) -> bool:
        """Whether the place of the target is well within what the camera shows and the detector finds."""
        world = self._perception.world
        return (
            abs(bearing_deg) <= IN_VIEW_SHARE * world.half_view_deg
            and distance_mm <= IN_VIEW_SHARE * world.seen_from_mm[self._perception.target]
        )

    def _arrived(self, observation: Observation) -> Fact | None:
        """Whether it is there; or whether that is not the target at all."""
        sighting = observation.sighting
        if self._verifier.verdict is Verdict.MISTAKEN:
            return self._mistaken(observation)
        if sighting is None or sighting.distance_mm > self._perception.profile.arrive_mm:
            return None
        decide = (
            self._stood_s is not None and observation.time_s - self._stood_s >= DECIDE_S and self._verifier.odds > 0
        )
        if decide or self._verifier.verdict is Verdict.REAL:
            evidence = {"sighting": sighting_values(sighting), "odds": self._verifier.odds}
            return Fact(Event.ARRIVED, Reason.WITHIN_REACH, evidence)
        return None

    def _mistaken(self, observation: Observation) -> Fact:
        if self._oblique:
            # so far aside the real one flickers, too; it has to be seen from elsewhere first
            return _failed(Reason.TARGET_LOST, observation, odds=self._verifier.odds, oblique=True)
        self._perception.world.unmask(self._perception.target)
        return _failed(Reason.WRONG_TARGET, observation, odds=self._verifier.odds)

    def _hindered(
        self, observation: Observation, known: TargetEstimate, bearing_deg: float, distance_mm: float
    ) -> Fact | None:
        """Why it cannot go on, if so."""
        perception, now_s = self._perception, observation.time_s
        unseen_s = now_s - self._seen_s
        before = (
            observation.range_mm is not None
            and abs(bearing_deg) <= AHEAD_DEG
            and observation.range_mm <= min(SHUT_MM, distance_mm - BEFORE_MM)
        )
        self._shut = self._shut + 1 if before else 0
        if not before:
            self._open_s = now_s
        if self._shut >= ECHOES and distance_mm > perception.profile.arrive_mm:
            return self._blocked(observation, hides=unseen_s > perception.profile.lost_after_s / 2)
        if self._minds_map and distance_mm > NEAR_MM and abs(bearing_deg) <= AHEAD_DEG:
            remembered_mm = self._remembered_mm(known, distance_mm)
            if remembered_mm is not None:
                return _failed(Reason.BLOCKED_LONG, observation, hides=False, remembered=True, range_mm=remembered_mm)
        if unseen_s >= perception.profile.lost_after_s:
            behind = observation.range_mm is not None and observation.range_mm <= distance_mm - BEFORE_MM
            reason = Reason.LOST_BEHIND if behind and abs(bearing_deg) <= AHEAD_DEG else Reason.TARGET_LOST
            return _failed(reason, observation, unseen_s=unseen_s)
        if now_s - self._begun_s >= perception.profile.approach_limit_s:
            return _failed(Reason.APPROACH_TIMEOUT, observation)
        return self._stuck(observation, known)

    def _remembered_mm(self, known: TargetEstimate, distance_mm: float) -> float | None:
        """How far before the sonar the next stretch is blocked as far as is remembered; None where it is free.

        Beside the beam there may be more than the sonar hears now.
        """
        world = self._perception.world
        share = min(1.0, STRETCH_MM / distance_mm)
        x_mm, y_mm = world.here
        end = x_mm + share * (known.place[0] - x_mm), y_mm + share * (known.place[1] - y_mm)
        blocked_mm = world.floor.blocked_after_mm(world.here, end, elbow_mm=ELBOW_MM)
        return None if blocked_mm is None else max(0.0, blocked_mm - SONAR_FORWARD_MM)

    def _blocked(self, observation: Observation, *, hides: bool) -> Fact:
        """Something is before it: perhaps for short if it hides the target, since that may be a person."""
        sudden = observation.time_s - self._open_s < RECENT_S
        reason = Reason.BLOCKED_SHORT if hides else Reason.BLOCKED_LONG
        return _failed(reason, observation, hides=hides, sudden=sudden)

    def _stuck(self, observation: Observation, known: TargetEstimate) -> Fact | None:
        """Whether it was told to drive and came nowhere: by its wheels, or by the picture that grows no larger."""
        pose = self._perception.world.pose
        while self._driven and self._driven[0][0] < observation.time_s - PROGRESS_S - 0.5:
            self._driven.popleft()
        if not self._driven or self._driven[0][0] > observation.time_s - PROGRESS_S:
            return None
        _, then, then_mm = self._driven[0]
        moved_mm = math.hypot(pose.x_mm - then.x_mm, pose.y_mm - then.y_mm)
        if moved_mm < PROGRESS_MM:
            return _failed(Reason.NO_PROGRESS, observation, moved_mm=moved_mm)
        if (
            observation.sighting is not None
            and moved_mm > 3 * PROGRESS_MM
            and then_mm - known.distance_mm < PROGRESS_MM / 2
        ):
            return _failed(Reason.SLIPPED, observation, moved_mm=moved_mm)
        return None

    def _drive(self, observation: Observation, bearing_deg: float, distance_mm: float) -> Fact | None:
        """Steer to where it is; stand before what is doubtful."""
        perception, profile = self._perception, self._perception.profile
        sighting = observation.sighting
        known_mm = sighting.distance_mm if sighting else distance_mm
        if known_mm <= profile.arrive_mm:
            return self._stand(observation, bearing_deg)
        ahead = max(0.0, 1.0 - abs(bearing_deg) / SHARP_DEG)
        near = min(1.0, max(SLOWEST, (distance_mm - profile.arrive_mm) / SLOW_MM))
        speed_mm_s = profile.cruise_mm_s * ahead * near
        if ahead < 0.5:
            self._driven.clear()
        else:
            self._driven.append((observation.time_s, perception.world.pose, known_mm))
        stop = perception.context.body.drive(speed_mm_s, steering_deg_s(bearing_deg))
        if stop is None:
            return None
        if stop is StopReason.CONTACT:
            return self._touched(observation)
        if stop is StopReason.STALLED:
            return _failed(Reason.NO_PROGRESS, observation)
        unseen = observation.sighting is None
        return self._blocked(observation, hides=unseen and observation.time_s - self._seen_s > 0.3)

    def _touched(self, observation: Observation) -> Fact:
        """It ran into something that it neither saw nor heard: remember it, and back off."""
        perception = self._perception
        perception.world.floor.block(perception.world.pose, 0.0)
        perception.context.body.straight(-RETREAT_MM)
        return _failed(Reason.BLOCKED_LONG, observation, touched=True, hides=observation.sighting is None)

    def _stand(self, observation: Observation, bearing_deg: float) -> Fact | None:
        """Near enough by now: stand and look until it is clear what this is."""
        perception = self._perception
        if abs(bearing_deg) > AHEAD_DEG:
            perception.context.body.drive(0.0, steering_deg_s(bearing_deg))
        else:
            perception.context.body.stop()
        self._driven.clear()
        if self._stood_s is None:
            self._stood_s = observation.time_s
        return self._mistaken(observation) if observation.time_s - self._stood_s >= 2 * DECIDE_S else None


def _failed(reason: Reason, observation: Observation, **evidence: object) -> Fact:
    return Fact(Event.ARRIVE_FAILED, reason, {"range_mm": observation.range_mm, **evidence})
