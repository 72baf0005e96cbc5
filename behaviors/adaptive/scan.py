"""The state search: turns on the spot past every bearing where the target may be, with camera and sonar."""

from __future__ import annotations

import math

from behaviors.adaptive.perception import Perception, blocker_without_echo
from behaviors.adaptive.turn_scale import ENOUGH_DEG, FURTHER_DEG
from behaviors.angles import wrapped_deg
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Failure, TargetFinding
from behaviors.skills import sighted

STEP_DEG = 6.0
"""The robot turns no more than this between two frames, so that neighbouring frames show the same thing."""
STOP_SHARE = 1.6
"""If looks are slow the robot stops for each, this share of half the angle of view apart."""
BURST_STEP_DEG = 24.0
"""No more than this between two looks at several frames each, as on a slow link."""
SLOWEST_DEG_S = 10.0
"""It turns no slower, however slow the link."""
FULL_DEG = 330.0
"""An arc this wide is a full turn; the width of a frame covers the rest."""
KNOWN_DEG = 25.0
"""A target is first looked for where it is remembered, this far to either side."""
REMEMBERED_SHARE = 0.9
"""This is done when it is nearer than this share of its detector's range."""
HELD_S = 3.0
"""Time over which the progress of a turn is measured."""
HELD_DEG = 6.0
"""A turn that comes no farther than this in `HELD_S` is held by something."""
LONGEST_STEP_S = 0.6
"""What takes longer is a pause, as on a slow link."""
BEYOND_MM = 500.0
"""A target may be this far behind the source of an echo at the side of the sonar's cone."""
AIM_DEG = 8.0
"""The beginning of an arc need not be met more exactly."""
WORTHWHILE_CHANCE = 0.015
"""A scan with less chance of success is skipped, except the first one at the start, since people usually start the
robot near a target."""
START_MM = 100.0
"""Within this distance of its starting point the robot is still at the start."""
FRAMES_AT_REST = 3
"""This many frames are evaluated before a turn begins; a detection is accepted when a second frame confirms it."""


class ScanSkill:
    """The state search: one scan from here.

    Args:
        perception: What to work with.
    """

    def __init__(self, perception: Perception) -> None:
        self._perception = perception
        self._rate_deg_s = perception.parameters.scan_deg_s
        self._range_mm: float | None = None
        self._unconfirmed = False

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
        if distance_mm > REMEMBERED_SHARE * perception.world.targets.detection_range_mm[perception.target]:
            return None
        fact = self._face(perception.world.camera_turn_deg(known.place))
        fact = fact or self._rest() or self._sweep(KNOWN_DEG) or self._sweep(-2 * KNOWN_DEG)
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
        first = math.hypot(*world.here) < START_MM and not world.targets.searched(perception.target)
        if chance < WORTHWHILE_CHANCE and not first:
            return None
        if perception.doubts_turns:
            return self._scan_past_the_start()
        begin_deg, end_deg = belief.arc_from(*world.here, world.floor, perception.parameters.scan_deg_s)
        margin_deg = world.targets.half_view_deg / 2
        begin_deg, end_deg = begin_deg + margin_deg, end_deg - margin_deg
        if end_deg - begin_deg >= FULL_DEG - 2 * margin_deg:
            return self._sweep(FULL_DEG)
        if end_deg <= begin_deg:
            begin_deg = end_deg = (begin_deg + end_deg) / 2
        # to the nearer end first
        looks_deg = world.pose.heading_deg + world.camera.yaw_deg
        to_begin, to_end = (wrapped_deg(each - looks_deg) for each in (begin_deg, end_deg))
        width_deg = end_deg - begin_deg
        first_deg, sweep_deg = (to_begin, width_deg) if abs(to_begin) <= abs(to_end) else (to_end, -width_deg)
        fact = self._face(first_deg) if abs(first_deg) > AIM_DEG else None
        return fact or self._rest() or self._sweep(sweep_deg)

    def _scan_past_the_start(self) -> Fact | None:
        """Scan on until the first echoes are received again, to learn how far the robot really turns."""
        perception = self._perception
        perception.begin_turn()
        fact = self._sweep(ENOUGH_DEG)
        while fact is None and not perception.turns.complete:
            fact = self._sweep(FURTHER_DEG)
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
        """Evaluate a few frames at rest: the target may be in view already. One is enough if looks are slow."""
        for _ in range(math.ceil(FRAMES_AT_REST / self._perception.frames)):
            if (fact := self._see()) is not None:
                return fact
            if self._perception.looks_are_slow and not self._unconfirmed:
                break
        return None

    def _sweep(self, angle_deg: float) -> Fact | None:
        """Turn by an angle while looking; if looks are slow, stop for each and only listen in between."""
        if not self._perception.looks_are_slow:
            return self._turn(angle_deg, look=True)
        self._rate_deg_s = self._perception.parameters.scan_deg_s
        stops = math.ceil(abs(angle_deg) / (STOP_SHARE * self._perception.world.targets.half_view_deg))
        for _ in range(stops):
            fact = self._turn(angle_deg / stops, look=False)
            self._perception.context.body.stop()
            fact = fact or self._rest()
            if fact is not None:
                return fact
        return None

    def _turn(self, angle_deg: float, *, look: bool) -> Fact | None:
        """Turn by an angle, looking slowly enough for that or listening; notices when something holds the robot."""
        perception = self._perception
        start_deg = heading_deg = perception.world.pose.heading_deg
        sign = 1 if angle_deg > 0 else -1
        then_s = perception.now()
        moved_deg, still_s = heading_deg, 0.0
        while sign * (heading_deg - start_deg) < abs(angle_deg):
            perception.drive(0.0, sign * self._rate_deg_s)
            if not look:
                perception.listen()
            elif (fact := self._see()) is not None:
                return fact
            heading_deg, now_s = perception.world.pose.heading_deg, perception.now()
            still_s += min(now_s - then_s, LONGEST_STEP_S)
            if abs(heading_deg - moved_deg) > HELD_DEG:
                moved_deg, still_s = heading_deg, 0.0
            elif still_s > HELD_S:
                turned = {"turned_deg": sign * (heading_deg - start_deg)}
                return Failure(Event.SEARCH_FAILED, Reason.NO_PROGRESS, turned, blocker=blocker_without_echo())
            if look:  # on a slow link steps take longer: turn slower
                step_deg = BURST_STEP_DEG if perception.frames > 1 else STEP_DEG
                rate_deg_s = step_deg / max(0.01, now_s - then_s)
                self._rate_deg_s = max(SLOWEST_DEG_S, min(self._unblurred_deg_s(), rate_deg_s))
            then_s = now_s
        return None

    def _see(self) -> Fact | None:
        """Evaluate one frame."""
        observation = self._perception.step()
        self._range_mm, self._unconfirmed = observation.range_mm, observation.unconfirmed
        return sighted(observation.sighting) if observation.sighting else None

    def _unblurred_deg_s(self) -> float:
        """Return how fast the robot may turn: nearer objects are larger in the frame and bear more blur."""
        perception = self._perception
        slow_deg_s = perception.parameters.scan_deg_s
        if self._range_mm is None:
            return slow_deg_s
        farthest_mm = perception.world.targets.detection_range_mm[perception.target]
        return slow_deg_s * max(1.0, farthest_mm / (self._range_mm + BEYOND_MM))
