"""Decide whether the robot has arrived at its target: by apparent size, by echoes, and by how steadily it is found."""

from __future__ import annotations

import math
from dataclasses import replace

from behaviors.adaptive.bounded_sighting import BEAM_DEG
from behaviors.adaptive.perception import Observation, Perception
from behaviors.adaptive.target_memory import TargetEstimate
from behaviors.adaptive.target_verifier import TargetVerifier, Verdict
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Blocker, Failure, TargetFinding
from behaviors.plausibility import contradicts, passes_over
from behaviors.ports import Sighting
from behaviors.skills import sighted

IN_VIEW_SHARE = 0.9
"""Within this share of the reliable view, and of the detector's range, a target should be found."""
DECIDE_S = 5.0
"""The robot stands this long in front of a doubtful target; afterwards even odds suffice, and after twice this time it
gives up."""
NEEDED_CONTRADICTIONS = 4
"""Echoes in a row that contradict the apparent distance before an arrival fails; one may be of something that passes
behind."""
SIZE_SHARE = 0.75
"""Where the echo comes from farther away, a distance by size of this share of what it should be is accepted."""
HYSTERESIS = 1.04
"""Once the robot stands, a target this many times farther away is still near enough."""
CHECKED_FRAMES = 3
"""An arrival is accepted after this many frames and measurements of the sonar at rest."""
ECHO_S = 1.0
"""Without an echo in a frame, the last one counts for this time; single echoes drop out."""


