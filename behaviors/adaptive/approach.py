"""The states arrive and verify: drive to where a target was seen, and detect early when that fails."""

from __future__ import annotations

import math
from collections import deque

from behaviors.adaptive.arrival import Arrival, arrive_failed
from behaviors.adaptive.bounded_sighting import BEAM_DEG
from behaviors.adaptive.perception import BLOCKER_MM, Observation, Perception, blocker_without_echo
from behaviors.adaptive.retreat import Retreat
from behaviors.adaptive.target_memory import JUMP_MM, TargetEstimate
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Blocker, Failure, TargetFinding
from behaviors.ports import Point, Pose, StopReason
from behaviors.skills import SHARP_DEG

SLOW_MM = 250.0
"""The robot slows down over this last stretch before the target."""
SLOWEST_SHARE = 0.5
"""Share of its speed to which it slows down there."""
BLOCKED_MM = 600.0
"""A nearer echo from straight ahead comes from something that the robot would touch."""
BESIDE_MM = 380.0
"""The same while the target stays in view: an echo from farther away may as well come from something low beside the
path, which leaves the beam as the robot comes nearer."""
HIDDEN_S = 0.3
"""An obstacle that the safety stop reports hides the target if the target was not seen for longer than this."""
BEFORE_MM = 250.0
"""Something is in front of the target when its echo is this much nearer than the picture."""
BLOCKING_ECHOES = 2
"""Number of such echoes in a row that are needed."""
PROGRESS_S = 4.0
"""Time over which progress is measured."""
PROGRESS_MM = 120.0
"""A robot that is commanded to drive and gets no farther than this in `PROGRESS_S` is stuck."""
KEPT_S = 0.5
"""Poses are kept this much longer than `PROGRESS_S`, so that one of them is old enough."""
SLIPPED_MM, CLOSER_MM = 360.0, 60.0
"""The wheels slip if they have driven farther than the one in `PROGRESS_S` and the picture has come closer by less than
the other."""
STRAIGHT_SHARE = 0.5
"""Progress is not measured while it turns so sharply that it drives slower than this share of its speed."""
MAP_ENDS_MM = 750.0
"""Nearer to the target than this the camera counts, not the map."""
STRETCH_MM = 450.0
"""Farther away, the map must be free for this stretch ahead."""
CLEARANCE_MM = 20.0
"""Clearance that is needed beside that stretch: less than beside a planned path, since the target is in view."""
RETREAT_MM = 80.0
"""The robot backs off this far from what it touched."""


