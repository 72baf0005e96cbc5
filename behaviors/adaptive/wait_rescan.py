"""Standing and watching: the states wait and rescan."""

from __future__ import annotations

from behaviors.adaptive.perception import BLOCKER_MM, Observation, Perception
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Blocker, Failure, TargetFinding
from behaviors.skills import sighted

BLOCKED_MM = 650.0
"""An echo from nearer still blocks the path: a little farther than what stops an approach, since echoes vary."""
LEFT_MM = 250.0
"""An echo from this much beyond the blocker's is not its own; beside a door stand its posts."""
BEFORE_MM = 200.0
"""Only an echo that is this much nearer than the target blocks the path: a little less than in an approach, for the
same reason."""
CLEAR_ECHOES = 2
"""The path is free after this many clear echoes in a row while the target is in view."""
CLEAR_ECHOES_UNSEEN = 10
"""The same while the target is not in view."""
IN_VIEW_S = 1.0
"""A target that was seen no longer ago is in view."""
AIM_DEG = 4.0
"""A wait watches the blocker, and a second look points at where the target should be, to within this."""
LOOK_S = 1.5
"""Length of each look of a second look."""
BESIDE_DEG = (0.0, 18.0, -36.0)
"""Turns before these looks: at the place itself, to the right of it, to the left."""


class WaitSkill:
    """The state wait: until the path is free, or the time is over.

    Args:
        perception: What to work with.
        wait_s: Longest time.
    """

    def __init__(self, perception: Perception, wait_s: float) -> None:
        self._perception = perception
        self._left_s = wait_s
        self._clear = 0
        self._limit_mm = BLOCKED_MM
        self._turn_deg = 0.0
        if (blocker := perception.world.blocker) is not None:
            self._turn_deg = blocker.bearing_deg
            self._limit_mm = min(BLOCKED_MM, blocker.range_mm + LEFT_MM)

    def call(self) -> Fact:
        """Wait at rest; TARGET_SEEN or RECOVERY_DONE when the path is free, else RECOVERY_FAILED.

        While the sonar seems dead, nothing shows that the path is free.
        """
        perception = self._perception
        body = perception.context.body
        body.stop()
        body.keep_alive()
        if abs(self._turn_deg) > AIM_DEG:
            body.turn(self._turn_deg)
        self._turn_deg = 0.0
        begun_s = then_s = perception.now()
        range_mm = None
        while self._left_s > 0:
            observation = perception.step()
            range_mm = range_mm if observation.range_mm is None else observation.range_mm
            self._left_s -= observation.time_s - then_s
            then_s = observation.time_s
            self._clear = 0 if self._blocked(observation) else self._clear + 1
            if self._clear >= CLEAR_ECHOES:
                perception.context.watch.update(None)
                if observation.sighting is not None:
                    return sighted(observation.sighting, reason=Reason.WAY_CLEAR)
                if self._clear >= CLEAR_ECHOES_UNSEEN:
                    return Fact(Event.RECOVERY_DONE, Reason.WAY_CLEAR, {"waited_s": observation.time_s - begun_s})
        waited_s = perception.now() - begun_s
        hides = not self._in_view()
        measured = {"waited_s": waited_s, "range_mm": range_mm, "hides": hides}
        appeared = range_mm is not None and perception.world.floor.appeared(perception.world.pose, range_mm)
        blocker = Blocker(BLOCKER_MM if range_mm is None else range_mm, moving=appeared, hides=hides)
        return Failure(Event.RECOVERY_FAILED, Reason.BLOCKED_LONG, measured, blocker)

    def _blocked(self, observation: Observation) -> bool:
        if self._perception.sonar.silent:
            return True
        world = self._perception.world
        known = world.targets.known.get(self._perception.target)
        limit_mm = self._limit_mm
        if known is not None:
            limit_mm = min(limit_mm, world.pose.polar_to(known.place)[1] - BEFORE_MM)
        return observation.range_mm is not None and observation.range_mm <= limit_mm

    def _in_view(self) -> bool:
        """Return whether the target was seen a moment ago."""
        known = self._perception.world.targets.known.get(self._perception.target)
        return known is not None and self._perception.now() - known.time_s < IN_VIEW_S


class RescanSkill:
    """The state rescan: a longer look at where the target was, in case it was merely missed.

    Args:
        perception: What to work with.
    """

    def __init__(self, perception: Perception) -> None:
        self._perception = perception

    def call(self) -> Fact:
        """Look again; the robot is at rest afterwards."""
        perception = self._perception
        body = perception.context.body
        body.stop()
        begun_s = perception.now()
        known = perception.world.targets.known.get(perception.target)
        if known is None:
            return Fact(Event.RECOVERY_DONE, Reason.THERE)
        aim_deg = perception.world.camera_turn_deg(known.place)
        if abs(aim_deg) > AIM_DEG:
            body.turn(aim_deg)
        for turn_deg in BESIDE_DEG:
            if turn_deg:
                body.turn(turn_deg)
            if (fact := self._look()) is not None:
                return fact
        rescan_s = perception.now() - begun_s
        return Failure(
            Event.RECOVERY_FAILED, Reason.NEVER_SEEN, {"rescan_s": rescan_s}, finding=TargetFinding.NOT_THERE
        )

    def _look(self) -> Fact | None:
        """Look for some time."""
        perception = self._perception
        end_s = perception.now() + LOOK_S
        while perception.now() < end_s:
            observation = perception.step()
            if observation.sighting is not None:
                return sighted(observation.sighting)
        return None
