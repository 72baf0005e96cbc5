"""Waiting out what fails, and pauses, by themselves: the robot stands, and time limits hold."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from random_ports import RandomPorts

from behaviors.mission import ThesisParameters
from behaviors.outages import OutageSupervisor
from behaviors.pause import Pause, Paused
from behaviors.ports import CameraLost, Outage, RobotUnreachable, SensorLost
from behaviors.skills import SkillContext, TimeUp

START_S, TIMEOUT_S = 1000.0, 30.0
OUTAGES = {
    "link": RobotUnreachable("the brick does not answer"),
    "camera": CameraLost("no pictures"),
    "sensor": SensorLost("the sonar does not answer"),
}


class Robot(RandomPorts):
    """A robot with parts that fail for some time.

    Args:
        for_s: For how long, by the name of the part; `clock` for sleeping.

    Attributes:
        stopped_s: When it was stopped, since the start.
        kept_alive: How often it was.
        drove_on: Whether it drove during a wait.
    """

    def __init__(self, **for_s: float) -> None:
        super().__init__(0)
        self._hinders = self._breaks = 0.0
        self._now_s, self._for_s = START_S, for_s
        self.stopped_s: list[float] = []
        self.kept_alive = 0
        self.drove_on = False

    @property
    def passed_s(self) -> float:
        """How long it has been on."""
        return self.now() - START_S

    def _fails(self, part: str) -> bool:
        return self.passed_s < self._for_s.get(part, 0.0)

    def _check(self, part: str) -> None:
        if self._fails(part):
            raise OUTAGES.get(part, RobotUnreachable("lost"))

    def sleep(self, duration_s: float) -> None:
        self.drove_on |= not self.at_rest
        super().sleep(duration_s)
        self._check("clock")

    def stop(self) -> None:
        super().stop()
        self.stopped_s.append(self.passed_s)
        self._check("stop")

    def keep_alive(self) -> None:
        self.kept_alive += 1

    def battery_mv(self) -> int:
        self._check("link")
        return 8000

    def glance(self, targets):
        self._check("camera")
        return super().glance(targets)

    def range_mm(self) -> float | None:
        self._check("sonar")
        return 500.0

    def touching(self) -> bool:
        self._check("bumper")
        return False

    def can_drive_forward(self) -> bool:
        return not self._fails("sensor")


class Operator(Pause):
    """Ends a pause when the robot's clock has gone on by some seconds; each wait takes what it may take."""

    def __init__(self, robot: Robot, for_s: float, end_s: float = math.inf) -> None:
        super().__init__()
        self._robot, self._left_s, self._end_s = robot, for_s, end_s

    def wait(self, timeout_s: float) -> bool:
        RandomPorts.sleep(self._robot, timeout_s)
        self._left_s -= timeout_s
        if self._robot.passed_s >= self._end_s:
            self.end()
        elif self._left_s <= 0:
            self.resume()
        return super().wait(0.0)


class Bench:
    """A supervisor with a robot.

    Attributes:
        facts: What the chart was told.
        notes: What was written into the journal.
    """

    def __init__(self, robot: Robot, pause: Pause | None = None, limit_s: float = math.inf) -> None:
        self.robot, self.facts, self.notes = robot, [], []
        self.context = SkillContext(
            robot, robot, robot, ThesisParameters(), self._note, self.facts.append, START_S + limit_s, pause or Pause()
        )
        self.supervisor = OutageSupervisor(self.context, TIMEOUT_S)

    def _note(self, kind: str, **data: object) -> None:
        self.notes.append((self.robot.passed_s, kind, data))

    @property
    def events(self) -> list[str]:
        return [str(fact.event) for fact in self.facts]


@pytest.mark.parametrize("part", OUTAGES)
def test_a_part_is_retried_twice_a_second_with_the_robot_at_rest_until_it_works(part):
    bench = Bench(Robot(**{part: 12.0}))
    bench.robot.drive(100.0, 0.0)
    bench.supervisor.wait_out(OUTAGES[part])
    assert bench.events == [f"{part}_lost", f"{part}_back"]
    assert bench.facts[0].measured == {"error": str(OUTAGES[part])}
    assert bench.facts[1].measured["silent_s"] == bench.robot.passed_s == pytest.approx(12.0, abs=0.5)
    assert bench.robot.at_rest
    assert bench.robot.stopped_s[:3] == [0.0, 0.5, 1.0]


