"""The chart shows everything that a mission does: each profile reports it, and the journal shows it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pytest
from random_ports import RandomPorts, two_targets

from behaviors.chart import MISSION_STATES
from behaviors.diagram import arrows
from behaviors.events import Event, Fact, Reason
from behaviors.executive import Ending, Executive
from behaviors.journal import JOURNAL_FORMAT, Record, RecordKind
from behaviors.ports import FloorRay, Glimpse, MotionResult, Ports, Pose, RobotUnreachable, Sighting, StopReason
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.recoveries import Choice
from behaviors.skills import Skill

SAFETY = {("clear", "obstacle", "held"), ("held", "contact", "held"), ("held", "obstacle_gone", "clear")}


def _journal(ports: RandomPorts, **table: object) -> list[Record]:
    records: list[Record] = []
    Executive(two_targets(**table), Ports(ports, ports, ports), [records.append]).run()
    return records


def _taken(records: list[Record]) -> list[tuple[object, object, object]]:
    data = [record.data for record in records if record.kind is RecordKind.TRANSITION]
    return [(each["source"], each["event"], each["to"]) for each in data]


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
def test_a_journal_shows_only_transitions_and_states_of_the_chart(profile, seed):
    records = _journal(RandomPorts(seed), profile=profile, rounds=1 + seed % 2, time_limit_s=20.0)
    assert records[0].data["format"] == JOURNAL_FORMAT
    declared = {(each.source, each.event or None, each.target) for each in arrows()}
    declared.add(("idle", "start", "search"))  # the journal names the state, the chart the compound
    assert set(_taken(records)) <= declared
    assert {record.state for record in records} <= {*MISSION_STATES}


class Facing(RandomPorts):
    """Stands before a target that is always seen, without faults of its own.

    Args:
        distance_mm: The target's apparent distance, one for each frame; the last one stays.
        stops: How the drives end, in order; afterwards nothing stops them.
        breaks: Whether the link breaks in the first drive along the heading.
    """

    def __init__(self, *distance_mm: float, stops: tuple[StopReason, ...] = (), breaks: bool = False) -> None:
        super().__init__(0)
        self._distances = [*distance_mm]
        self._stops = iter(stops)
        self._broken = breaks
        self.driven_mm: list[float] = []

    def _hindrance(self) -> StopReason | None:
        return None

    def _answer(self) -> None:
        """It always answers."""

    def range_mm(self) -> float | None:
        return None

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        return next(self._stops, None)

    def straight(self, distance_mm: float) -> MotionResult:
        self.driven_mm.append(distance_mm)
        if self._broken:
            self._broken = False
            self._pose = Pose(*self._pose.ahead(0.5 * distance_mm))
            raise RobotUnreachable("the brick does not answer")
        self._pose = Pose(*self._pose.ahead(distance_mm))
        return MotionResult(StopReason.DONE, distance_mm, 0.0)

    def glance(self, targets: tuple[str, ...] | list[str]) -> Glimpse:
        self.sleep(0.1)
        at_mm = self._distances.pop(0) if len(self._distances) > 1 else self._distances[0]
        seen = {name: Sighting(name, 0.0, at_mm, 1.0, self._now_s, (100, 80, 40, 56)) for name in targets}
        return Glimpse(self._now_s, seen)

    def free_floor(self, free_at_s: float | None) -> Sequence[FloorRay]:
        return ()


def _states(records: list[Record]) -> Iterator[str]:
    """Yield the states of the mission region, each once."""
    last = ""
    for record in records:
        if record.state != last:
            yield (last := record.state)


def test_a_robot_that_stands_in_front_of_a_doubtful_target_verifies_it():
    records = _journal(Facing(300.0), targets=["a"], time_limit_s=30.0)
    assert list(_states(records)) == ["idle", "search", "arrive", "verify", "reached", "finished"]


def test_a_target_that_moves_off_while_it_is_verified_is_followed():
    records = _journal(Facing(300.0, 300.0, 300.0, *[900.0] * 30, 300.0), targets=["a"], time_limit_s=30.0)
    assert list(_states(records))[2:6] == ["arrive", "verify", "arrive", "verify"]


def test_the_sonar_that_contradicts_the_size_is_a_mistake_about_the_target():
    class Before(Facing):
        def range_mm(self) -> float | None:
            return 1500.0

    records = _journal(Before(300.0), targets=["a"], time_limit_s=5.0)
    assert ("verify", "mistaken", "select") in _taken(records)


@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
def test_every_profile_reports_what_the_safety_stop_does(profile):
    ports = Facing(900.0, stops=(StopReason.OBSTACLE, StopReason.CONTACT))
    assert {*_taken(_journal(ports, profile=profile, targets=["a"], time_limit_s=20.0))} >= SAFETY


def test_a_contact_on_the_way_leads_through_retreat_to_the_choice():
    records = _journal(Facing(900.0, stops=(StopReason.CONTACT,)), targets=["a"], time_limit_s=1.0)
    taken = [each for each in _taken(records) if each[2] in ("held", "clear", "retreat", "select")]
    assert taken[:5] == [
        ("clear", "obstacle", "held"),
        ("held", "contact", "held"),
        ("arrive", "backing_off", "retreat"),
        ("held", "obstacle_gone", "clear"),
        ("retreat", "arrive_failed", "select"),
    ]


def test_a_retreat_that_an_outage_cuts_short_is_completed():
    ports = Facing(900.0, stops=(StopReason.CONTACT,), breaks=True)
    records = _journal(ports, targets=["a"], time_limit_s=1.0)
    assert list(_states(records))[2:7] == ["arrive", "retreat", "suspended", "retreat", "select"]
    assert ports.driven_mm == [-80.0, -40.0]
    replies = [
        record.data["value"] for record in records if record.kind is RecordKind.REPLY and record.state == "retreat"
    ]
    assert replies == [2]


def test_a_target_with_another_round_is_left_and_in_the_last_one_given_up():
    class Nothing(Facing):
        def glance(self, targets: tuple[str, ...] | list[str]) -> Glimpse:
            self.sleep(0.1)
            return Glimpse(self._now_s, {})

    records = _journal(Nothing(0.0), targets=["a"], profile="thesis", rounds=2, time_limit_s=900.0)
    decided = [each for each in _taken(records) if each[2] in ("left", "gave_up")]
    assert decided == [("select", None, "left"), ("select", None, "gave_up")]


class Dawdling(AdaptiveProfile):
    """A profile whose skill goes on and on, and does not check the time."""

    def skill(self, state: str, choice: Choice | None) -> Skill:
        return self

    def call(self) -> Fact:
        clock = self._perception.context.clock
        clock.sleep(1.0)
        assert clock.now() < 60.0
        return Fact(Event.CONTINUED, Reason.DRIVING_ON)


def test_the_time_limit_holds_for_a_skill_that_does_not_check_it():
    ports = Facing(1000.0)
    report = Executive(two_targets(time_limit_s=20.0), Ports(ports, ports, ports), make_profile=Dawdling).run()
    assert (report.ending, report.duration_s) == (Ending.TIME_UP, 20.0)


class Blinking(Facing):
    """Its target is in view only between some times, in seconds."""

    def __init__(self, *spans_s: tuple[float, float]) -> None:
        super().__init__(1000.0)
        self._spans_s = spans_s

    def glance(self, targets: tuple[str, ...] | list[str]) -> Glimpse:
        glimpse = super().glance(targets)
        seen = any(begin_s <= self.now() < end_s for begin_s, end_s in self._spans_s)
        return glimpse if seen else Glimpse(glimpse.time_s, {})


def _known(profile: str, *spans_s: tuple[float, float]) -> Iterator[tuple[object, object, object]]:
    """Yield what the choices of a mission are based on: failure, whether the target was seen, and further searches."""
    for record in _journal(Blinking(*spans_s), targets=["a"], profile=profile, time_limit_s=60.0):
        if record.kind is RecordKind.CHOICE:
            known = record.data["evidence"]
            yield known["reason"], known["seen_since_search"], known["researches"]


def test_each_search_begins_with_a_target_that_was_not_seen():
    assert list(_known("thesis", (0.0, 3.0))) == [
        ("target_lost", True, 0),
        ("full_turn_without_sighting", False, 1),
        ("full_turn_without_sighting", False, 2),
    ]


def test_a_target_that_is_found_by_a_recovery_was_searched_for_again():
    assert list(_known("adaptive", (0.0, 1.0), (6.0, 9.0)))[:2] == [("target_lost", True, 0), ("target_lost", True, 1)]


def test_each_target_has_searches_of_its_own_and_the_time_of_its_end():
    ports, records = Blinking(), []
    mission = two_targets(profile="thesis", time_limit_s=300.0)
    report = Executive(mission, Ports(ports, ports, ports), [records.append]).run()
    choices = [record for record in records if record.kind is RecordKind.CHOICE]
    researches = [(each.target, each.data["evidence"]["researches"]) for each in choices]
    assert researches == [("a", 0), ("a", 1), ("a", 2), ("b", 0), ("b", 1), ("b", 2)]
    assert [each.time_s for each in report.targets] == pytest.approx([choices[2].time_s, choices[5].time_s], abs=0.001)
    assert [each.attempts for each in report.targets] == [3, 3]


class Away(Facing):
    """Its brick is away between two times, in seconds, of which every other sleep gives notice."""

    def __init__(self, begin_s: float, end_s: float, *, refused: bool = False) -> None:
        super().__init__(300.0)
        self._begin_s, self._end_s, self._refused = begin_s, end_s, refused
        self._sleeps = 0

    def _answer(self) -> None:
        if self._begin_s <= self.now() < self._end_s:
            raise RobotUnreachable("the brick is away", refused=self._refused)

    def sleep(self, duration_s: float) -> None:
        super().sleep(duration_s)
        self._sleeps += 1
        if self._sleeps % 2:
            self._answer()


def test_an_outage_is_noted_at_once_and_then_every_five_seconds():
    records = _journal(Away(0.0, 12.0), targets=["a"], reconnect_timeout_s=30.0, time_limit_s=60.0)
    noted = [record for record in records if record.kind is RecordKind.OUTAGE]
    assert [record.time_s for record in noted] == pytest.approx([0.0, 5.0, 10.0], abs=0.5)
    assert [record.data["left_s"] + record.time_s for record in noted] == pytest.approx([30.0] * 3, abs=0.5)
    assert records[-1].data["ending"] == "achieved"


@pytest.mark.parametrize("refused", [True, False])
def test_a_report_says_whether_a_brick_that_refuses_ended_the_mission(refused):
    ports = Away(0.0, 60.0, refused=refused)
    report = Executive(two_targets(reconnect_timeout_s=2.0), Ports(ports, ports, ports)).run()
    assert (report.ending, report.refused) == (Ending.LINK_LOST, refused)
