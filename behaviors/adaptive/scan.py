"""The state search: turns on the spot past every bearing where the target may be, with camera and sonar."""

from __future__ import annotations

import math
from dataclasses import dataclass

from behaviors.adaptive.perception import Perception, blocker_without_echo
from behaviors.adaptive.turn_scale import TUNING as TURNS
from behaviors.angles import wrapped_deg
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Failure, TargetFinding
from behaviors.skills import sighted


@dataclass(frozen=True, slots=True)
class ScanTuning:
    """Tuning constants of scanning.

    Attributes:
        step_deg: The robot turns no more than this between two frames, so that neighbouring frames show the same thing.
        burst_step_deg: No more than this between two looks at several frames each, as on a slow link.
        slowest_deg_s: It turns no slower, however slow the link.
        full_deg: An arc this wide is a full turn; the width of a frame covers the rest.
        known_deg: A target is first looked for where it is remembered, this far to either side.
        remembered_share: This is done when it is nearer than this share of its detector's range.
        held_s: Time over which the progress of a turn is measured.
        held_deg: A turn that comes no farther than this in `held_s` is held by something.
        longest_step_s: What takes longer is a pause, as on a slow link.
        beyond_mm: A target may be this far behind the source of an echo at the side of the sonar's cone.
        aim_deg: The beginning of an arc need not be met more exactly.
        worth_a_turn: A scan with less chance of success is skipped, except the first one at the start, since people
            usually start the robot near a target.
        start_mm: Within this distance of its starting point the robot is still at the start.
        frames_at_rest: This many frames are evaluated before a turn begins; a detection is accepted when a second frame
            confirms it.
    """

    step_deg: float = 6.0
    burst_step_deg: float = 24.0
    slowest_deg_s: float = 10.0
    full_deg: float = 330.0
    known_deg: float = 25.0
    remembered_share: float = 0.9
    held_s: float = 3.0
    held_deg: float = 6.0
    longest_step_s: float = 0.6
    beyond_mm: float = 500.0
    aim_deg: float = 8.0
    worth_a_turn: float = 0.015
    start_mm: float = 100.0
    frames_at_rest: int = 3


TUNING = ScanTuning()


