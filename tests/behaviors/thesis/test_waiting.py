"""The state wait, on real clocks."""

from __future__ import annotations

import pytest

from behaviors.events import Event
from behaviors.mission import ThesisParameters
from behaviors.pause import Pause
from behaviors.skills import SkillContext
from behaviors.thesis.skills import ThesisWaitSkill


class CoarseClock:
    """Time in whole milliseconds since a moment that no float hits exactly, as a simulated link has it."""

    def __init__(self) -> None:
        self.now_ms = 1

    def now(self) -> float:
        return self.now_ms * 0.001 + 0.1

    def sleep(self, duration_s: float) -> None:
        self.now_ms += round(duration_s * 1000)


class EndingClock(CoarseClock):
    """An operator ends the mission during the first sleep."""

    def __init__(self, pause: Pause) -> None:
        super().__init__()
        self._pause = pause

    def sleep(self, duration_s: float) -> None:
        super().sleep(duration_s)
        self._pause.end()


class Still:
    """The part of a body that a wait needs."""

    def stop(self) -> None:
        pass

    def keep_alive(self) -> None:
        pass


@pytest.mark.parametrize("wait_s", [0.0, 0.7, 14.999, 15.0])
def test_a_wait_ends_on_time_although_clocks_round(wait_s):
    clock = CoarseClock()
    context = SkillContext(Still(), None, clock, ThesisParameters(), lambda *_: None, lambda _: None)
    begun_s = clock.now()
    assert ThesisWaitSkill(context, wait_s).call().event is Event.RECOVERY_DONE
    assert clock.now() - begun_s == pytest.approx(wait_s, abs=0.002)


def test_an_operator_ends_a_wait_at_once_although_it_makes_no_request():
    pause = Pause()
    clock = EndingClock(pause)
    context = SkillContext(Still(), None, clock, ThesisParameters(), lambda *_: None, lambda _: None, pause=pause)
    begun_s = clock.now()
    with pytest.raises(KeyboardInterrupt), pause.interrupting():
        ThesisWaitSkill(context, 60.0).call()
    assert clock.now() - begun_s < 1.0
