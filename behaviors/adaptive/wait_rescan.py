"""Standing and watching: the states wait and rescan."""

from __future__ import annotations

from dataclasses import dataclass

from behaviors.adaptive.perception import TUNING as PERCEPTION
from behaviors.adaptive.perception import Observation, Perception
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Blocker, Failure, TargetFinding
from behaviors.skills import sighted


@dataclass(frozen=True, slots=True)
class WaitTuning:
    """Tuning constants of waiting and of a second look.

    Attributes:
        blocked_mm: An echo from nearer still blocks the path: a little farther than what stops an approach, since
            echoes vary.
        left_mm: An echo from this much beyond the blocker's is not its own; beside a door stand its posts.
        before_mm: Only an echo that is this much nearer than the target blocks the path: a little less than in an
            approach, for the same reason.
        clear: The path is free after this many clear echoes in a row while the target is in view.
        clear_unseen: The same while the target is not in view.
        in_view_s: A target that was seen no longer ago is in view.
        aim_deg: A wait watches the blocker, and a second look points at where the target should be, to within this.
        look_s: Length of each look of a second look.
        beside_deg: Turns before these looks: at the place itself, to the right of it, to the left.
    """

    blocked_mm: float = 650.0
    left_mm: float = 250.0
    before_mm: float = 200.0
    clear: int = 2
    clear_unseen: int = 10
    in_view_s: float = 1.0
    aim_deg: float = 4.0
    look_s: float = 1.5
    beside_deg: tuple[float, ...] = (0.0, 18.0, -36.0)


TUNING = WaitTuning()


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
        self._limit_mm = TUNING.blocked_mm
        self._turn_deg = 0.0
        if (blocker := perception.world.blocker) is not None:
            self._turn_deg = blocker.bearing_deg
            self._limit_mm = min(TUNING.blocked_mm, blocker.range_mm + TUNING.left_mm)

    def call(self) -> Fact:
        """Wait at rest; TARGET_SEEN or RECOVERY_DONE when the path is free, else RECOVERY_FAILED.

        While the sonar seems dead, nothing shows that the path is free.
        """
        perception = self._perception
        body = perception.context.body
        body.stop()
        body.keep_alive()
        if abs(self._turn_deg) > TUNING.aim_deg:
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
            if self._clear >= TUNING.clear:
                perception.context.watch.update(None)
                if observation.sighting is not None:
                    return sighted(observation.sighting, reason=Reason.WAY_CLEAR)
                if self._clear >= TUNING.clear_unseen:
                    return Fact(Event.RECOVERY_DONE, Reason.WAY_CLEAR, {"waited_s": observation.time_s - begun_s})
        waited_s = perception.now() - begun_s
        hides = not self._in_view()
        measured = {"waited_s": waited_s, "range_mm": range_mm, "hides": hides}
        appeared = range_mm is not None and perception.world.floor.appeared(perception.world.pose, range_mm)
        blocker = Blocker(PERCEPTION.blocker_mm if range_mm is None else range_mm, moving=appeared, hides=hides)
        return Failure(Event.RECOVERY_FAILED, Reason.BLOCKED_LONG, measured, blocker)

    def _blocked(self, observation: Observation) -> bool:
        if self._perception.sonar.silent:
            return True
        world = self._perception.world
        known = world.targets.known.get(self._perception.target)
        limit_mm = self._limit_mm
        if known is not None:
            limit_mm = min(limit_mm, world.pose.polar_to(known.place)[1] - TUNING.before_mm)
        return observation.range_mm is not None and observation.range_mm <= limit_mm

    def _in_view(self) -> bool:
        """Return whether the target was seen a moment ago."""
        known = self._perception.world.targets.known.get(self._perception.target)
        return known is not None and self._perception.now() - known.time_s < TUNING.in_view_s


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
        if abs(aim_deg) > TUNING.aim_deg:
            body.turn(aim_deg)
        for turn_deg in TUNING.beside_deg:
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
        end_s = perception.now() + TUNING.look_s
        while perception.now() < end_s:
            observation = perception.step()
            if observation.sighting is not None:
                return sighted(observation.sighting)
        return None
