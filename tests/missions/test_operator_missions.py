"""Missions in which a person has the last word, and how a journal explains a mission."""

from __future__ import annotations

import pytest

from behaviors.executive import Ending
from behaviors.journal import RecordKind
from behaviors.profiles.registry import make_policy
from behaviors.recoveries import CHANGE_TARGET, WAIT
from nxtdrive.recording.decisions import DecisionResult, decisions, replay, weighed_by

UNUSUAL = {
    "thesis": {"wait_s": 4.0, "turn_deg": 45.0, "max_researches": 1},
    "adaptive": {"search_budget_s": 20.0, "repeats": 1, "fixed_wait_s": 3.0},
}


@pytest.mark.slow
@pytest.mark.parametrize("profile", list(UNUSUAL))
@pytest.mark.parametrize("world", ["figure5", "figure6"])
def test_every_choice_follows_from_the_evidence_in_the_journal_and_the_missions_numbers(
    perform, mission_for, profile, world
):
    mission = mission_for("lena", profile=profile, **UNUSUAL[profile])
    made = decisions(perform(world, mission, geometric=True).records)
    policy = make_policy(profile, mission)
    assert made
    for decision in made:
        assert decision.outcome.result is not DecisionResult.OPEN
        again = replay(policy, decision)
        assert again.choice is not None
        assert not again.differs
        if profile == "adaptive":
            assert weighed_by(policy, decision)


def test_what_the_operator_chooses_is_done_and_both_are_in_the_journal(perform, mission_for):
    def wait_first(due):
        wanted = CHANGE_TARGET if due.evidence.researches else WAIT
        return next(each.choice for each in due.candidates if each.choice.kind is wanted)

    done = perform("figure5", mission_for("lena", wait_s=2.0), geometric=True, ask=wait_first)
    first = done.of(RecordKind.CHOICE)[0].data
    assert (first["choice"], first["operator"]) == ("wait", True)
    assert first["proposed"]["choice"] == "move_to"
    assert [record.data["choice"] for record in done.of(RecordKind.CHOICE)] == ["wait", "change_target"]
    ((begun_s, ended_s),) = done.in_state("wait")
    assert ended_s - begun_s == pytest.approx(2.0, abs=0.1)


def test_confirming_everything_changes_nothing_but_the_journal(perform, mission_for):
    asked = []

    def confirm(due):
        asked.append(due.evidence.reason)
        return due.proposed

    plain = perform("figure6", mission_for("lena"), geometric=True)
    confirmed = perform("figure6", mission_for("lena"), geometric=True, ask=confirm)
    assert asked
    assert confirmed.report.duration_s == plain.report.duration_s
    assert [record.data["operator"] for record in confirmed.of(RecordKind.CHOICE)] == [True] * len(asked)
    assert not any("proposed" in record.data for record in confirmed.of(RecordKind.CHOICE))


def test_an_operator_who_stops_the_mission_is_reported_like_ctrl_c(perform, mission_for):
    def stop(_due):
        raise KeyboardInterrupt

    done = perform("figure5", mission_for("lena"), geometric=True, ask=stop)
    assert done.report.ending is Ending.INTERRUPTED
    assert not done.of(RecordKind.CHOICE)
    assert done.records[-1].kind is RecordKind.END
    assert done.simulation.truth.speed_mm_s < 1.0
