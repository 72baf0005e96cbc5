"""Memory of the targets: where they were seen, where they may be, and which objects are look-alikes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from behaviors.adaptive.belief import Belief, likely_places
from behaviors.adaptive.bounded_sighting import estimated, limit_distance, limit_to_echo
from behaviors.adaptive.camera_scale import CameraScale
from behaviors.adaptive.frame_fit import FrameFit
from behaviors.adaptive.look_alikes import LookAlikes
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.adaptive.slant import Slant
from behaviors.adaptive.turn_scale import corrected
from behaviors.failures import TargetFinding
from behaviors.mission import Mission
from behaviors.ports import Cut, Edges, Glimpse, Point, Pose, Sighting
from behaviors.pose_history import PoseHistory

RANGE_HEIGHTS = {"picture": 17.0, "haar": 7.0, "marker": 10.0, "qr": 6.0, "color": 17.0, "onnx": 12.0}
OTHER_RANGE_HEIGHTS = 12.0
"""A detector finds its target up to this many times the target's height away. Source: docs/ranges.md section 1.2."""

FARTHEST_MM = 4500.0
"""No detector finds a target from farther away, at 320 x 240 pixels. Source: docs/ranges.md section 1.2, from the
front."""
HALF_VIEW_SHARE = 0.42
"""A target nearer to the frame's edge than this share of the field of view is partly outside."""
SHOWN_SHARE = 0.85
"""A target of which the frame shows a smaller share of its height may be missed."""
DECAY_EVERY_S = 5.0
"""Beliefs age in steps of this time."""
NEW_LOOK_S = 1.0
"""A sighting this long after the last one is new evidence, not the same look again."""
SIGHTING_WEIGHT = 0.4
"""Weight of a new sighting in the estimate of a target's place and of its edges, 0..1."""
HELD_CHANCE = 0.25
"""A remembered place is kept as long as the belief in it is stronger."""
JUMP_MM = 500.0
"""A sighting farther than this from the last one is of something that moved, or of something else."""
JUMP_SHARE = 0.3
"""For sightings within `NEW_LOOK_S`, this share of the distance replaces `JUMP_MM` if it is more."""
STEP_DEG = 6.0
STEP_MM = 120.0
"""Looks update the belief together if their headings and their places differ by less than these."""
INSIDE_MM = 200.0
"""A place where a target is seen is at least this far from the map's edge."""
FLOOR_DEG = 4.0
"""Where a lower edge is seen less far below level than this, it does not say how far away the floor is."""
BEYOND_RATIO = 1.25
"""An echo from this many times farther away than the floor at a target's lower edge is not the target's."""
NEW_MM = 500.0
"""An object that hides a target from a place also hides it from this far beside it, with probability 1/e."""


@dataclass(slots=True)
class TargetEstimate:
    """A target that was seen.

    Attributes:
        place: Where it is estimated to be.
        time_s: When it was seen last.
        distance_mm: Its distance then, by its apparent size.
        seen_from: Where the robot was then.
        edges_mm: Its edges; None if no frame has shown both.
    """

    place: Point
    time_s: float
    distance_mm: float
    seen_from: Pose
    edges_mm: Edges | None = None


@dataclass(slots=True)
class _Unseen:
    """Looks without a sighting that have not updated the belief yet."""

    pose: Pose
    frames: int