@pytest.mark.parametrize(("sensor", "back_s"), [("sonar", 5.0), ("bumper", 7.0)])
def test_a_sensor_that_does_not_answer_does_not_work_again(sensor, back_s):
    bench = Bench(Robot(**{sensor: back_s}))
    bench.supervisor.wait_out(OUTAGES["sensor"])
    assert bench.robot.passed_s == pytest.approx(back_s, abs=0.5)


def test_a_robot_that_cannot_be_stopped_does_not_work_again():
    bench = Bench(Robot(stop=5.0))
    bench.supervisor.wait_out(OUTAGES["camera"])
    assert bench.robot.passed_s >= 5.0


@pytest.mark.parametrize("part", OUTAGES)
def test_an_outage_that_lasts_too_long_is_raised_itself(part):
    bench = Bench(Robot(**{part: 1000.0}))
    with pytest.raises(Outage) as raised:
        bench.supervisor.wait_out(OUTAGES[part])
    assert raised.value is OUTAGES[part]
    assert bench.robot.passed_s == pytest.approx(TIMEOUT_S, abs=0.5)
    assert bench.events == [f"{part}_lost"]
    noted = [(time_s, data["part"], data["left_s"]) for time_s, _, data in bench.notes]
    assert noted == [(time_s, part, TIMEOUT_S - time_s) for time_s in (0.0, 5.0, 10.0, 15.0, 20.0, 25.0)]


def test_an_outage_that_is_permanent_is_not_waited_for():
    class Over(CameraLost):
        permanent = True

    bench, over = Bench(Robot(camera=1000.0)), Over("the video is at its end")
    with pytest.raises(Over):
        bench.supervisor.wait_out(over)
    assert bench.robot.passed_s == 0.0


def test_the_time_limit_of_the_mission_holds_in_an_outage():
    bench = Bench(Robot(link=1000.0), limit_s=8.0)
    with pytest.raises(TimeUp):
        bench.supervisor.wait_out(OUTAGES["link"])
    assert bench.robot.passed_s == pytest.approx(8.0, abs=0.5)


def test_an_operator_ends_a_mission_in_an_outage():
    pause = Pause()
    bench = Bench(Robot(link=1000.0), pause)
    pause.end()
    with pytest.raises(KeyboardInterrupt):
        bench.supervisor.wait_out(OUTAGES["link"])
    assert bench.robot.passed_s == 0.0


def test_a_sleep_that_reports_the_loss_is_no_second_outage():
    bench = Bench(Robot(link=4.0, clock=0.6))
    bench.supervisor.wait_out(OUTAGES["link"])
    assert bench.events == ["link_lost", "link_back"]


def test_a_clock_that_keeps_failing_ends_the_wait_with_the_first_cause():
    bench = Bench(Robot(camera=1000.0, clock=1000.0))
    with pytest.raises(CameraLost):
        bench.supervisor.wait_out(OUTAGES["camera"])
    assert bench.robot.passed_s == pytest.approx(1.0)


def test_work_is_called_again_after_each_outage():
    bench, outages = Bench(Robot()), [OUTAGES["link"], OUTAGES["camera"]]

    def work() -> str:
        if outages:
            raise outages.pop(0)
        return "done"

    assert bench.supervisor.run(work) == "done"
    assert bench.events == ["link_lost", "link_back", "camera_lost", "camera_back"]


def used(robot: Robot, outage: Outage, works_s: float, failures: float = math.inf) -> Callable[[], str]:
    """Return work that fails each time after some time, though its part seems to work when it is retried."""
    calls = 0

    def work() -> str:
        nonlocal calls
        calls += 1
        robot.drive(100.0, 0.0)
        RandomPorts.sleep(robot, works_s)
        if calls > failures:
            return "done"
        assert calls < 1000
        raise outage

    return work


