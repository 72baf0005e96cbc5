"""Define two baselines: Nav2's list of recoveries, and a random walk."""

from __future__ import annotations

from random import Random

from behaviors.events import Reason
from behaviors.ports import Sighting, StopReason
from behaviors.recoveries import CHANGE_TARGET, RESCAN, WAIT
from behaviors.thesis.skills import SLICE_S
from nxtdrive.simulated.robot import ScenarioRobot

from .baseline import Baseline

RETRIES = 6
"""Nav2's default behavior tree recovers six times. Source: docs/evaluation.md, agents."""
SPIN_DEG, WAIT_S, BACK_UP_MM = 90.0, 5.0, 300.0
"""Nav2's Spin of 1.57 rad, Wait of 5 s and BackUp of 0.30 m."""
BACK_UP = "back_up"
"""Name of a recovery that profiles do not have."""

TURNS_DEG = (45.0, 180.0)
"""Range of the random walk's turns, to either side, when its path is blocked."""
LEG_S = (4.0, 12.0)
"""Range of the duration of its drives; without a limit it might circle forever."""
RETREAT_MM = 80.0
"""How far it backs away from an obstacle that it touched."""


class Nav2List(Baseline):
    """Search and approach as the thesis does, and cycle through Nav2's default recoveries after any failure.

    This is not Nav2 itself. Its first recovery, clearing the costmap, is left out: there is no costmap here.
    """

    def pursue(self, target: str) -> bool:
        """Search and approach, at most seven times."""
        for attempt in range(RETRIES + 1):
            reason = self.search(target)
            seen = reason is Reason.SIGHTED
            if seen:
                reason = self.arrive(target)
                if reason is Reason.WITHIN_REACH:
                    return True
            if attempt == RETRIES:
                self.choose(CHANGE_TARGET.name, f"recovered {RETRIES} times", reason, seen_since_search=seen)
            else:
                self._recover(attempt, reason, seen_since_search=seen)
        return False

    def _recover(self, number: int, reason: Reason, *, seen_since_search: bool) -> None:
        choice = (RESCAN.name, WAIT.name, BACK_UP)[number % 3]
        numbers = {"wait_s": WAIT_S} if choice == WAIT.name else {}
        self.choose(choice, "next in the list", reason, seen_since_search=seen_since_search, **numbers)
        self.enter(choice)
        if choice == RESCAN.name:
            self.turn(SPIN_DEG)
        elif choice == BACK_UP:
            self.straight(-BACK_UP_MM)
        else:
            end_s = self.clock.now() + WAIT_S
            while self.clock.now() < end_s:
                self.context.check_time()
                self.rest(SLICE_S)


class RandomWalk(Baseline):
    """Drive straight until the sonar stops the robot, turn at random, and approach the target once it is in view.

    A random walk never gives up, so the remaining time is divided evenly among the remaining targets.
    """

    def __init__(self, robot: ScenarioRobot) -> None:
        super().__init__(robot)
        self._random = Random(f"random walk {robot.mission.mission.name}")

    def pursue(self, target: str) -> bool:
        """Wander until the target is reached or its share of the time is used up."""
        items = self.queue.targets
        left = len(items) - items.index(self.queue.current)
        give_up_s = self.clock.now() + (self.deadline_s - self.clock.now()) / left
        while self.clock.now() < give_up_s:
            self.queue.current.attempts += 1
            if self._wander(target, give_up_s) and self.arrive(target) is Reason.WITHIN_REACH:
                return True
        return False

    def _wander(self, target: str, until_s: float) -> Sighting | None:
        """Drive and turn until the target is seen."""
        self.enter("search")
        while self.clock.now() < until_s:
            leg_end_s = min(until_s, self.clock.now() + self._random.uniform(*LEG_S))
            while self.clock.now() < leg_end_s:
                self.context.check_time()
                stop = self.drive(self.mission.thesis.cruise_mm_s)
                if stop is not None:
                    break
                if sighting := self.look(target):
                    self.stop()
                    return sighting
            self.stop()
            if stop is StopReason.CONTACT:
                self.straight(-RETREAT_MM)
            self.turn(self._random.choice((-1, 1)) * self._random.uniform(*TURNS_DEG))
        return None