class Arrival:
    """The evidence that an approach has come to its target; with another candidate it starts over.

    Args:
        perception: What to work with.
        stands: Whether the robot stands in front of what may be the target.

    Attributes:
        stands: The same, now.
        rested: Frames in a row that were taken at rest before it.
        seen: The target in the latest frame; if it is too near to be found, the last sighting with the bearing and the
            distance of where it is remembered; else None.
    """

    def __init__(self, perception: Perception, *, stands: bool) -> None:
        self._perception = perception
        self._targets = perception.world.targets
        self.stands = stands
        self.rested = 0
        self.seen: Sighting | None = None
        self._last: Sighting | None = None
        self._stood_s: float | None = None
        self._verifier = TargetVerifier()
        self._oblique = self._too_near = self._sure = False
        self._echo: tuple[float, float] | None = None
        self._confirmed, self._low = True, False
        self._contradictions = 0

    @property
    def odds(self) -> float:
        """Log odds that it is the target."""
        return self._verifier.odds

    @property
    def near_mm(self) -> float:
        """Largest distance at which a stop counts, as far as is known; at least where the target fills the frame."""
        target, arrive_mm = self._perception.target, self._perception.parameters.arrive_mm
        fills_mm = arrive_mm if self._low else min(arrive_mm, self._targets.fills_mm(target))
        assured_mm = max(fills_mm, self._targets.scale.assured_mm(target, arrive_mm, confirmed=self._confirmed))
        return HYSTERESIS * assured_mm if self.stands else assured_mm

    @property
    def stop_mm(self) -> float:
        """Distance at which the robot stops: while the target is in doubt, where the frame shows all of it."""
        whole_mm = 0.0 if self._sure else self._targets.whole_mm(self._perception.target)
        return max(self.near_mm, HYSTERESIS * whole_mm if self.stands else whole_mm)

    def move_off(self) -> None:
        """Note that the robot drives on, and no longer stands in front of it."""
        self.stands, self.rested, self._stood_s = False, 0, None

    def weigh(self, observation: Observation, bearing_deg: float, distance_mm: float) -> bool:
        """Update with an observation; return whether the target should have been found where it is remembered."""
        self.seen = observation.sighting
        if observation.sighting is not None:
            self._oblique = self._targets.slant.oblique(observation.sighting)
            self._last = observation.sighting
        self._too_near = not self._targets.fits(self._perception.target, distance_mm)
        if self.seen is None and self._last is not None and self._too_near:
            self.seen = replace(self._last, bearing_deg=bearing_deg, distance_mm=distance_mm)
        if self._should_be_seen(bearing_deg, distance_mm):
            for hit in observation.frames:
                self._verifier.frame(hit=hit)
            return True
        if observation.sighting is None:
            self._verifier.forget_misses()
        return False

    def _should_be_seen(self, bearing_deg: float, distance_mm: float) -> bool:
        """Return whether the target's place is well within the camera's view and the detector's range."""
        return (
            abs(bearing_deg - self._perception.world.camera.yaw_deg) <= IN_VIEW_SHARE * self._targets.half_view_deg
            and distance_mm <= IN_VIEW_SHARE * self._targets.found_within_mm(self._perception.target)
            and not self._too_near
        )

    def check(self, observation: Observation, known: TargetEstimate) -> Fact | None:
        """Update with echoes; return a fact when the robot has arrived, or when this is not the target at all."""
        sighting, echo_mm = self.seen, None
        if observation.range_mm is not None:
            self._echo = (observation.time_s, observation.range_mm)
        if sighting is not None:
            echo_mm = self._echo_of(sighting, observation.time_s)
            self._confirmed, self._low = echo_mm is not None, self._passes_over(sighting)
            if not self._contradicted(sighting, echo_mm):
                self._contradictions = 0
        if self._verifier.verdict is Verdict.MISTAKEN:
            return self._mistaken(observation)
        self._sure = self._verifier.clear or self._targets.look_alikes.accepts(self._perception.target, known.place)
        if self._verifier.unclear and not self._sure:
            return self._uncertain(observation)
        if sighting is None or self.farthest_mm(sighting, observation.time_s) > self.stop_mm:
            return None
        return self._decide(observation, sighting, echo_mm)

    def _decide(self, observation: Observation, sighting: Sighting, echo_mm: float | None) -> Fact | None:
        """Return a fact about a target that is near enough; None while it is still being looked at."""
        real = self._sure and self._verifier.verdict is Verdict.REAL
        if not real and not (self._stood_for(observation, DECIDE_S) and self._verifier.odds > 0):
            return None
        if not self._sure:
            return self._uncertain(observation)
        if self.rested < CHECKED_FRAMES:
            return None
        if self._contradicted(sighting, echo_mm):
            return self._mismatch(sighting, echo_mm)
        self._targets.look_alikes.arrived(steady=self._verifier.clear)
        scale = round(self._targets.scale.factor(self._perception.target), 3)
        measured = {"range_mm": observation.range_mm, "odds": self._verifier.odds, "scale": scale}
        measured |= {"passes_over": True} if self._low else {}
        measured |= {"out_of_frame": True} if observation.sighting is None else {}
        return sighted(sighting, Event.ARRIVED, Reason.WITHIN_REACH, **measured)

    def stand(self, observation: Observation) -> Failure | None:
        """Note that the robot stands in front of it; give up after a long time, or without new evidence."""
        if self._stood_s is None:
            self._stood_s = observation.time_s
        learns_nothing = self._too_near and not self._sure and self.rested >= CHECKED_FRAMES
        gives_up = learns_nothing or self._stood_for(observation, 2 * DECIDE_S)
        return self._mistaken(observation) if gives_up else None

    def _stood_for(self, observation: Observation, time_s: float) -> bool:
        return self._stood_s is not None and observation.time_s - self._stood_s >= time_s

    def farthest_mm(self, sighting: Sighting, now_s: float) -> float:
        """Return how far away the target is at most, by its size and by the sonar.

        An echo from farther away than the target looks may be of what is behind it; but then the size says enough from
        a little nearer. So may an echo from a slanted print, which deflects most of the sound.
        """
        echo_mm = self._echo_ahead(sighting, now_s)
        if echo_mm is None or self._contradicted(sighting, echo_mm):
            return sighting.distance_mm
        echo_ahead_mm = echo_mm + self._targets.scale.sonar_ahead_mm
        return max(sighting.distance_mm, min(echo_ahead_mm, sighting.distance_mm / SIZE_SHARE))

    def _contradicted(self, sighting: Sighting, echo_mm: float | None) -> bool:
        """Return whether the sonar contradicts the target's size; once it has, an echo that agrees is needed."""
        if echo_mm is None:
            return self._perception.target in self._targets.mismatched
        return contradicts(echo_mm, sighting.distance_mm, self._perception.parameters.sonar_tolerance_mm)

    def _echo_of(self, sighting: Sighting, now_s: float) -> float | None:
        """Return the echo that comes from the target; None if no echo can be attributed to it."""
        # a slanted print reflects hardly any sound back
        return None if self._oblique else self._echo_ahead(sighting, now_s)

    def _echo_ahead(self, sighting: Sighting, now_s: float) -> float | None:
        """Return the last echo, if there is one and the target is within the sonar's beam, not below it."""
        if self._echo is None or now_s - self._echo[0] > ECHO_S or abs(sighting.bearing_deg) > BEAM_DEG:
            return None
        behind = self._passes_over(sighting) or self._targets.beyond(sighting, self._echo[1])
        return None if behind else self._echo[1]

    def _passes_over(self, sighting: Sighting) -> bool:
        world = self._perception.world
        echo_ahead_mm = self._targets.scale.sonar_ahead_mm + (self._echo[1] if self._echo else -math.inf)
        lens_mm, sonar_mm = world.camera.height_mm, world.floor.sonar_height_mm
        return passes_over(echo_ahead_mm, sighting.distance_mm, sighting.edges_mm, lens_mm, sonar_mm)

    def _mismatch(self, sighting: Sighting, echo_mm: float | None) -> Failure | None:
        """Measure again at rest before the arrival fails: the object there has another size than the target."""
        self._contradictions += 1
        if self._contradictions < NEEDED_CONTRADICTIONS:
            return None
        measured = {"distance_mm": round(sighting.distance_mm, 1), "range_mm": echo_mm}
        return Failure(Event.MISTAKEN, Reason.RANGE_MISMATCH, measured, finding=TargetFinding.LOOK_ALIKE)

    def _mistaken(self, observation: Observation) -> Failure:
        """Report a look-alike."""
        return self._not_it(observation, Reason.WRONG_TARGET, TargetFinding.LOOK_ALIKE)

    def _uncertain(self, observation: Observation) -> Failure:
        """Report what may be the target in poor light or a look-alike; a better one is looked for first."""
        return self._not_it(observation, Reason.UNCERTAIN, TargetFinding.UNCERTAIN, clarity=self._verifier.clarity)

    def _not_it(self, observation: Observation, reason: Reason, finding: TargetFinding, **measured: object) -> Failure:
        if self._oblique or self._too_near:
            # seen obliquely or in part, the real one flickers too; it has to be seen from elsewhere first
            odds, oblique, too_near = self._verifier.odds, self._oblique, self._too_near
            return arrive_failed(Reason.TARGET_LOST, observation, odds=odds, oblique=oblique, too_near=too_near)
        measured = {"range_mm": observation.range_mm, "odds": self._verifier.odds, **measured}
        return Failure(Event.MISTAKEN, reason, measured, finding=finding)


def arrive_failed(
    reason: Reason,
    observation: Observation,
    blocker: Blocker | None = None,
    finding: TargetFinding | None = None,
    **measured: object,
) -> Failure:
    """Return the failure of an approach, with what was measured."""
    measured = {"range_mm": observation.range_mm, **measured}
    return Failure(Event.ARRIVE_FAILED, reason, measured, blocker, finding=finding)