class ApproachSkill:
    """The states arrive, verify, and retreat after a contact.

    Args:
        perception: What to work with.
        trusts_map: Whether an obstacle on the map stops it as well.
        stands: Whether it continues in verify, where the robot stands in front of what may be the target.
    """

    def __init__(self, perception: Perception, *, trusts_map: bool, stands: bool = False) -> None:
        self._perception = perception
        self._trusts_map = trusts_map
        self._arrival = Arrival(perception, stands=stands)
        self._retreat: tuple[Retreat, Failure] | None = None
        self._begun_s = self._seen_s = perception.now()
        self._aim: Point | None = None
        self._blocked_echoes = 0
        self._driven: deque[tuple[float, Pose, float]] = deque()

    def call(self) -> Fact:
        """Drive for one slice.

        Returns:
            CONTINUED with the robot driving on under its lease; ARRIVED, MISTAKEN or ARRIVE_FAILED with the robot at
            rest.
        """
        perception = self._perception
        end_s = perception.now() + perception.context.thesis.continue_every_s
        while perception.now() < end_s:
            fact = self._step()
            if fact is not None:
                perception.context.body.stop()
                return fact
        return Fact(Event.CONTINUED, Reason.DRIVING_ON)

    def _step(self) -> Fact | None:
        if self._retreat:
            return self._back_off(*self._retreat)
        perception = self._perception
        observation = perception.step()
        known = perception.world.targets.known.get(perception.target)
        if known is None:
            return arrive_failed(Reason.TARGET_LOST, observation, finding=TargetFinding.MOVED)
        bearing_deg, distance_mm = perception.world.sight_to(known.place)
        if self._aim is not None and math.dist(self._aim, known.place) > JUMP_MM:
            self._arrival = Arrival(perception, stands=self._arrival.stands)  # it is something else from now on
        self._aim = known.place
        if observation.sighting is not None:
            self._seen_s = observation.time_s
        should_be_seen = self._arrival.weigh(observation, bearing_deg, distance_mm)
        if not should_be_seen:
            self._seen_s = max(self._seen_s, observation.time_s - perception.lost_after_s / 2)
        fact = self._arrival.check(observation, known) or self._obstructed(observation, known, bearing_deg, distance_mm)
        if fact is not None:
            return fact
        return self._drive(observation, bearing_deg, distance_mm)

    def _obstructed(
        self, observation: Observation, known: TargetEstimate, bearing_deg: float, distance_mm: float
    ) -> Fact | None:
        """Return a failure when the approach cannot continue."""
        perception, now_s = self._perception, observation.time_s
        unseen_s = now_s - self._seen_s
        hides = unseen_s > perception.lost_after_s / 2
        near_mm = min(BLOCKED_MM if hides else BESIDE_MM, distance_mm - BEFORE_MM)
        before_mm = _echo_within(near_mm, observation, bearing_deg)
        self._blocked_echoes = 0 if before_mm is None else self._blocked_echoes + 1
        if self._blocked_echoes >= BLOCKING_ECHOES and distance_mm > self._arrival.near_mm:
            return self._blocked(observation, hides=hides)
        if self._trusts_map and distance_mm > MAP_ENDS_MM and abs(bearing_deg) <= BEAM_DEG:
            remembered_mm = self._remembered_mm(known, distance_mm)
            if remembered_mm is not None:
                measured = {"range_mm": remembered_mm, "hides": False, "remembered": True}
                blocker = Blocker(remembered_mm)
                return Failure(Event.ARRIVE_FAILED, Reason.BLOCKED_LONG, measured, blocker, mapped=True)
        if unseen_s >= perception.lost_after_s:
            return self._lost(observation, bearing_deg, distance_mm, unseen_s)
        if now_s - self._begun_s >= perception.parameters.approach_limit_s:
            return arrive_failed(Reason.APPROACH_TIMEOUT, observation)
        return self._stuck(observation, known)

    def _lost(self, observation: Observation, bearing_deg: float, distance_mm: float, unseen_s: float) -> Failure:
        """Report a target out of view: something hides it, it moved, or it is seen from too far to the side here."""
        range_mm = _echo_within(distance_mm - BEFORE_MM, observation, bearing_deg)
        if range_mm is not None:
            return arrive_failed(Reason.LOST_BEHIND, observation, Blocker(range_mm, hides=True), unseen_s=unseen_s)
        turned_away = self._perception.world.targets.slant.was_oblique(self._perception.target)
        finding = None if turned_away else TargetFinding.MOVED
        return arrive_failed(Reason.TARGET_LOST, observation, finding=finding, unseen_s=unseen_s)

    def _remembered_mm(self, known: TargetEstimate, distance_mm: float) -> float | None:
        """Return how far ahead of the sonar the map blocks the next stretch; None where it is free.

        Objects beside the beam may give no echo now.
        """
        world = self._perception.world
        share = min(1.0, STRETCH_MM / distance_mm)
        x_mm, y_mm = world.here
        end = x_mm + share * (known.place[0] - x_mm), y_mm + share * (known.place[1] - y_mm)
        blocked_mm = world.floor.blocked_after_mm(world.here, end, clearance_mm=CLEARANCE_MM)
        return None if blocked_mm is None else max(0.0, blocked_mm - world.floor.sonar_forward_mm)

    def _blocked(self, observation: Observation, *, hides: bool) -> Failure:
        """Report an obstacle in front of the target; one that hides it may be a person, who leaves again."""
        reason, world = Reason.BLOCKED_SHORT if hides else Reason.BLOCKED_LONG, self._perception.world
        range_mm = BLOCKER_MM if observation.range_mm is None else observation.range_mm
        sudden = world.echoes.appeared(world.pose, range_mm)
        blocker = Blocker(range_mm, moving=sudden, hides=hides)
        return arrive_failed(reason, observation, blocker, hides=hides, sudden=sudden)

    def _stuck(self, observation: Observation, known: TargetEstimate) -> Fact | None:
        """Return a failure when it drives without progress: by its wheels, or by a picture that grows no larger."""
        pose = self._perception.world.pose
        while self._driven and self._driven[0][0] < observation.time_s - PROGRESS_S - KEPT_S:
            self._driven.popleft()
        if not self._driven or self._driven[0][0] > observation.time_s - PROGRESS_S:
            return None
        _, then, then_mm = self._driven[0]
        moved_mm = then.distance_mm_to(pose)
        if moved_mm < PROGRESS_MM:
            return arrive_failed(
                Reason.NO_PROGRESS, observation, blocker_without_echo(observation.range_mm), moved_mm=moved_mm
            )
        if observation.sighting is not None and moved_mm > SLIPPED_MM and then_mm - known.distance_mm < CLOSER_MM:
            return arrive_failed(Reason.SLIPPED, observation, moved_mm=moved_mm)
        return None

    def _drive(self, observation: Observation, bearing_deg: float, distance_mm: float) -> Fact | None:
        """Steer to the target; stop in front of a doubtful one."""
        perception = self._perception
        seen = self._arrival.seen
        known_mm = self._arrival.farthest_mm(seen, observation.time_s) if seen else distance_mm
        if known_mm <= self._arrival.stop_mm:
            return self._verify_at_rest(observation, bearing_deg)
        if self._arrival.stands:
            perception.context.report(Fact(Event.MOVED_OFF, Reason.OUT_OF_REACH, {"distance_mm": known_mm}))
        self._arrival.move_off()
        ahead = max(0.0, 1.0 - abs(bearing_deg) / SHARP_DEG)
        near = min(1.0, max(SLOWEST_SHARE, (distance_mm - self._arrival.stop_mm) / SLOW_MM))
        speed_mm_s = perception.parameters.cruise_mm_s * ahead * near
        if ahead < STRAIGHT_SHARE:
            self._driven.clear()
        else:
            self._driven.append((observation.time_s, perception.world.pose, known_mm))
        stop = perception.drive(speed_mm_s, perception.steering_deg_s(bearing_deg))
        if stop is None:
            return None
        if stop is StopReason.CONTACT:
            return self._touched(observation)
        if stop is StopReason.STALLED:
            return arrive_failed(Reason.NO_PROGRESS, observation, blocker_without_echo(observation.range_mm))
        return self._blocked(observation, hides=seen is None and observation.time_s - self._seen_s > HIDDEN_S)

    def _touched(self, observation: Observation) -> Failure:
        """Map an obstacle that was touched before a sensor detected it, and back off."""
        perception = self._perception
        perception.world.floor.mark_obstacle(perception.world.pose, 0.0)
        hides = self._arrival.seen is None
        blocker = blocker_without_echo(observation.range_mm, hides=hides)
        failure = arrive_failed(Reason.BLOCKED_LONG, observation, blocker, touched=True, hides=hides)
        self._retreat = Retreat(perception, RETREAT_MM, StopReason.CONTACT), failure
        return self._back_off(*self._retreat)

    def _back_off(self, retreat: Retreat, failure: Failure) -> Failure:
        """Complete the retreat; called again after an outage."""
        retreat.call()
        return failure

    def _verify_at_rest(self, observation: Observation, bearing_deg: float) -> Fact | None:
        """Stand near enough and look until it is clear whether this is the target."""
        perception = self._perception
        if abs(bearing_deg) > BEAM_DEG:
            perception.drive(0.0, perception.steering_deg_s(bearing_deg))
        else:
            perception.context.body.stop()
            self._arrival.rested += 1
        if not self._arrival.stands:
            self._arrival.stands = True
            measured = {"range_mm": observation.range_mm, "odds": self._arrival.odds}
            perception.context.report(Fact(Event.DOUBTED, Reason.DOUBTFUL, measured))
        self._driven.clear()
        return self._arrival.stand(observation)


def _echo_within(near_mm: float, observation: Observation, bearing_deg: float) -> float | None:
    """Return the echo if it comes from no farther than this and the target is straight ahead, else None."""
    if observation.range_mm is None or abs(bearing_deg) > BEAM_DEG:
        return None
    return observation.range_mm if observation.range_mm <= near_mm else None
