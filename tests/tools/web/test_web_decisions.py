"""The decisions of a mission as the page shows them, by the code that explains a run."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from behaviors.events import Reason
from behaviors.evidence import Detour, Evidence, Viewpoint
from behaviors.failures import Blocker
from behaviors.journal import Record, RecordKind, plain
from behaviors.operator import OperatorChoice
from behaviors.profiles.registry import make_policy
from behaviors.recoveries import CHANGE_TARGET, Candidate, Choice
from nxtdrive.mission.files import read_mission_file
from nxtdrive.recording.run_reader import read_run
from nxtdrive.tools.web.decisions import candidate, decisions_of, made

KNOWN = Evidence(
    "lena",
    Reason.LOST_BEHIND,
    True,
    0,
    blocker=Blocker(500.0, 0.0, moving=True, hides=True),
    detour=Detour(30.0, ((900.0, 400.0),)),
    here=Viewpoint(0.0, 8.0, 0.5),
)


def _choice(profile: str) -> tuple[Record, Choice]:
    policy = make_policy(profile, read_mission_file(None))
    choice = policy.select(KNOWN)
    data = plain({**choice.record(), "evidence": KNOWN.known()})
    return Record(12.5, RecordKind.CHOICE, "select", "lena", data), choice


def test_a_decision_shows_its_cause_its_candidates_and_the_choice():
    record, choice = _choice("adaptive")
    shown = made(record, make_policy("adaptive", read_mission_file(None)))
    assert (shown["t"], shown["target"]) == (12.5, "lena")
    assert shown["failed"] == "something came between the robot and it"
    assert shown["choice"] == choice.words()
    assert len(shown["candidates"]) > 1
    assert shown["candidates"][shown["chosen"]]["text"] == choice.words()
    cheapest = min(shown["candidates"], key=lambda each: each["expected_s"])
    assert cheapest["text"] == choice.words()
    assert any("in the way" in line for line in shown["known"])


def test_a_replay_shows_what_each_candidate_would_have_cost(tmp_path):
    record, choice = _choice("adaptive")
    (tmp_path / "journal.jsonl").write_text(record.to_json() + "\n")
    words = [each["text"] for each in made(record, make_policy("adaptive", read_mission_file(None)))["candidates"]]
    proposed = [choice.words(), *(text for text in words if text != choice.words()), "leave this target"]
    costs = {text: [10.0 * number, 10.0 * number - 1, 10.0 * number + 1] for number, text in enumerate(proposed, 1)}
    told = [
        {"does": text, "chosen": text == choice.words(), "best": text == words[1], "cost_s": costs[text]}
        for text in proposed
    ]
    costly = {
        **{"decision": 1, "t": 12.5, "target": "lena", "reason": "obstacle_ahead", "futures": 2, "regret_s": 2.0},
        **{"biased_regret_s": 2.5, "beyond_best_s": [0.0, 0.0, 0.0], "candidates": told},
    }
    (tmp_path / "what-if.json").write_text(json.dumps({"decisions": [costly]}))
    (shown,) = decisions_of(read_run(tmp_path))
    assert {each["text"]: each["cost_s"] for each in shown["candidates"]} == costs
    assert [each["text"] for each in shown["candidates"] if each["best"]] == [words[1]]
    assert shown["candidates"][shown["chosen"]]["text"] == choice.words()
    assert "regret 2.0 s" in shown["what_if"]


def test_a_rule_that_weighs_nothing_shows_no_candidates():
    record, choice = _choice("thesis")
    shown = made(record, make_policy("thesis", read_mission_file(None)))
    assert (shown["choice"], shown["candidates"], shown["chosen"]) == (choice.words(), [], None)


@pytest.mark.parametrize("data", [{}, {"choice": "fly", "why": "it can", "evidence": {"reason": "bored"}}])
def test_a_decision_of_another_version_is_shown_as_far_as_it_is_understood(data):
    shown = made(
        Record(1.0, RecordKind.CHOICE, "select", "lena", data), make_policy("adaptive", read_mission_file(None))
    )
    assert shown["choice"] == data.get("choice", "")
    json.dumps(shown, allow_nan=False)


def test_a_replay_has_the_decisions_of_its_journal():
    journal = Path(__file__).parents[2] / "nxtdrive/cli/journals/format-1.jsonl"
    run = read_run(journal)
    shown = decisions_of(run)
    assert [each["t"] for each in shown] == [each.time_s for each in run.records if each.kind is RecordKind.CHOICE]
    assert all(each["choice"] for each in shown)


@pytest.mark.parametrize(("seconds", "chance"), [(math.inf, 0.5), (10.0, 0.0)])
def test_a_time_without_end_is_reported_in_json(seconds, chance):
    choice = Choice(CHANGE_TARGET, "for a test")
    shown = candidate(OperatorChoice(choice, Candidate(choice, seconds, chance)))
    assert shown["expected_s"] is None
    json.dumps(shown, allow_nan=False)