@pytest.mark.parametrize("part", OUTAGES)
def test_a_part_that_works_when_it_is_retried_and_fails_when_it_is_used_ends_the_mission_in_time(part):
    """Such as a brick that refuses one telegram and answers the others."""
    bench = Bench(Robot())
    with pytest.raises(Outage) as raised:
        bench.supervisor.run(used(bench.robot, OUTAGES[part], works_s=0.02))
    assert raised.value is OUTAGES[part]
    assert bench.robot.passed_s == pytest.approx(TIMEOUT_S, abs=1.0)
    assert bench.events.count(f"{part}_lost") < 100
    assert not bench.robot.drove_on


def test_a_part_that_fails_in_use_is_retried_twice_a_second_until_it_works_in_use():
    bench = Bench(Robot())
    assert bench.supervisor.run(used(bench.robot, OUTAGES["link"], works_s=0.02, failures=5)) == "done"
    assert bench.robot.passed_s == pytest.approx(4 * 0.5, abs=0.2)
    assert bench.events == ["link_lost", "link_back"] * 5


def test_outages_of_a_part_that_works_for_a_while_in_between_are_separate():
    bench = Bench(Robot())
    assert bench.supervisor.run(used(bench.robot, OUTAGES["link"], works_s=2.0, failures=30)) == "done"


def test_an_outage_of_another_part_just_after_a_return_is_an_outage_of_its_own():
    bench = Bench(Robot(link=20.0, camera=45.0))
    bench.supervisor.wait_out(OUTAGES["link"])
    bench.supervisor.wait_out(OUTAGES["camera"])
    assert bench.events == ["link_lost", "link_back", "camera_lost", "camera_back"]
    assert bench.robot.passed_s == pytest.approx(45.0, abs=0.5)


@pytest.mark.parametrize("reachable", [True, False])
def test_in_a_pause_the_robot_stands_awake_and_no_limit_counts(reachable):
    robot = Robot(stop=0.0 if reachable else 1000.0)
    operator = Operator(robot, for_s=100.0)
    bench = Bench(robot, operator, limit_s=8.0)
    operator.request()
    robot.drive(100.0, 0.0)
    bench.supervisor.wait_out(Paused("paused"))
    assert bench.events == ["suspend", "resume"]
    assert bench.facts[1].measured == {"paused_s": 100.0}
    assert robot.at_rest
    assert (len(robot.stopped_s), robot.kept_alive) == (200, 200 if reachable else 0)
    assert bench.context.deadline_s == START_S + 108.0
    assert bench.context.pauses == [(START_S, 100.0)]


def test_a_pause_stops_the_clock_of_an_outage():
    robot = Robot(link=1000.0)
    operator = Operator(robot, for_s=100.0)
    bench = Bench(robot, operator)
    operator.request()
    with pytest.raises(RobotUnreachable):
        bench.supervisor.wait_out(OUTAGES["link"])
    assert robot.passed_s == pytest.approx(100.0 + TIMEOUT_S, abs=0.5)


def test_an_operator_ends_a_mission_in_a_pause():
    robot = Robot()
    operator = Operator(robot, for_s=1000.0, end_s=5.0)
    bench = Bench(robot, operator)
    operator.request()
    with pytest.raises(KeyboardInterrupt):
        bench.supervisor.wait_out(Paused("paused"))
    assert robot.passed_s == pytest.approx(5.0, abs=0.5)


def test_a_pause_interrupts_only_where_it_may():
    pause = Pause()
    pause.request()
    pause.check()
    with pytest.raises(Paused), pause.interrupting():
        pytest.fail("it had been requested before")
    pause.check()
    assert pause.wanted
    assert not pause.wait(0.0)
    pause.resume()
    assert not pause.wanted
    assert pause.wait(0.0)
    with pause.interrupting():
        pause.check()
    pause.request()
    pause.check()


def test_a_pause_that_is_requested_while_the_mission_is_ended_is_none():
    pause = Pause()
    pause.request()
    pause.ended = True  # by another thread, after the request has checked it
    assert not pause.wanted


def test_a_mission_that_is_to_end_is_not_paused_any_more():
    pause = Pause()
    pause.request()
    pause.end()
    pause.request()
    assert not pause.wanted
    assert pause.wait(0.0)
    with pytest.raises(KeyboardInterrupt):
        pause.check_end()
    with pytest.raises(KeyboardInterrupt), pause.interrupting():
        pytest.fail("the end had been requested before")
    pause.check()
