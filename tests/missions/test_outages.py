"""Outages of link, camera and sensors suspend a mission, which then goes on; only one that lasts too long ends it."""

from __future__ import annotations

import pytest

from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import RecordKind
from sim_backend.devices.digital import UltrasonicSensor
from sim_backend.link import LinkFaults
from tests.small_mission import with_table

PROFILES = pytest.mark.parametrize("profile", ["thesis", "adaptive"])
SEARCHING_S, APPROACHING_S = 1.0, 7.0
"""Moments of a mission in world open."""
FOREVER_S = 10**6


def _camera_away(from_s, for_s):
    def arrange(simulation):
        simulation.webcam.unplugged_ms = ((round(from_s * 1000), round((from_s + for_s) * 1000)),)

    return arrange


@PROFILES
@pytest.mark.parametrize("away_s", [3.0, 20.0])
@pytest.mark.parametrize("moment_s", [SEARCHING_S, APPROACHING_S])
def test_a_mission_outlasts_a_camera_that_is_away(perform, mission_for, profile, moment_s, away_s):
    done = perform("open", mission_for("lena", profile=profile), geometric=True, arrange=_camera_away(moment_s, away_s))
    assert done.report.achieved
    (lost,) = done.of(RecordKind.TRANSITION, to="suspended")
    (back,) = done.of(RecordKind.TRANSITION, event="camera_back", to="up")
    assert [each.time_s for each in done.of(RecordKind.TRANSITION, to="blind")] == [lost.time_s]
    assert [each.time_s for each in done.of(RecordKind.TRANSITION, to="seeing")] == [back.time_s]
    assert lost.time_s == pytest.approx(moment_s, abs=1.5)
    assert back.time_s == pytest.approx(moment_s + away_s, abs=1.5)
    assert [record.data["reason"] for record in done.of(RecordKind.TRANSITION, to="down")] == [Reason.CAMERA_LOST]
    stood = [pose[:2] for _, pose, _ in done.between(lost.time_s + 1.0, back.time_s)]
    assert all(place == stood[0] for place in stood)
    assert not done.of(RecordKind.CHOICE), "it goes on with what it was doing"


@pytest.mark.nightly
@PROFILES
def test_a_mission_with_detectors_outlasts_it_too(perform, mission_for, profile):
    done = perform("open", mission_for("lena", profile=profile), arrange=_camera_away(APPROACHING_S, 4.0))
    assert done.report.achieved
    assert done.of(RecordKind.TRANSITION, event="camera_back")


@PROFILES
def test_a_camera_that_stays_away_ends_the_mission_in_good_order(perform, mission_for, profile):
    mission = with_table(mission_for("lena", profile=profile), "mission", reconnect_timeout_s=12.0)
    done = perform("open", mission, geometric=True, arrange=_camera_away(APPROACHING_S, FOREVER_S))
    assert done.report.ending is Ending.CAMERA_LOST
    assert "camera" in done.report.error
    assert done.report.duration_s == pytest.approx(APPROACHING_S + 12.0, abs=2.0)
    assert done.records[-1].data["ending"] == "camera_lost"
    assert done.simulation.truth.speed_mm_s < 1.0


@PROFILES
def test_a_brick_that_answers_nonsense_is_a_lost_link(perform, mission_for, profile):
    faults = LinkFaults(corrupt_replies=range(300, 320))
    done = perform("open", mission_for("lena", profile=profile), geometric=True, faults=faults)
    assert done.report.achieved
    assert done.of(RecordKind.TRANSITION, to="suspended")
    assert done.of(RecordKind.TRANSITION, event="link_back")


