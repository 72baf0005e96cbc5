"""However a mission ends, the robot is at rest and the journal gives the reason."""

from __future__ import annotations

import pytest

from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import RecordKind
from sim_backend.link import LinkFaults
from tests.small_mission import with_table


def _at_rest(done) -> bool:
    return done.simulation.truth.speed_mm_s < 1.0


@pytest.mark.parametrize("moment_s", [2.0, 6.03, 9.5])
def test_ctrl_c_stops_the_motors_and_is_reported(perform, mission_for, moment_s):
    done = perform("open", mission_for("lena"), geometric=True, interrupt_at_s=moment_s)
    assert done.report.ending is Ending.INTERRUPTED
    assert _at_rest(done)
    assert done.records[-1].kind is RecordKind.END
    assert any(record.data.get("reason") == Reason.OPERATOR_STOP for record in done.records)


@pytest.mark.parametrize("moment_s", [1.0, 3.5, 8.0])
def test_a_lost_link_ends_the_mission_and_the_robot_stops_by_itself(perform, mission_for, moment_s):
    faults = LinkFaults(unplugged_ms=((round(moment_s * 1000), 10**9),))
    done = perform("open", mission_for("lena"), geometric=True, faults=faults)
    assert done.report.ending is Ending.LINK_LOST
    assert "unplugged" in done.report.error
    assert _at_rest(done), "the tacho limit of the lease has stopped the motors"
    assert [record.data["reason"] for record in done.of(RecordKind.TRANSITION, to="down")] == ["link_lost"]


FOREVER_MS = 10**9


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["thesis", "adaptive"])
@pytest.mark.parametrize("moment_s", [2.0, 3.5, 7.0])
def test_a_link_that_comes_back_resumes_the_mission_where_it_was(perform, mission_for, profile, moment_s):
    lost_ms = round(moment_s * 1000)
    faults = LinkFaults(unplugged_ms=((lost_ms, lost_ms + 12_000),))
    done = perform("open", mission_for("lena", profile=profile), geometric=True, faults=faults, reconnecting=True)
    assert done.report.achieved
    (lost,) = done.of(RecordKind.TRANSITION, to="suspended")
    assert lost.time_s == pytest.approx(moment_s, abs=0.5)
    (back,) = done.of(RecordKind.TRANSITION, to="up")
    assert back.data["reason"] == Reason.LINK_BACK
    assert back.time_s == pytest.approx(moment_s + 12, abs=3)
    assert not done.of(RecordKind.CHOICE), "it drives on to the target it was driving to"
    stood = [pose[:2] for _, pose, _ in done.between(lost.time_s + 1.5, back.time_s)]
    assert all(place == stood[0] for place in stood), "nothing moves while the brick does not answer"
    assert done.simulation.truth.distance_mm("lena") < 600


def test_a_link_that_stays_away_ends_the_mission_after_its_patience(perform, mission_for):
    done = perform(
        "open",
        with_table(mission_for("lena"), "mission", reconnect_timeout_s=20.0),
        geometric=True,
        faults=LinkFaults(unplugged_ms=((8000, FOREVER_MS),)),
        reconnecting=True,
    )
    assert done.report.ending is Ending.LINK_LOST
    (lost,) = done.of(RecordKind.TRANSITION, to="suspended")
    assert done.report.duration_s - lost.time_s == pytest.approx(20.0, abs=1.0)
    assert _at_rest(done)


def test_the_journal_names_an_error_that_has_no_text(perform, mission_for):
    records = []

    def break_down():
        raise AssertionError

    with pytest.raises(AssertionError):
        perform(
            "open",
            mission_for("lena"),
            geometric=True,
            arrange=lambda simulation: simulation.at(2000, break_down),
            observer=records.append,
        )
    assert (records[-1].kind, records[-1].data["error"]) == (RecordKind.END, "AssertionError")


def test_a_mission_without_its_target_is_given_up_not_broken(perform, mission_for):
    done = perform("open", mission_for("rilakkuma", max_researches=0), geometric=True)
    assert done.report.ending is Ending.GIVEN_UP
    assert not done.report.achieved
    assert _at_rest(done)


@pytest.mark.nightly
def test_a_mission_that_sets_no_time_limit_ends_after_ten_minutes(perform, mission_for):
    done = perform(
        "open",
        with_table(mission_for("rilakkuma"), "mission", profile="adaptive", reconnect_timeout_s=3600.0),
        geometric=True,
        faults=LinkFaults(unplugged_ms=((20_000, 570_000),)),  # most of the time, which then takes little to simulate
        reconnecting=True,
    )
    assert done.of(RecordKind.TRANSITION, to="up"), "it goes on with its search"
    assert done.report.ending is Ending.TIME_UP
    assert 600 <= done.report.duration_s < 605
    assert _at_rest(done)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_journal(perform, mission_for):
    first, second = (perform("figure6", mission_for("lena"), geometric=True) for _ in range(2))
    assert [record.to_json() for record in first.records] == [record.to_json() for record in second.records]


@pytest.mark.slow
def test_reaching_is_an_explicit_stop_near_the_target(perform, mission_for):
    done = perform("open", mission_for("lena"))
    assert done.report.achieved
    assert _at_rest(done)
    assert 250 < done.simulation.truth.distance_mm("lena") < 500


@pytest.mark.slow
@pytest.mark.parametrize("limit_s", [1.5, 5.0, 9.0, 30.0, 60.0])
def test_a_time_limit_ends_the_mission_in_any_state_within_two_seconds(perform, mission_for, limit_s):
    mission = with_table(mission_for("lena", "rilakkuma"), "mission", time_limit_s=limit_s)
    done = perform("figure6", mission, geometric=True)
    assert done.report.ending is Ending.TIME_UP
    assert limit_s <= done.report.duration_s <= limit_s + 2.0
    assert _at_rest(done)
    assert [record.data["reason"] for record in done.of(RecordKind.TRANSITION, event="abort")] == [Reason.TIME_UP]
