"""Perceiving: one frame, one echo and the wheels at a time, all of it taken into memory."""

from __future__ import annotations

from dataclasses import dataclass

from behaviors.adaptive.memory import Memory
from behaviors.agenda import Agenda, Fate
from behaviors.mission import AdaptiveProfile
from behaviors.ports import Blind, Glance, Sighting
from behaviors.skills import Senses, note_look

BLIND_NAP_S = 0.2
"""A camera without a picture is asked again so often."""
PATIENCE_S = 20.0
"""How long to wait for a picture."""


@dataclass(frozen=True, slots=True)
class Percept:
    """What was perceived in one step.

    Attributes:
        time_s: When.
        sighting: Of the present target, or None.
        range_mm: The sonar's echo, or None.
        blind: Whether the camera gave no picture.
    """

    time_s: float
    sighting: Sighting | None
    range_mm: float | None
    blind: bool = False


class Watch:
    """What every service of the adaptive mind works with.

    Args:
        senses: The ports.
        profile: The numbers.
        memory: Takes in what is perceived.
        agenda: Which target is looked for.
    """

    def __init__(self, senses: Senses, profile: AdaptiveProfile, memory: Memory, agenda: Agenda) -> None:
        self.senses = senses
        self.profile = profile
        self.memory = memory
        self._agenda = agenda

    @property
    def target(self) -> str:
        """The target being pursued."""
        return self._agenda.target

    def now(self) -> float:
        """Present time on the mission's clock."""
        return self.senses.clock.now()

    def step(self) -> Percept:
        """Look at the next frame and listen for an echo.

        Raises:
            TimeUp: The mission's time is over.
        """
        senses = self.senses
        senses.check_time()
        looked_for = [self.target, *self._others()]
        glance = self._glance(looked_for)
        blind = glance is None
        range_mm = senses.body.range_mm()
        pose = senses.body.pose()
        now_s = self.now()
        looks = [] if blind else looked_for
        seen = self.memory.perceive(now_s, pose, range_mm, looks, glance or Glance(now_s, {}))
        sighting = seen.get(self.target)
        note_look(senses, pose, range_mm, sighting)
        return Percept(now_s, sighting, range_mm, blind)

    def await_picture(self) -> bool:
        """Make sure of a picture; without one the robot stands and waits. Whether it came in time."""
        if not self.step().blind:
            return True
        self.senses.body.stop()
        end_s = self.now() + PATIENCE_S
        while self.now() < end_s:
            if not self.step().blind:
                return True
            self.senses.clock.sleep(BLIND_NAP_S)
        return False

    def _glance(self, looked_for: list[str]) -> Glance | None:
        """What the next frame shows; None without one."""
        try:
            return self.senses.eyes.glance(looked_for)
        except Blind:
            return None

    def _others(self) -> list[str]:
        """Further targets that are not reached yet."""
        if not self.profile.remembers_others:
            return []
        pending = [errand.target for errand in self._agenda.errands if errand.fate is not Fate.REACHED]
        return [target for target in dict.fromkeys(pending) if target != self.target]
