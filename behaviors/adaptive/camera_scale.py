"""The error of distances by apparent size, learned from echoes and from how the target grows in the frame.

A wrong field of view makes all distances by size wrong by one factor, that of the robot; a wrong `height_mm` makes
those of its target wrong. Both are learned as one factor for each target, and a new target begins with that of
the last one. Of a target whose height is only guessed, the factor says how wrong the guess is; it begins with no more
than that, and no other target begins with it.

The source of the echo may be in front of the target or behind it. As the robot drives up to it, echo and size still
change in proportion; so the offset between them is estimated together with the factor.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

from behaviors.ports import Pose, Sighting

PRIOR_SD = 0.15
"""Standard deviation of the factor before anything was measured: a webcam's field of view by its data sheet may be
wrong by this."""
GUESS_SD = 1.0
"""The same of a target whose height is guessed."""
FLOOR_SD = 0.3
"""The same, as a share, if its lower edge is in view: it may stand on something, and the camera's height and tilt are
measured by ruler."""
TARGET_SD = 0.05
"""Targets differ by this: their heights are measured by ruler."""
LEAST_SD = 0.03
"""The factor is never known better."""
GROWTH_SD = 0.06
"""Error of the wheels' distance: diameters are measured by ruler."""
SIZE_SD = 0.02
"""Noise of one distance by size, as a share."""
ECHO_MM = 30.0
"""Noise of an echo."""
OFFSET_MM = 250.0
"""Standard deviation of the offset between the target and the source of the echo."""
GATE_SDS = 3.0
"""An echo that is more standard deviations away than this is of something else than the last one."""
AHEAD_DEG = 6.0
"""A target within this bearing is straight ahead."""
NEAREST_ECHO_MM = 250.0
"""Minimum distance by size at which a target is compared with echoes."""
FARTHEST_ECHO_MM = 1000.0
"""Maximum distance by size at which it is compared with them."""
APART_MM = 60.0
"""Echoes are compared this far apart; nearer to each other they say the same."""
LEAST_NEARER = 0.5
"""The source of an echo is straight ahead if it comes nearer by at least this share of the distance driven."""
MOST_NEARER = 1.6
"""The source is straight ahead if it comes nearer by at most this share."""
STRETCH_MM = 250.0
"""Least length of a stretch over which the growth of a picture is measured."""
LONGEST_MM = 800.0
"""Maximum length of such a stretch, since wheels slip."""
STRAIGHT_DEG = 15.0
"""The robot turns no more than this on such a stretch."""
UNCONFIRMED_SD = 0.09
"""The factor is no better known than this for a stop that no echo confirms: wheels are wrong by up to 8 %, and so is a
factor learned by driving."""
STOP_TOLERANCE = 1.1
"""A stop may be this much farther away than it should be, with a chance of about 2 %."""


