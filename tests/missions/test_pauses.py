"""An operator's pause: the robot stands still for any time, and the mission continues where it left off."""

from __future__ import annotations

import pytest

from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import RecordKind
from behaviors.pause import Pause, Paused
from sim_backend.link import LinkFaults
from tests.small_mission import with_table

PROFILES = pytest.mark.parametrize("profile", ["thesis", "adaptive"])
SEARCHING_MS, APPROACHING_MS = 40, 7000
WAIT_MS = 60_000
BRAKING_MS, BRAKING_MM = 300, 40


class Operator(Pause):
    """Pauses the mission at a moment, and ends the pause when simulated time has passed.

    Attributes:
        crept_mm: How far the robot moved in the pause, once it had braked.
        slid_mm: How far it moved before.
    """

    def __init__(self, at_ms: int, for_ms: int = 120_000) -> None:
        super().__init__()
        self.crept_mm = self.slid_mm = 0.0
        self._at_ms, self._for_ms, self._waited_ms = at_ms, for_ms, 0

    def arrange(self, simulation) -> None:
        """Plan the pause."""
        self._simulation = simulation
        simulation.at(simulation.now_ms + self._at_ms, self.request)

    def wait(self, timeout_s: float) -> bool:
        """Let simulated time pass in place of real time, minutes at a time."""
        self.slid_mm += self._advance(BRAKING_MS)
        self.crept_mm += self._advance(WAIT_MS - BRAKING_MS)
        self._waited_ms += WAIT_MS
        if self._waited_ms >= self._for_ms:
            self.resume()
        return super().wait(timeout_s=0.0)

    def _advance(self, time_ms: int) -> float:
        begun = self._simulation.truth.pose
        self._simulation.advance(time_ms)
        ended = self._simulation.truth.pose
        return ((ended.x_mm - begun.x_mm) ** 2 + (ended.y_mm - begun.y_mm) ** 2) ** 0.5


@PROFILES
@pytest.mark.parametrize(("moment_ms", "state"), [(SEARCHING_MS, "search"), (APPROACHING_MS, "arrive")])
def test_the_robot_stands_and_the_mission_continues_where_it_was(perform, mission_for, profile, moment_ms, state):
    operator = Operator(moment_ms)
    mission = mission_for("lena", profile=profile)
    done = perform("open", mission, geometric=True, arrange=operator.arrange, pause=operator)
    assert done.report.achieved
    (paused,) = done.of(RecordKind.TRANSITION, reason=Reason.OPERATOR_PAUSE)
    (resumed,) = done.of(RecordKind.TRANSITION, reason=Reason.OPERATOR_RESUME)
    assert (paused.state, resumed.state) == ("suspended", state)
    assert paused.time_s == pytest.approx(moment_ms / 1000, abs=0.3), "it begins at once"
    assert resumed.data["evidence"]["paused_s"] == pytest.approx(120.0, abs=1.0), "reconnect_timeout_s is no limit"
    assert operator.slid_mm < BRAKING_MM
    assert operator.crept_mm < 1.0
    assert not done.of(RecordKind.CHOICE)


@pytest.mark.slow
def test_a_pause_in_a_motion_lets_the_skill_complete_it(perform, mission_for):
    mission = mission_for("rilakkuma", max_researches=1, advances=2)
    whole = perform("open", mission, geometric=True)
    moment_ms = round(whole.of(RecordKind.CALL, verb="move_to")[0].time_s * 1000) + 600
    operator = Operator(moment_ms)
    done = perform("open", mission, geometric=True, arrange=operator.arrange, pause=operator)
    (resumed,) = done.of(RecordKind.TRANSITION, reason=Reason.OPERATOR_RESUME)
    assert resumed.state == "move_to"
    (turn,) = done.of(RecordKind.STEP, what="turn")
    assert turn.data["turned_deg"] == pytest.approx(90.0, abs=2.0)
    assert len(done.of(RecordKind.STEP, what="advance")) == 2


