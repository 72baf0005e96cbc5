"""Looking round: turning on the spot past every bearing where the target may be, with camera and sonar awake."""

from __future__ import annotations

from behaviors.adaptive.angles import wrapped_deg
from behaviors.adaptive.perception import Perception
from behaviors.events import Event, Fact, Reason
from behaviors.skills import sighting_values

STEP_DEG = 6.0
"""The camera must see the same thing in neighbouring frames: no more than this is turned between two."""
SLOWEST_DEG_S = 8.0
"""It turns no slower, however slow the link."""
FULL_DEG = 330.0
"""An arc this wide is a whole turn; frames are as wide as what it lacks."""
KNOWN_DEG = 25.0
"""Where a target is remembered it is looked for first, so far to either side."""
REMEMBERED_SHARE = 0.9
"""A remembered target that is nearer than this share of its detector's range is looked for from here."""
HELD_S, HELD_DEG = 3.0, 6.0
"""A turn that came no farther in that time is held by something."""
LONGEST_STEP_S = 0.6
"""What takes longer is a pause, as on a slow link."""
AIM_DEG = 8.0
"""Where an arc begins need not be met more exactly."""
WORTH_A_TURN = 0.015
"""With less of a chance it is not worth looking round: that has been done here."""
FRAMES_AT_REST = 3
"""So many are looked at before a turn begins; a detection is believed when a second frame confirms it."""


class ScanSkill:
    """The state search: one look round from here.

    Args:
        perception: What to work with.
    """

    def __init__(self, perception: Perception) -> None:
        self._perception = perception
        self._rate_deg_s = perception.profile.scan_deg_s

    def call(self) -> Fact:
        """Look round until the target is seen or there is nothing more to see; the robot is at rest afterwards."""
        perception = self._perception
        begun_s = perception.now()
        perception.context.body.stop()
        fact = self._rest() or self._look_where_known() or self._look_round()
        perception.context.body.stop()
        if fact is not None:
            return fact
        perception.world.looked_round(perception.target)
        return Fact(Event.SEARCH_FAILED, Reason.NEVER_SEEN, {"scan_s": perception.now() - begun_s})

    def _look_where_known(self) -> Fact | None:
        """Look where the target is remembered, if that can be seen from here."""
        perception = self._perception
        known = perception.world.known.get(perception.target)
        if known is None:
            return None
        bearing_deg, distance_mm = perception.world.way_to(known.place)
        if distance_mm > REMEMBERED_SHARE * perception.world.seen_from_mm[perception.target]:
            return None
        perception.context.body.turn(bearing_deg)
        fact = self._rest() or self._sweep(KNOWN_DEG) or self._sweep(-2 * KNOWN_DEG)
        if fact is None:
            perception.world.reconsider(perception.target)
        return fact

    def _look_round(self) -> Fact | None:
        """Look along the arc that is most worth it, if any is."""
        perception = self._perception
        world = perception.world
        world.settle()
        belief = world.beliefs[perception.target]
        if belief.chance_from(*world.here, world.floor) < WORTH_A_TURN:
            return None
        begin_deg, end_deg = belief.arc_from(*world.here, world.floor, perception.profile.scan_deg_s)
        margin_deg = world.half_view_deg / 2
        begin_deg, end_deg = begin_deg + margin_deg, end_deg - margin_deg
        if end_deg - begin_deg >= FULL_DEG - 2 * margin_deg:
            return self._sweep(FULL_DEG)
        if end_deg <= begin_deg:
            begin_deg = end_deg = (begin_deg + end_deg) / 2
        # to the nearer end first
        to_begin, to_end = (wrapped_deg(each - world.pose.heading_deg) for each in (begin_deg, end_deg))
        width_deg = end_deg - begin_deg
        if abs(to_begin) <= abs(to_end):
            first_deg, sweep_deg = to_begin, width_deg
        else:
            first_deg, sweep_deg = to_end, -width_deg
        if abs(first_deg) > AIM_DEG:
            perception.context.body.turn(first_deg)
        return self._rest() or self._sweep(sweep_deg)

    def _rest(self) -> Fact | None:
        """A few frames at rest, for what is in view already."""
        for _ in range(FRAMES_AT_REST):
            if (fact := self._see()) is not None:
                return fact
        return None

    def _sweep(self, angle_deg: float) -> Fact | None:
        """Turn by an angle, slowly enough for the camera; says, too, when something holds the robot."""
        perception = self._perception
        start_deg = heading_deg = perception.world.pose.heading_deg
        sign = 1 if angle_deg > 0 else -1
        then_s = perception.now()
        moved_deg, still_s = heading_deg, 0.0
        while sign * (heading_deg - start_deg) < abs(angle_deg):
            perception.context.body.drive(0.0, sign * self._rate_deg_s)
            if (fact := self._see()) is not None:
                return fact
            heading_deg, now_s = perception.world.pose.heading_deg, perception.now()
            still_s += min(now_s - then_s, LONGEST_STEP_S)
            if abs(heading_deg - moved_deg) > HELD_DEG:
                moved_deg, still_s = heading_deg, 0.0
            elif still_s > HELD_S:
                return Fact(Event.SEARCH_FAILED, Reason.NO_PROGRESS, {"turned_deg": sign * (heading_deg - start_deg)})
            # on a slow link steps take longer: turn slower
            self._rate_deg_s = max(
                SLOWEST_DEG_S, min(perception.profile.scan_deg_s, STEP_DEG / max(0.01, now_s - then_s))
            )
            then_s = now_s
        return None

    def _see(self) -> Fact | None:
        """Whether the next frame shows it."""
        sighting = self._perception.step().sighting
        if sighting is None:
            return None
        return Fact(Event.TARGET_SEEN, Reason.SIGHTED, {"sighting": sighting_values(sighting)})