@dataclass(slots=True)
class _Estimate:
    """Factor and offset of one target, with their variances and covariance; and the last measurements.

    Attributes:
        begin: Where a stretch of straight driving began, how far away the target looked there, and whether the floor
            said so.
        last_echo: Where the last echo that counts was received, and how far in front of the lens it came from.
        guessed: Whether the target's height is a guess.
        by_floor: Distance by the floor over the distance by size, where the lower edge was seen last.
    """

    factor: float
    variance: float
    offset_mm: float = 0.0
    offset_variance: float = OFFSET_MM**2
    covariance: float = 0.0
    begin: tuple[Pose, float, bool] | None = None
    last_echo: tuple[Pose, float] | None = None
    guessed: bool = False
    by_floor: float | None = None

    @property
    def share_sd(self) -> float:
        """Standard deviation as a share of the factor, which is about 1 unless the height is guessed."""
        return math.sqrt(self.variance) / self._unit

    @property
    def _unit(self) -> float:
        return self.factor if self.guessed else 1.0

    @property
    def most(self) -> float:
        """The largest factor that may be measured."""
        return max(2.0, self.factor + GATE_SDS * math.sqrt(self.variance))

    def rescale(self, by: float) -> None:
        """Multiply the factor by an exact number."""
        self.factor, self.variance, self.covariance = self.factor * by, self.variance * by**2, self.covariance * by

    def forget_offset(self) -> None:
        """Take the next echo for one of something else."""
        self.offset_mm, self.offset_variance, self.covariance = 0.0, OFFSET_MM**2, 0.0

    def update(self, by_factor: float, by_offset: float, measured: float, variance: float) -> None:
        """Update with a measurement of `by_factor` times the factor plus `by_offset` times the offset."""
        to_factor = self.variance * by_factor + self.covariance * by_offset
        to_offset = self.covariance * by_factor + self.offset_variance * by_offset
        total = by_factor * to_factor + by_offset * to_offset + variance
        surprise = measured - by_factor * self.factor - by_offset * self.offset_mm
        if abs(surprise) > GATE_SDS * math.sqrt(total):
            self.forget_offset()
            return
        self.factor += to_factor / total * surprise
        self.offset_mm += to_offset / total * surprise
        self.variance = max((LEAST_SD * self._unit) ** 2, self.variance - to_factor**2 / total)
        self.offset_variance = max(ECHO_MM**2, self.offset_variance - to_offset**2 / total)
        limit = 0.99 * math.sqrt(self.variance * self.offset_variance)
        self.covariance = min(limit, max(-limit, self.covariance - to_factor * to_offset / total))