class ScanSkill:
    """The state search: one scan from here.

    Args:
        perception: What to work with.
    """

    def __init__(self, perception: Perception) -> None:
        self._perception = perception
        self._rate_deg_s = perception.parameters.scan_deg_s
        self._range_mm: float | None = None

    def call(self) -> Fact:
        """Scan until the target is seen or nothing is left to look at; the robot is at rest afterwards."""
        perception = self._perception
        begun_s = perception.now()
        perception.context.body.stop()
        fact = self._rest() or self._look_where_known() or self._scan_round()
        perception.context.body.stop()
        if fact is not None:
            return fact
        scan_s = perception.now() - begun_s
        return Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN, {"scan_s": scan_s}, finding=TargetFinding.NOT_HERE)

    def _look_where_known(self) -> Fact | None:
        """Look where the target is remembered, if it can be seen from here."""
        perception = self._perception
        known = perception.world.targets.known.get(perception.target)
        if known is None:
            return None
        _, distance_mm = perception.world.pose.polar_to(known.place)
        if distance_mm > TUNING.remembered_share * perception.world.targets.detection_range_mm[perception.target]:
            return None
        fact = self._face(perception.world.camera_turn_deg(known.place))
        fact = fact or self._rest() or self._sweep(TUNING.known_deg) or self._sweep(-2 * TUNING.known_deg)
        if fact is None:
            perception.world.targets.reconsider(perception.target)
        return fact

    def _scan_round(self) -> Fact | None:
        """Look along the most promising arc, if any is worth it."""
        perception = self._perception
        world = perception.world
        world.targets.flush_looks()
        belief = world.targets.beliefs[perception.target]
        chance = belief.chance_from(*world.here, world.floor)
        first = math.hypot(*world.here) < TUNING.start_mm and not world.targets.searched(perception.target)
        if chance < TUNING.worth_a_turn and not first:
            return None
        if perception.doubts_turns:
            return self._scan_past_the_start()
        begin_deg, end_deg = belief.arc_from(*world.here, world.floor, perception.parameters.scan_deg_s)
        margin_deg = world.targets.half_view_deg / 2
        begin_deg, end_deg = begin_deg + margin_deg, end_deg - margin_deg
        if end_deg - begin_deg >= TUNING.full_deg - 2 * margin_deg:
            return self._sweep(TUNING.full_deg)
        if end_deg <= begin_deg:
            begin_deg = end_deg = (begin_deg + end_deg) / 2
        # to the nearer end first
        looks_deg = world.pose.heading_deg + world.camera.yaw_deg
        to_begin, to_end = (wrapped_deg(each - looks_deg) for each in (begin_deg, end_deg))
        width_deg = end_deg - begin_deg
        first_deg, sweep_deg = (to_begin, width_deg) if abs(to_begin) <= abs(to_end) else (to_end, -width_deg)
        fact = self._face(first_deg) if abs(first_deg) > TUNING.aim_deg else None
        return fact or self._rest() or self._sweep(sweep_deg)

    def _scan_past_the_start(self) -> Fact | None:
        """Scan on until the first echoes are received again, to learn how far the robot really turns."""
        perception = self._perception
        perception.begin_turn()
        fact = self._sweep(TURNS.enough_deg)
        while fact is None and not perception.turns.complete:
            fact = self._sweep(TURNS.further_deg)
        if fact is None:
            perception.context.body.stop()
            perception.learn_turns()
        return fact

    def _face(self, angle_deg: float) -> Fact | None:
        """Turn to where looking begins; on a slow link while looking, since there an exact turn takes longer."""
        if self._perception.frames > 1:
            return self._sweep(angle_deg)
        self._perception.context.body.turn(angle_deg)
        return None

    def _rest(self) -> Fact | None:
        """Evaluate a few frames at rest: the target may be in view already."""
        for _ in range(math.ceil(TUNING.frames_at_rest / self._perception.frames)):
            if (fact := self._see()) is not None:
                return fact
        return None

    def _sweep(self, angle_deg: float) -> Fact | None:
        """Turn by an angle, slowly enough for the camera; notices when something holds the robot."""
        perception = self._perception
        start_deg = heading_deg = perception.world.pose.heading_deg
        sign = 1 if angle_deg > 0 else -1
        then_s = perception.now()
        moved_deg, still_s = heading_deg, 0.0
        while sign * (heading_deg - start_deg) < abs(angle_deg):
            perception.drive(0.0, sign * self._rate_deg_s)
            if (fact := self._see()) is not None:
                return fact
            heading_deg, now_s = perception.world.pose.heading_deg, perception.now()
            still_s += min(now_s - then_s, TUNING.longest_step_s)
            if abs(heading_deg - moved_deg) > TUNING.held_deg:
                moved_deg, still_s = heading_deg, 0.0
            elif still_s > TUNING.held_s:
                turned = {"turned_deg": sign * (heading_deg - start_deg)}
                return Failure(Event.SEARCH_FAILED, Reason.NO_PROGRESS, turned, blocker=blocker_without_echo())
            # on a slow link steps take longer: turn slower
            step_deg = TUNING.burst_step_deg if perception.frames > 1 else TUNING.step_deg
            self._rate_deg_s = max(
                TUNING.slowest_deg_s, min(self._unblurred_deg_s(), step_deg / max(0.01, now_s - then_s))
            )
            then_s = now_s
        return None

    def _see(self) -> Fact | None:
        """Evaluate one frame."""
        observation = self._perception.step()
        self._range_mm = observation.range_mm
        return sighted(observation.sighting) if observation.sighting else None

    def _unblurred_deg_s(self) -> float:
        """Return how fast the robot may turn: nearer objects are larger in the frame and bear more blur."""
        perception = self._perception
        slow_deg_s = perception.parameters.scan_deg_s
        if self._range_mm is None:
            return slow_deg_s
        farthest_mm = perception.world.targets.detection_range_mm[perception.target]
        return slow_deg_s * max(1.0, farthest_mm / (self._range_mm + TUNING.beyond_mm))