def test_the_time_of_a_pause_does_not_count_against_the_time_limit(perform, mission_for):
    short = with_table(mission_for("lena"), "mission", time_limit_s=5.0)
    operator = Operator(SEARCHING_MS)
    done = perform("open", short, geometric=True, arrange=operator.arrange, pause=operator)
    assert done.report.ending is Ending.TIME_UP
    assert done.report.duration_s == pytest.approx(125.0, abs=1.0)


@pytest.mark.slow
def test_the_brick_does_not_switch_itself_off(perform, mission_for):
    operator = Operator(SEARCHING_MS, 12 * 60_000)
    assert perform(
        "open", mission_for("lena"), geometric=True, arrange=operator.arrange, pause=operator
    ).report.achieved


def test_a_pause_during_an_outage_stops_the_clock_of_the_outage(perform, mission_for):
    faults = LinkFaults(silent_ms=((5000, 12_000),))
    operator = Operator(10_000)
    limited = with_table(mission_for("lena"), "mission", reconnect_timeout_s=20.0)
    done = perform("open", limited, geometric=True, faults=faults, arrange=operator.arrange, pause=operator)
    assert done.report.achieved
    assert done.of(RecordKind.TRANSITION, event="link_back")


def test_a_pause_asked_for_before_the_start_begins_with_the_mission(perform, mission_for):
    operator = Operator(0)
    operator.request()
    done = perform("open", mission_for("lena"), geometric=True, arrange=operator.arrange, pause=operator)
    assert done.report.achieved
    assert done.of(RecordKind.TRANSITION, reason=Reason.OPERATOR_PAUSE)[0].time_s == pytest.approx(0.0, abs=0.1)


def test_ending_a_mission_that_is_paused_ends_it(perform, mission_for):
    class Quitter(Operator):
        def wait(self, timeout_s: float) -> bool:
            raise KeyboardInterrupt

    operator = Quitter(APPROACHING_MS)
    done = perform("open", mission_for("lena"), geometric=True, arrange=operator.arrange, pause=operator)
    assert done.report.ending is Ending.INTERRUPTED
    assert done.simulation.truth.speed_mm_s < 1.0


@pytest.mark.slow
def test_the_time_of_a_pause_does_not_count_as_time_spent_on_a_target(perform, mission_for):
    mission = mission_for("rilakkuma", profile="adaptive")
    spent_s = []
    for for_ms in (0, 300_000):
        operator = Operator(SEARCHING_MS, for_ms) if for_ms else None
        arrange = operator.arrange if operator else lambda _: None
        done = perform(
            "open", mission, geometric=True, arrange=arrange, pause=operator, interrupt_at_s=30 + for_ms / 1000
        )
        spent_s.append(done.of(RecordKind.CHOICE)[0].data["evidence"]["spent_s"])
    assert spent_s[1] == pytest.approx(spent_s[0], abs=2.0)


def test_a_pause_that_is_requested_after_the_end_of_a_mission_does_not_hold_it_up(perform, mission_for):
    class Hasty(Operator):
        def request(self) -> None:
            self.end()
            super().request()

    operator = Hasty(7000)
    faults = LinkFaults(silent_ms=((5000, 100_000),))
    done = perform("open", mission_for("lena"), geometric=True, faults=faults, arrange=operator.arrange, pause=operator)
    assert done.report.ending is Ending.INTERRUPTED
    assert done.report.duration_s < 9.0


def test_a_pause_that_begins_while_the_mission_is_ended_does_not_hold_it_up(perform, mission_for):
    """Two threads may end and pause it at the same time."""

    class Late(Operator):
        def wait(self, timeout_s: float) -> bool:
            self.ended = True
            return super().wait(timeout_s)

    operator = Late(APPROACHING_MS, for_ms=WAIT_MS * 10)
    done = perform("open", mission_for("lena"), geometric=True, arrange=operator.arrange, pause=operator)
    assert done.report.ending is Ending.INTERRUPTED
    assert done.report.duration_s < 2 * WAIT_MS / 1000


def test_a_pause_interrupts_a_skill_once_so_that_its_clean_up_may_use_the_robot():
    pause = Pause()
    with pause.interrupting():
        pause.request()
        with pytest.raises(Paused):
            pause.check()
        pause.check()