class CameraScale:
    """The factor for each target.

    Args:
        sonar_ahead_mm: The sonar in front of the lens.
        guessed: Targets whose heights are guessed.

    Attributes:
        sonar_ahead_mm: As given.
    """

    def __init__(self, sonar_ahead_mm: float, guessed: Collection[str] = ()) -> None:
        self.sonar_ahead_mm = sonar_ahead_mm
        self._guessed = guessed
        self._estimates: dict[str, _Estimate] = {}
        self._last = _Estimate(1.0, PRIOR_SD**2)

    def corrected(self, sighting: Sighting) -> Sighting:
        """Return a sighting with the corrected distance and height."""
        factor, edges_mm = self._of(sighting.target).factor, sighting.edges_mm
        edges_mm = None if edges_mm is None else (edges_mm[0] * factor, edges_mm[1] * factor)
        return replace(sighting, distance_mm=sighting.distance_mm * factor, edges_mm=edges_mm)

    def factor(self, target: str) -> float:
        """Return the factor by which a target's distances by size have to be multiplied."""
        return self._of(target).factor

    def guessed(self, target: str) -> bool:
        """Return whether a target's height was guessed."""
        return target in self._guessed

    def unknown(self, target: str) -> bool:
        """Return whether a target's height is a guess that no measurement has confirmed or corrected yet."""
        estimate = self._of(target)
        return estimate.guessed and estimate.share_sd > PRIOR_SD

    def assured_mm(self, target: str, arrive_mm: float, *, confirmed: bool = True) -> float:
        """Return from how near a stop for a target counts: nearer than asked while the factor is uncertain.

        Args:
            target: Its name.
            arrive_mm: The distance that the mission asks for.
            confirmed: Whether an echo confirms the distance.
        """
        sd = self._of(target).share_sd
        if not confirmed:
            sd = max(sd, UNCONFIRMED_SD)
        return arrive_mm * min(1.0, STOP_TOLERANCE * math.exp(-2.0 * sd))

    def assume_on_floor(self, sighting: Sighting, floor_mm: float) -> None:
        """Assume that a target whose height is a guess stands on the floor, until it is measured.

        Its distance then remains the same share of the distance by the floor: that depends on no size, and what stands
        on something has its own share.

        Args:
            sighting: It is seen whole.
            floor_mm: Where the ray through its lower edge meets the floor, in front of the lens.
        """
        estimate = self._of(sighting.target)
        if not estimate.guessed:
            return
        by_floor = floor_mm / sighting.distance_mm
        if estimate.by_floor is not None:
            estimate.rescale(by_floor / estimate.by_floor)
        elif estimate.variance == GUESS_SD**2:
            estimate.factor, estimate.variance = by_floor, (FLOOR_SD * by_floor) ** 2
        else:
            estimate.update(1.0, 0.0, by_floor, (FLOOR_SD * by_floor) ** 2)
        estimate.by_floor = by_floor

    def learn(self, sighting: Sighting, pose: Pose, range_mm: float | None, floor_mm: float | None = None) -> None:
        """Update with a distance by size as measured; not with one of a target that is cut off.

        Args:
            sighting: It is not seen from far to the side.
            pose: Where the robot was then.
            range_mm: The echo, or None.
            floor_mm: See `assume_on_floor`; None where that is not known.
        """
        estimate = self._of(sighting.target)
        if abs(sighting.bearing_deg) > AHEAD_DEG or sighting.cut:
            estimate.begin = None
            return
        before = estimate.variance
        self._grow(estimate, pose, sighting.distance_mm, floor_mm if estimate.guessed else None)
        if range_mm is not None:
            self._add_echo(estimate, pose, sighting.distance_mm, range_mm + self.sonar_ahead_mm)
        if estimate.variance != before and not estimate.guessed:
            self._last = estimate

    def _of(self, target: str) -> _Estimate:
        if target not in self._estimates:
            guessed = target in self._guessed
            variance = GUESS_SD**2 if guessed else min(PRIOR_SD**2, self._last.variance + TARGET_SD**2)
            self._estimates[target] = _Estimate(self._last.factor, variance, guessed=guessed)
        return self._estimates[target]

    def _grow(self, estimate: _Estimate, pose: Pose, distance_mm: float, floor_mm: float | None) -> None:
        """Compare how much nearer it looks with how far the robot has driven straight.

        Where the floor says how near it looks, that counts: a box seen from above shows more of its top from nearby.
        """
        looks_mm, by_floor = (distance_mm, False) if floor_mm is None else (floor_mm, True)
        if estimate.begin is not None:
            then, then_mm, then_by_floor = estimate.begin
            driven_mm = then.distance_mm_to(pose)
            nearer_mm, by_size = then_mm - looks_mm, looks_mm / distance_mm
            turned_deg = abs(pose.heading_deg - then.heading_deg)
            if turned_deg > STRAIGHT_DEG or driven_mm > LONGEST_MM or by_floor != then_by_floor:
                estimate.begin = None
            elif driven_mm >= STRETCH_MM and nearer_mm > driven_mm * by_size / estimate.most:
                factor = driven_mm / nearer_mm * by_size
                noise = SIZE_SD * math.hypot(then_mm, looks_mm) / nearer_mm
                if noise < PRIOR_SD:
                    share = factor if estimate.guessed else 1.0  # both are shares of the factor, which else is about 1
                    estimate.update(1.0, 0.0, factor, share**2 * (GROWTH_SD**2 + noise**2))
                    estimate.begin = None
        if estimate.begin is None:
            estimate.begin = pose, looks_mm, by_floor

    def _add_echo(self, estimate: _Estimate, pose: Pose, distance_mm: float, echo_mm: float) -> None:
        at = estimate.last_echo
        by_size_mm = distance_mm * estimate.factor if estimate.guessed else distance_mm
        if not NEAREST_ECHO_MM <= by_size_mm <= FARTHEST_ECHO_MM:
            return
        driven_mm = math.inf if at is None else at[0].distance_mm_to(pose)
        if driven_mm < APART_MM:
            return
        estimate.last_echo = pose, echo_mm
        # an object straight ahead comes nearer by the distance driven; one beside the path does not
        if at is None or not LEAST_NEARER <= (at[1] - echo_mm) / driven_mm <= MOST_NEARER:
            estimate.forget_offset()
            return
        estimate.update(distance_mm, 1.0, echo_mm, ECHO_MM**2 + (SIZE_SD * distance_mm) ** 2)