@pytest.mark.slow
@pytest.mark.parametrize("during", ["turn", pytest.param("advance", marks=pytest.mark.nightly)])
def test_an_interrupted_move_to_is_completed(perform, mission_for, during):
    """The thesis's move_to turns 90 degrees and advances 1.5 m, whatever comes between."""
    mission = mission_for("rilakkuma", max_researches=1, advances=3)
    begun = perform("open", mission, geometric=True).of(RecordKind.CALL, verb="move_to")[0].time_s
    moment_ms = round((begun + (0.6 if during == "turn" else 2.6)) * 1000)
    whole, cut = (
        perform("open", mission, geometric=True, faults=faults)
        for faults in (LinkFaults(), LinkFaults(silent_ms=((moment_ms, moment_ms + 4000),)))
    )
    assert not whole.of(RecordKind.TRANSITION, to="suspended")
    assert [record.state for record in cut.of(RecordKind.TRANSITION, event="resume")] == ["move_to"]
    (turn,) = cut.of(RecordKind.STEP, what="turn")
    assert turn.data["turned_deg"] == pytest.approx(90.0, abs=2.0)
    advances = cut.of(RecordKind.STEP, what="advance")
    assert [record.data["distance_mm"] for record in advances] == [pytest.approx(150.0, abs=10.0)] * 3
    ends = [done.of(RecordKind.STEP, what="advance")[-1].data["pose"] for done in (whole, cut)]
    assert ends[1] == pytest.approx(ends[0], abs=20.0)


def test_an_interrupted_search_continues_at_the_stop_where_it_was(perform, mission_for):
    mission = mission_for("rilakkuma", max_researches=0)
    whole, cut = (
        perform("open", mission, geometric=True, faults=faults)
        for faults in (LinkFaults(), LinkFaults(silent_ms=((8000, 12_000),)))
    )
    assert cut.of(RecordKind.TRANSITION, event="resume")
    assert len(cut.of(RecordKind.LOOK)) == len(whole.of(RecordKind.LOOK))
    headings = [[look.data["pose"][2] for look in done.of(RecordKind.LOOK)] for done in (whole, cut)]
    assert headings[1] == pytest.approx(headings[0], abs=2.0)


def _sonar_out(from_s, back_s=None):
    def arrange(simulation):
        sonar = simulation.brick.low_speed.channels[3].bus.sensor.device
        simulation.at(round(from_s * 1000), lambda: simulation.brick.attach_sensor(4, None))
        if back_s is not None:
            simulation.at(round(back_s * 1000), lambda: simulation.brick.attach_sensor(4, sonar))

    return arrange


def _speeds(done, since_s):
    return [speed for time_s, _, speed in done.track if time_s > since_s]


@PROFILES
@pytest.mark.parametrize("moment_s", [0.0, SEARCHING_S, APPROACHING_S])
def test_a_sonar_that_is_pulled_out_slows_the_robot_and_no_more(perform, mission_for, profile, moment_s):
    mission = mission_for("lena", profile=profile)
    cruise_mm_s = getattr(mission, profile).cruise_mm_s
    done = perform("open", mission, geometric=True, arrange=_sonar_out(moment_s))
    assert done.report.achieved
    (lost,) = done.of(RecordKind.SENSOR)
    assert (lost.data["sensor"], lost.data["answers"]) == ("sonar", False)
    assert "cable" in lost.data["error"]
    assert max(_speeds(done, lost.time_s + 1.0)) < 0.6 * cruise_mm_s
    assert all(look.data["range_mm"] is None for look in done.of(RecordKind.LOOK) if look.time_s > lost.time_s)


class _Repeating:
    """A sonar that says one distance wherever it looks."""

    def __init__(self, sonar, distance_cm):
        self._sonar, self._distance_cm, self._register = sonar, distance_cm, 0
        self.address = sonar.address

    def write(self, data):
        self._register = data[0] if data else self._register
        self._sonar.write(data)

    def read(self, size):
        answer = self._sonar.read(size)
        return bytes([self._distance_cm] * size) if self._register in UltrasonicSensor.DISTANCES else answer

    def give_back(self, count):
        self._sonar.give_back(count)


