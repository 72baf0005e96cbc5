"""The states arrive and verify: drives to where a target was seen, and notices early when that fails."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from behaviors.adaptive.perception import N as PERCEPTION
from behaviors.adaptive.perception import Observation, Perception, unheard_blocker
from behaviors.adaptive.retreat import Retreat
from behaviors.adaptive.target_verifier import TargetVerifier, Verdict
from behaviors.adaptive.world_model import N as WORLD
from behaviors.adaptive.world_model import TargetEstimate
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Blocker, Failure, TargetFinding
from behaviors.plausibility import contradicts, passes_over
from behaviors.ports import Point, Pose, Sighting, StopReason
from behaviors.skills import N as SKILLS
from behaviors.skills import sighted


@dataclass(frozen=True, slots=True)
class ApproachNumbers:
    """The numbers of an approach.

    Attributes:
        in_view_share: Within this share of the reliable view, and of the detector's range, a target should be found.
        slow_mm: The robot slows down over this last stretch before the target.
        slowest: Down to this share of its speed.
        blocked_mm: An echo from nearer, straight ahead, is of something that the robot would touch.
        beside_mm: While the target stays in view only one from nearer than this: from farther away it is as likely of
            something low beside the path, which leaves the beam as the robot comes nearer.
        before_mm: Something is before the target when its echo is this much nearer than the picture.
        echoes: Such echoes in a row that are believed.
        ahead_deg: A target within this bearing is straight ahead, where the sonar points.
        decide_s: The robot stands this long before a doubtful target; afterwards even odds will do, and after twice
            this time it gives up.
        progress_s: A robot that was told to drive should get farther by `progress_mm` in this time.
        progress_mm: See `progress_s`.
        map_ends_mm: Nearer to the target than this the robot trusts its eyes, not the map.
        stretch_mm: Farther away, the map must be free for this stretch ahead.
        clearance_mm: Room that must be free beside that stretch: less than beside a planned path, since the target is
            in view.
        retreat_mm: The robot backs off this far from what it touched.
        contradictions: Echoes in a row that contradict the apparent distance before an arrival fails; one may be of
            something that passes behind.
        size_share: Where the sonar hears something farther away, a distance by size of this share of what it should be
            is believed.
        hysteresis: Once the robot stands, a target this many times farther away is still near enough.
        checks: An arrival is believed after this many frames at rest, each with an echo.
        echo_s: Without an echo in a frame, the last one counts for this time; single echoes drop out.
    """

    in_view_share: float = 0.9
    slow_mm: float = 250.0
    slowest: float = 0.5
    blocked_mm: float = 600.0
    beside_mm: float = 380.0
    before_mm: float = 250.0
    echoes: int = 2
    ahead_deg: float = 10.0
    decide_s: float = 5.0
    progress_s: float = 4.0
    progress_mm: float = 120.0
    map_ends_mm: float = 750.0
    stretch_mm: float = 450.0
    clearance_mm: float = 20.0
    retreat_mm: float = 80.0
    contradictions: int = 4
    size_share: float = 0.75
    checks: int = 3
    hysteresis: float = 1.04
    echo_s: float = 1.0


N = ApproachNumbers()


class ApproachSkill:
    """The states arrive, verify, and retreat after a contact.

    Args:
        perception: What to work with.
        trusts_map: Whether an obstacle on the map stops it, too.
        stands: Whether it goes on in verify, where the robot stands before what may be the target.
    """

    def __init__(self, perception: Perception, *, trusts_map: bool, stands: bool = False) -> None:
        self._perception = perception
        self._trusts_map = trusts_map
        self._stands = stands
        self._retreat: tuple[Retreat, Failure] | None = None
        self._begun_s = self._seen_s = perception.now()
        self._verifier = TargetVerifier()
        self._aim: Point | None = None
        self._oblique = False
        self._blocked_echoes = 0
        self._echo: tuple[float, float] | None = None
        self._heard, self._low = True, False
        self._contradictions = 0
        self._stood_s: float | None = None
        self._rested = 0
        self._driven: deque[tuple[float, Pose, float]] = deque()

    @property
    def _arrive_mm(self) -> float:
        """From how near a stop counts as far as the camera is known, or from where the target leaves the frame."""
        target, arrive_mm = self._perception.target, self._perception.profile.arrive_mm
        world = self._perception.world
        fills_mm = arrive_mm if self._low else min(arrive_mm, world.scale.factor(target) * world.fills_mm[target])
        assured_mm = max(fills_mm, world.scale.assured_mm(target, arrive_mm, heard=self._heard))
        return N.hysteresis * assured_mm if self._stands else assured_mm

    def call(self) -> Fact:
        """Drive for one slice.

        Returns:
            CONTINUED with the robot driving on under its lease; ARRIVED, MISTAKEN or ARRIVE_FAILED with the robot at
            rest.
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
        if self._retreat:
            return self._back_off(*self._retreat)
        perception = self._perception
        observation = perception.step()
        known = perception.world.known.get(perception.target)
        if known is None:
            return _failed(Reason.TARGET_LOST, observation, finding=TargetFinding.MOVED)
        bearing_deg, distance_mm = perception.world.sight_to(known.place)
        if self._aim is not None and math.dist(self._aim, known.place) > WORLD.jump_mm:
            self._verifier = TargetVerifier()  # it is something else from now on
        self._aim = known.place
        self._weigh(observation, bearing_deg, distance_mm)
        fact = self._arrived(observation, known) or self._hindered(observation, known, bearing_deg, distance_mm)
        if fact is not None:
            return fact
        return self._drive(observation, bearing_deg, distance_mm)

    def _weigh(self, observation: Observation, bearing_deg: float, distance_mm: float) -> None:
        """Update the odds that it is the target."""
        sighting = observation.sighting
        if sighting is not None:
            self._oblique = self._perception.world.slant.oblique(sighting)
            self._seen_s = observation.time_s
        if self._should_be_seen(bearing_deg, distance_mm):
            for hit in observation.frames:
                self._verifier.frame(hit=hit)
        elif sighting is None:
            self._seen_s = max(self._seen_s, observation.time_s - self._perception.lost_after_s / 2)
            self._verifier.forget_misses()

    def _should_be_seen(self, bearing_deg: float, distance_mm: float) -> bool:
        """Whether the target's place is well within the camera's view and the detector's range."""
        world = self._perception.world
        return (
            abs(bearing_deg - world.camera.yaw_deg) <= N.in_view_share * world.half_view_deg
            and distance_mm <= N.in_view_share * world.detection_range_mm[self._perception.target]
        )

    def _arrived(self, observation: Observation, known: TargetEstimate) -> Fact | None:
        """Return a fact when it has arrived, or when this is not the target at all."""
        sighting = observation.sighting
        if observation.range_mm is not None:
            self._echo = (observation.time_s, observation.range_mm)
        if sighting is not None:
            echo_mm = self._echo_of(sighting, observation.time_s)
            self._heard, self._low = echo_mm is not None, self._passes_over(sighting)
        if self._verifier.verdict is Verdict.MISTAKEN:
            return self._mistaken(observation)
        sure = self._verifier.clear or self._perception.world.look_alikes.compared(self._perception.target, known.place)
        if self._verifier.unclear and not sure:
            return self._uncertain(observation)
        if sighting is None or self._farthest_mm(sighting, observation.time_s) > self._arrive_mm:
            return None
        decide = (
            self._stood_s is not None and observation.time_s - self._stood_s >= N.decide_s and self._verifier.odds > 0
        )
        if not decide and not (sure and self._verifier.verdict is Verdict.REAL):
            return None
        if not sure:
            return self._uncertain(observation)
        if self._rested < N.checks:
            return None
        if self._contradicted(sighting, echo_mm):
            return self._mismatch(sighting, echo_mm)
        self._perception.world.look_alikes.arrived(steady=self._verifier.clear)
        scale = round(self._perception.world.scale.factor(self._perception.target), 3)
        measured = {"range_mm": observation.range_mm, "odds": self._verifier.odds, "scale": scale}
        measured |= {"passes_over": True} if self._low else {}
        return sighted(sighting, Event.ARRIVED, Reason.WITHIN_REACH, **measured)

    def _contradicted(self, sighting: Sighting, echo_mm: float | None) -> bool:
        """Whether the sonar contradicts the target's size; after it once did, an echo that agrees is needed."""
        if echo_mm is None:
            return self._perception.target in self._perception.world.mismatched
        return contradicts(echo_mm, sighting.distance_mm, self._perception.profile.sonar_tolerance_mm)

    def _farthest_mm(self, sighting: Sighting, now_s: float) -> float:
        """Return how far away the target is at most, by its size and by the sonar.

        An echo from farther away than the target looks may be of what is behind it; but then the size says enough from
        a little nearer. So may an echo from a slanted print, which throws most of the sound aside.
        """
        echo_mm = self._echo_ahead(sighting, now_s)
        if echo_mm is None or self._contradicted(sighting, echo_mm):
            return sighting.distance_mm
        heard_mm = echo_mm + self._perception.world.scale.sonar_ahead_mm
        return max(sighting.distance_mm, min(heard_mm, sighting.distance_mm / N.size_share))

    def _echo_of(self, sighting: Sighting, now_s: float) -> float | None:
        """Return the echo from where the target is seen; None if the sonar has nothing to say about that."""
        # a slanted print throws hardly any echo back
        return None if self._oblique else self._echo_ahead(sighting, now_s)

    def _echo_ahead(self, sighting: Sighting, now_s: float) -> float | None:
        """Return the last echo, if there is one and the target is within the sonar's beam, not below it."""
        if self._echo is None or now_s - self._echo[0] > N.echo_s or abs(sighting.bearing_deg) > N.ahead_deg:
            return None
        return None if self._passes_over(sighting) else self._echo[1]

    def _passes_over(self, sighting: Sighting) -> bool:
        world = self._perception.world
        heard_mm = world.scale.sonar_ahead_mm + (self._echo[1] if self._echo else -math.inf)
        lens_mm, sonar_mm = world.camera.height_mm, world.floor.sonar_height_mm
        return passes_over(heard_mm, sighting.distance_mm, sighting.edges_mm, lens_mm, sonar_mm)

    def _mismatch(self, sighting: Sighting, echo_mm: float | None) -> Failure | None:
        """Stand and listen again before the arrival fails: what is there has another size than the target."""
        self._contradictions += 1
        if self._contradictions < N.contradictions:
            return None
        measured = {"distance_mm": round(sighting.distance_mm, 1), "range_mm": echo_mm}
        return Failure(Event.MISTAKEN, Reason.RANGE_MISMATCH, measured, finding=TargetFinding.LOOK_ALIKE)

    def _mistaken(self, observation: Observation) -> Failure:
        if self._oblique:
            # from far aside the real one flickers, too; it has to be seen from elsewhere first
            return _failed(Reason.TARGET_LOST, observation, odds=self._verifier.odds, oblique=True)
        measured = {"range_mm": observation.range_mm, "odds": self._verifier.odds}
        return Failure(Event.MISTAKEN, Reason.WRONG_TARGET, measured, finding=TargetFinding.LOOK_ALIKE)

    def _uncertain(self, observation: Observation) -> Failure:
        """It may be the target in poor light, or a look-alike: look for a better one first."""
        if self._oblique:
            return _failed(Reason.TARGET_LOST, observation, odds=self._verifier.odds, oblique=True)
        measured = {"range_mm": observation.range_mm, "odds": self._verifier.odds, "clarity": self._verifier.clarity}
        return Failure(Event.MISTAKEN, Reason.UNCERTAIN, measured, finding=TargetFinding.UNCERTAIN)

    def _hindered(
        self, observation: Observation, known: TargetEstimate, bearing_deg: float, distance_mm: float
    ) -> Fact | None:
        """Return a failure when it cannot go on."""
        perception, now_s = self._perception, observation.time_s
        unseen_s = now_s - self._seen_s
        hides = unseen_s > perception.lost_after_s / 2
        before = (
            observation.range_mm is not None
            and abs(bearing_deg) <= N.ahead_deg
            and observation.range_mm <= min(N.blocked_mm if hides else N.beside_mm, distance_mm - N.before_mm)
        )
        self._blocked_echoes = self._blocked_echoes + 1 if before else 0
        if self._blocked_echoes >= N.echoes and distance_mm > self._arrive_mm:
            return self._blocked(observation, hides=hides)
        if self._trusts_map and distance_mm > N.map_ends_mm and abs(bearing_deg) <= N.ahead_deg:
            remembered_mm = self._remembered_mm(known, distance_mm)
            if remembered_mm is not None:
                measured = {"range_mm": remembered_mm, "hides": False, "remembered": True}
                blocker = Blocker(remembered_mm)
                return Failure(Event.ARRIVE_FAILED, Reason.BLOCKED_LONG, measured, blocker, mapped=True)
        if unseen_s >= perception.lost_after_s:
            return self._lost(observation, bearing_deg, distance_mm, unseen_s)
        if now_s - self._begun_s >= perception.profile.approach_limit_s:
            return _failed(Reason.APPROACH_TIMEOUT, observation)
        return self._stuck(observation, known)

    def _lost(self, observation: Observation, bearing_deg: float, distance_mm: float, unseen_s: float) -> Failure:
        """The target went out of view: something stepped in between, or it moved."""
        range_mm = observation.range_mm
        if range_mm is not None and range_mm <= distance_mm - N.before_mm and abs(bearing_deg) <= N.ahead_deg:
            return _failed(Reason.LOST_BEHIND, observation, Blocker(range_mm, hides=True), unseen_s=unseen_s)
        return _failed(Reason.TARGET_LOST, observation, finding=TargetFinding.MOVED, unseen_s=unseen_s)

    def _remembered_mm(self, known: TargetEstimate, distance_mm: float) -> float | None:
        """Return how far ahead of the sonar the map blocks the next stretch; None where it is free.

        There may be more beside the beam than the sonar hears now.
        """
        world = self._perception.world
        share = min(1.0, N.stretch_mm / distance_mm)
        x_mm, y_mm = world.here
        end = x_mm + share * (known.place[0] - x_mm), y_mm + share * (known.place[1] - y_mm)
        blocked_mm = world.floor.blocked_after_mm(world.here, end, clearance_mm=N.clearance_mm)
        return None if blocked_mm is None else max(0.0, blocked_mm - world.floor.sonar_forward_mm)

    def _blocked(self, observation: Observation, *, hides: bool) -> Failure:
        """Something is before the target: perhaps for a short time if it hides it, since that may be a person."""
        reason, world = Reason.BLOCKED_SHORT if hides else Reason.BLOCKED_LONG, self._perception.world
        range_mm = PERCEPTION.unheard_mm if observation.range_mm is None else observation.range_mm
        sudden = world.echoes.was_free(world.pose, range_mm)
        blocker = Blocker(range_mm, moving=sudden, hides=hides)
        return _failed(reason, observation, blocker, hides=hides, sudden=sudden)

    def _stuck(self, observation: Observation, known: TargetEstimate) -> Fact | None:
        """Return a failure when it drives without progress: by its wheels, or by a picture that grows no larger."""
        pose = self._perception.world.pose
        while self._driven and self._driven[0][0] < observation.time_s - N.progress_s - 0.5:
            self._driven.popleft()
        if not self._driven or self._driven[0][0] > observation.time_s - N.progress_s:
            return None
        _, then, then_mm = self._driven[0]
        moved_mm = math.hypot(pose.x_mm - then.x_mm, pose.y_mm - then.y_mm)
        if moved_mm < N.progress_mm:
            return _failed(Reason.NO_PROGRESS, observation, unheard_blocker(observation.range_mm), moved_mm=moved_mm)
        if (
            observation.sighting is not None
            and moved_mm > 3 * N.progress_mm
            and then_mm - known.distance_mm < N.progress_mm / 2
        ):
            return _failed(Reason.SLIPPED, observation, moved_mm=moved_mm)
        return None

    def _drive(self, observation: Observation, bearing_deg: float, distance_mm: float) -> Fact | None:
        """Steer to the target; stand before what is doubtful."""
        perception, profile = self._perception, self._perception.profile
        seen = observation.sighting
        known_mm = self._farthest_mm(seen, observation.time_s) if seen else distance_mm
        if known_mm <= self._arrive_mm:
            return self._stand(observation, bearing_deg)
        self._rested = 0
        if self._stands:
            self._stands = False
            perception.context.report(Fact(Event.MOVED_OFF, Reason.OUT_OF_REACH, {"distance_mm": known_mm}))
        ahead = max(0.0, 1.0 - abs(bearing_deg) / SKILLS.sharp_deg)
        near = min(1.0, max(N.slowest, (distance_mm - self._arrive_mm) / N.slow_mm))
        speed_mm_s = profile.cruise_mm_s * ahead * near
        if ahead < 0.5:
            self._driven.clear()
        else:
            self._driven.append((observation.time_s, perception.world.pose, known_mm))
        stop = perception.drive(speed_mm_s, perception.steering_deg_s(bearing_deg))
        if stop is None:
            return None
        if stop is StopReason.CONTACT:
            return self._touched(observation)
        if stop is StopReason.STALLED:
            return _failed(Reason.NO_PROGRESS, observation, unheard_blocker(observation.range_mm))
        return self._blocked(observation, hides=seen is None and observation.time_s - self._seen_s > 0.3)

    def _touched(self, observation: Observation) -> Failure:
        """It ran into something that it neither saw nor heard: map it, and back off."""
        perception = self._perception
        perception.world.floor.block(perception.world.pose, 0.0)
        hides = observation.sighting is None
        blocker = unheard_blocker(observation.range_mm, hides=hides)
        failure = _failed(Reason.BLOCKED_LONG, observation, blocker, touched=True, hides=hides)
        self._retreat = Retreat(perception, N.retreat_mm, StopReason.CONTACT), failure
        return self._back_off(*self._retreat)

    def _back_off(self, retreat: Retreat, failure: Failure) -> Failure:
        """Complete the retreat; called again after an outage."""
        retreat.call()
        return failure

    def _stand(self, observation: Observation, bearing_deg: float) -> Fact | None:
        """Near enough: stand and look until it is clear what this is."""
        perception = self._perception
        if abs(bearing_deg) > N.ahead_deg:
            perception.drive(0.0, perception.steering_deg_s(bearing_deg))
        else:
            perception.context.body.stop()
            self._rested += 1
        if not self._stands:
            self._stands = True
            measured = {"range_mm": observation.range_mm, "odds": self._verifier.odds}
            perception.context.report(Fact(Event.DOUBTED, Reason.DOUBTFUL, measured))
        self._driven.clear()
        if self._stood_s is None:
            self._stood_s = observation.time_s
        return self._mistaken(observation) if observation.time_s - self._stood_s >= 2 * N.decide_s else None


def _failed(
    reason: Reason,
    observation: Observation,
    blocker: Blocker | None = None,
    finding: TargetFinding | None = None,
    **measured: object,
) -> Failure:
    measured = {"range_mm": observation.range_mm, **measured}
    return Failure(Event.ARRIVE_FAILED, reason, measured, blocker, finding=finding)