class TargetMemory:
    """What is known of the targets in one mission.

    Args:
        mission: The targets and the camera.
        floor: The map of the floor, which hides targets and is free where they are seen.
        poses: Recent poses.

    Attributes:
        known: The targets that were seen, by name, until there is a reason to forget them.
        beliefs: Where each target may be, by name.
        look_alikes: What is not taken for a target.
        scale: How wrong distances by apparent size are.
        slant: Which targets are seen from far to the side.
        mismatched: Targets at which an arrival failed because the sonar contradicted their size; from then on an
            arrival there needs an echo that agrees.
        half_view_deg: Half the angle of view in which a target is wholly in the frame.
        detection_range_mm: How far away each target's detector finds it in good light, by name.
    """

    def __init__(self, mission: Mission, floor: OccupancyGrid, poses: PoseHistory) -> None:
        self._floor, self._poses, self._camera = floor, poses, mission.camera
        self.look_alikes = LookAlikes()
        self.scale = CameraScale(mission.sonar_ahead_mm, mission.guessed_heights)
        self.slant = Slant()
        self.known: dict[str, TargetEstimate] = {}
        self.mismatched: set[str] = set()
        self.half_view_deg = mission.camera.hfov_deg * HALF_VIEW_SHARE
        self.detection_range_mm = {
            name: min(FARTHEST_MM, target.height_mm * RANGE_HEIGHTS.get(target.detector, OTHER_RANGE_HEIGHTS))
            for name, target in mission.target.items()
        }
        self._fit = FrameFit(mission.camera)
        self._heights_mm = {name: target.height_mm for name, target in mission.target.items()}
        likely = likely_places(floor)
        self.beliefs = {
            name: Belief(self.detection_range_mm[name], self.half_view_deg, likely) for name in mission.mission.targets
        }
        self._unseen: dict[str, _Unseen] = {}
        self._decayed_s: float | None = None
        self._looked_from: dict[str, list[Point]] = {}

    def decay(self, now_s: float) -> None:
        """Let the beliefs age."""
        if self._decayed_s is None:
            self._decayed_s = now_s
        elif now_s - self._decayed_s >= DECAY_EVERY_S:
            for belief in self.beliefs.values():
                belief.decay(now_s - self._decayed_s)
            self._decayed_s = now_s

    def look(self, looked_for: Sequence[str], glimpse: Glimpse, range_mm: float | None) -> Mapping[str, Sighting]:
        """Update with a frame.

        Args:
            looked_for: Targets that were looked for in it.
            glimpse: What it showed.
            range_mm: The sonar's echo, or None.

        Returns:
            The sightings that are not of a known look-alike.
        """
        seen = {name: self._estimated(sighting, range_mm) for name, sighting in glimpse.seen.items()}
        accepted = {name: sighting for name, sighting in seen.items() if self._is_accepted(sighting)}
        for target in looked_for:
            if target in accepted:
                self._see(target, accepted[target])
                if not self.slant.oblique(accepted[target]):
                    sighting = glimpse.seen[target]
                    own_mm = None if self.beyond(sighting, range_mm) else range_mm
                    floor_mm = self._floor_mm(sighting)
                    self.scale.learn(sighting, self._poses.at(glimpse.time_s), own_mm, floor_mm)
            else:
                view = self._camera.view_at(self._poses.at(glimpse.time_s))
                if not self._too_near(target, view):
                    self._miss(target, view)
        return accepted

    def beyond(self, sighting: Sighting, range_mm: float | None) -> bool:
        """Return whether an echo is from behind a target of which only the frame shows how far away it is at most."""
        floor_mm = self._floor_mm(sighting)
        if range_mm is None or floor_mm is None or not self.scale.guessed(sighting.target):
            return False
        return range_mm + self.scale.sonar_ahead_mm > BEYOND_RATIO * floor_mm

    def found_within_mm(self, target: str) -> float:
        """Return how far away a target's detector finds it; one that is larger than guessed, from farther."""
        factor = self.scale.factor(target) if self.scale.guessed(target) else 1.0
        return self.detection_range_mm[target] * max(1.0, factor)

    def fills_mm(self, target: str) -> float:
        """Return the distance at which a target fills the frame, by its estimated size."""
        half_mm = self.scale.factor(target) * self._heights_mm[target] / 2
        return self._fit.fills_mm(self._edges_mm(target) or (-half_mm, half_mm))

    def whole_mm(self, target: str) -> float:
        """Return from how far the frame shows a target whole; 0 if its edges are not known."""
        edges_mm = self._edges_mm(target)
        return 0.0 if edges_mm is None else self._fit.fills_mm(edges_mm)

    def fits(self, target: str, distance_mm: float) -> bool:
        """Return whether the frame shows so much of a target at this distance that it should be found."""
        edges_mm = self._edges_mm(target)
        return edges_mm is None or self._fit.shown(edges_mm, distance_mm) >= SHOWN_SHARE

    def _edges_mm(self, target: str) -> Edges | None:
        known = self.known.get(target)
        return None if known is None else known.edges_mm

    def _too_near(self, target: str, view: Pose) -> bool:
        """Return whether the camera points at a target that is too near to be found."""
        known = self.known.get(target)
        if known is None:
            return False
        bearing_deg, distance_mm = view.polar_to(known.place)
        return abs(bearing_deg) <= self.half_view_deg and not self.fits(target, distance_mm)

    def learn(self, target: str, finding: TargetFinding | None, here: Point) -> None:
        """Update with a failure's finding about a target, made at `here`."""
        match finding:
            case TargetFinding.NOT_HERE:
                self._looked_from.setdefault(target, []).append(here)
                place = self.look_alikes.looked_round(target, here)
                if place is not None:
                    self.flush_looks()
                    self.beliefs[target].see(place, here)
            case TargetFinding.MOVED:
                self.flush_looks()
                self.beliefs[target].scatter()
            case TargetFinding.NOT_THERE:
                self._forget(target)
            case TargetFinding.UNCERTAIN:
                self._reject(target, doubtful=True)
            case TargetFinding.LOOK_ALIKE:
                self._reject(target)

    def flush_looks(self) -> None:
        """Update the beliefs with the map and all looks that are still held back; called before a decision."""
        self._follow_the_map()
        for target, unseen in self._unseen.items():
            self.beliefs[target].look(unseen.pose, self._floor, unseen.frames)
        self._unseen.clear()

    def reconsider(self, target: str) -> None:
        """Forget a target that was not seen where it is remembered, unless it is still likely to be there."""
        self.flush_looks()
        known = self.known.get(target)
        if known is not None and self.beliefs[target].held_at(known.place) < HELD_CHANCE:
            del self.known[target]

    def chances_from(self, target: str, places: Sequence[Point]) -> list[tuple[float, float]]:
        """Return for each place the probability that a scan from there finds it, and that it is beyond the frontier.

        Beyond the frontier is unknown floor that lies open before the place.
        """
        belief = self.beliefs[target]
        found, beyond = belief.chances_from(places, self._floor), belief.frontier_chances_from(places, self._floor)
        return list(zip(found, beyond, strict=True))

    def searched(self, target: str) -> bool:
        """Return whether a scan for the target has ended without finding it."""
        return target in self._looked_from

    def novelty(self, target: str, place: Point) -> float:
        """Return how much of a look from there is not a repetition of one from nearby, 0..1."""
        nearest_mm = min((math.dist(here, place) for here in self._looked_from.get(target, ())), default=math.inf)
        return 1.0 - math.exp(-nearest_mm / NEW_MM)

    def _forget(self, target: str) -> TargetEstimate | None:
        """Update with a target that is not where it is remembered; return what was remembered."""
        known = self.known.pop(target, None)
        if known is not None:
            self.beliefs[target].refute(known.place)
        return known

    def _reject(self, target: str, *, doubtful: bool = False) -> None:
        """Update with a look-alike: for some time it is not taken for the target again."""
        if (known := self._forget(target)) is not None:
            self.look_alikes.reject(target, known.place, known.time_s, doubtful=doubtful)

    def _is_accepted(self, sighting: Sighting) -> bool:
        """Note a sighting; return whether it is neither of a known look-alike nor in two places at once."""
        lens = self._camera.lens_at(self._poses.at(sighting.time_s))
        place = lens.ahead(sighting.distance_mm, sighting.bearing_deg)
        self.look_alikes.seen(sighting, place)
        return not (
            self._elsewhere(sighting, lens) or self.look_alikes.rejected(sighting.target, place, sighting.time_s)
        )

    def _elsewhere(self, sighting: Sighting, lens: Pose) -> bool:
        """Return whether a target is seen elsewhere within a moment; the earlier place then stays valid for a while."""
        known = self.known.get(sighting.target)
        if known is None or sighting.time_s - known.time_s > NEW_LOOK_S:
            return False
        distance_mm = sighting.distance_mm
        if self.scale.unknown(sighting.target):  # an echo may change it at any time, so only the direction counts
            _, distance_mm = lens.polar_to(known.place)
        place = lens.ahead(distance_mm, sighting.bearing_deg)
        return math.dist(known.place, place) > max(JUMP_MM, JUMP_SHARE * sighting.distance_mm)

    def _estimated(self, sighting: Sighting, range_mm: float | None) -> Sighting:
        """Return a sighting with the best estimate of distance and bearing."""
        lens, known = self._camera.lens_at(self._poses.at(sighting.time_s)), self.known.get(sighting.target)
        echo_ahead_mm = None if range_mm is None else range_mm + self.scale.sonar_ahead_mm
        remembered = None if known is None else lens.polar_to(known.place)
        floor_mm = self._floor_mm(sighting) if self.scale.guessed(sighting.target) else None
        corrected = self.scale.corrected(sighting) if floor_mm is None else self._standing(sighting, floor_mm)
        if self.scale.unknown(sighting.target):
            corrected = limit_to_echo(corrected, echo_ahead_mm)
        return estimated(corrected, echo_ahead_mm, remembered)

    def _standing(self, sighting: Sighting, floor_mm: float) -> Sighting:
        """Return a sighting of a target whose height is a guess, corrected by the floor at its lower edge."""
        whole = Cut.BOTTOM not in sighting.cut
        if whole and not sighting.bound:
            self.scale.assume_on_floor(sighting, floor_mm)
        elif self.scale.unknown(sighting.target):
            if not whole:
                return limit_distance(self.scale.corrected(sighting), floor_mm)
            # where the frame does not show both sides, the target may be farther out
            return replace(sighting, distance_mm=floor_mm, bound=sighting.cut != Cut.TOP)
        return self.scale.corrected(sighting)

    def _floor_mm(self, sighting: Sighting) -> float | None:
        """Return how far in front of the lens the floor is at a target's lower edge: no target is farther."""
        lower_deg = sighting.lower_deg
        return None if lower_deg is None or lower_deg < FLOOR_DEG else self._camera.floor_mm(lower_deg)

    def _see(self, target: str, sighting: Sighting) -> None:
        self._unseen.pop(target, None)
        seen_from = self._poses.at(sighting.time_s)
        lens = self._camera.lens_at(seen_from)
        place, here = lens.ahead(sighting.distance_mm, sighting.bearing_deg), lens.point
        self._floor.clear_line_of_sight(here, place)
        before = self.known.get(target)
        if before is not None and math.dist(before.place, place) > JUMP_MM:
            before = None
        if before is not None:
            place = (
                before.place[0] + SIGHTING_WEIGHT * (place[0] - before.place[0]),
                before.place[1] + SIGHTING_WEIGHT * (place[1] - before.place[1]),
            )
        if before is None or sighting.time_s - before.time_s > NEW_LOOK_S:
            if self._floor.include(place, margin_mm=INSIDE_MM):
                self._follow_the_map()
            self.beliefs[target].see(place, here, self.slant.degrees(sighting))
        edges_mm = self._edges_with(sighting, None if before is None else before.edges_mm)
        self.known[target] = TargetEstimate(place, sighting.time_s, sighting.distance_mm, seen_from, edges_mm)

    def turned(self, scale: float, begin: Pose, end: Pose) -> None:
        """Move the targets seen in a turn on the spot, which was `scale` times as far as from `begin` to `end`."""
        for target, known in self.known.items():
            share = (known.seen_from.heading_deg - begin.heading_deg) / (end.heading_deg - begin.heading_deg)
            if 0.0 <= share <= 1.0 and known.seen_from.distance_mm_to(begin) <= STEP_MM:
                bearing_deg, distance_mm = known.seen_from.polar_to(known.place)
                known.seen_from = corrected(known.seen_from, begin, scale)
                known.place = known.seen_from.ahead(distance_mm, bearing_deg)
                self.beliefs[target].see(known.place, known.seen_from.point)

    def _edges_with(self, sighting: Sighting, before: Edges | None) -> Edges | None:
        """Return the estimate of a target's edges, updated with a sighting that shows both."""
        seen = sighting.edges_mm
        if sighting.cut or seen is None or math.isinf(self._fit.fills_mm(seen)):
            return before
        lower_mm, upper_mm = before or seen
        return lower_mm + SIGHTING_WEIGHT * (seen[0] - lower_mm), upper_mm + SIGHTING_WEIGHT * (seen[1] - upper_mm)

    def _follow_the_map(self) -> None:
        """Update the beliefs for the known floor, and for all places on a map that has grown."""
        likely = likely_places(self._floor)
        for belief in self.beliefs.values():
            belief.follow(likely)

    def _miss(self, target: str, pose: Pose) -> None:
        unseen = self._unseen.get(target)
        if unseen is not None and (
            abs(unseen.pose.heading_deg - pose.heading_deg) > STEP_DEG or unseen.pose.distance_mm_to(pose) > STEP_MM
        ):
            self.beliefs[target].look(unseen.pose, self._floor, unseen.frames)
            unseen = None
        if unseen is None:
            self._unseen[target] = _Unseen(pose, 1)
        else:
            unseen.frames += 1