@pytest.mark.slow
@pytest.mark.parametrize("distance_cm", [5, 20])
@pytest.mark.parametrize("moment_s", [0.0, APPROACHING_S])
def test_a_sonar_that_repeats_a_near_echo_everywhere_does_not_hold_the_robot(
    perform, mission_for, moment_s, distance_cm
):
    def arrange(simulation):
        sonar = _Repeating(simulation.brick.low_speed.channels[3].bus.sensor.device, distance_cm)
        simulation.at(round(moment_s * 1000), lambda: simulation.brick.attach_sensor(4, sonar))

    mission = mission_for("lena", profile="adaptive")
    done = perform("open", mission, geometric=True, arrange=arrange)
    assert done.report.achieved
    (lost,) = done.of(RecordKind.SENSOR)
    assert lost.data["sensor"] == "sonar"
    assert f"{10 * distance_cm} mm wherever the robot turns" in lost.data["error"]
    speeds = sorted(_speeds(done, lost.time_s + 1.0))
    assert speeds[round(0.9 * len(speeds))] < 0.6 * mission.adaptive.cruise_mm_s, "but for backing off"


@PROFILES
def test_a_sonar_that_is_back_is_used_again(perform, mission_for, profile):
    done = perform("open", mission_for("lena", profile=profile), geometric=True, arrange=_sonar_out(1.0, 4.0))
    assert [record.data["answers"] for record in done.of(RecordKind.SENSOR)] == [False, True]
    back_s = done.of(RecordKind.SENSOR)[-1].time_s
    assert any(look.data["range_mm"] is not None for look in done.of(RecordKind.LOOK) if look.time_s > back_s)


@PROFILES
def test_without_any_safety_sensor_it_waits_and_then_ends_with_a_sentence(perform, mission_for, profile):
    mission = with_table(mission_for("lena", profile=profile), "robot", touch=0)
    done = perform("open", mission, geometric=True, arrange=_sonar_out(APPROACHING_S))
    assert done.report.ending is Ending.SENSOR_LOST
    assert "sonar" in done.report.error
    (lost,) = done.of(RecordKind.TRANSITION, to="suspended")
    assert done.report.duration_s - lost.time_s == pytest.approx(30.0, abs=1.0)
    done = perform("open", mission, geometric=True, arrange=_sonar_out(APPROACHING_S, APPROACHING_S + 8.0))
    assert done.report.achieved
    assert done.of(RecordKind.TRANSITION, event="sensor_back")


@PROFILES
def test_a_compass_that_is_not_there_leaves_the_wheels(perform, mission_for, profile):
    mission = with_table(mission_for("lena", profile=profile), "robot", compass=2)
    done = perform("open", mission, geometric=True)
    assert done.report.achieved
    assert [record.data["sensor"] for record in done.of(RecordKind.SENSOR)] == ["compass"]


def test_a_dead_bumper_leaves_the_sonar(perform, mission_for):
    mission = with_table(mission_for("lena"), "robot", touch=2)
    done = perform("open", mission, geometric=True, arrange=lambda sim: sim.brick.attach_sensor(2, None))
    assert done.report.achieved


@PROFILES
def test_two_missions_with_one_outage_write_the_same_journal(perform, mission_for, profile):
    journals = [
        [record.to_json() for record in done.records]
        for done in (
            perform(
                "open",
                mission_for("lena", profile=profile),
                geometric=True,
                faults=LinkFaults(silent_ms=((3000, 6000),)),
                arrange=_sonar_out(5.0, 8.0),
            )
            for _ in range(2)
        )
    ]
    assert journals[0] == journals[1]


@PROFILES
def test_an_observer_that_fails_as_a_lost_link_would_is_none(perform, mission_for, profile):
    def leave(record):
        raise BrokenPipeError("nobody reads")

    done = perform("open", mission_for("lena", profile=profile), geometric=True, observer=leave)
    assert done.report.achieved
    assert not done.of(RecordKind.TRANSITION, to="suspended")
    assert list(done.report.observer_failures.values()) == ["nobody reads"]
