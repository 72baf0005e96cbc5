"""How often choices succeed is learned from counts, and rare situations borrow from common ones."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.attempts import Attempts
from behaviors.adaptive.chances import ESTIMATES, Chances, shipped
from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.events import Reason
from behaviors.evidence import Detour, Evidence, Viewpoint
from behaviors.failures import Blocker
from behaviors.mission import MissionError, load_mission
from behaviors.recoveries import CHANGE_TARGET, DETOUR, MOVE_TO, RECOVERIES, RESCAN, WAIT

EVIDENCE = Evidence("a", Reason.NEVER_SEEN, seen_since_search=False, researches=0)
REASONS = sorted(Reason)


def test_without_counts_a_chance_is_that_of_the_world_model():
    for estimate in (0.0, 0.02, 0.05, 0.1, 0.15, 0.3, 0.5):
        assert Chances({}).of(RESCAN, EVIDENCE, estimate)[0] == pytest.approx(estimate)


def test_many_outcomes_decide_and_few_hardly_count():
    many = Chances({"rescan/0.15/never_seen/0": [800, 200]})
    assert many.of(RESCAN, EVIDENCE, 0.15) == (pytest.approx(0.8, abs=0.01), "rescan/0.15/never_seen/0")
    few = Chances({"rescan/0.15/never_seen/0": [800, 200], "rescan/0.15/target_lost/0": [0, 1]})
    assert 0.5 < few.of(RESCAN, replace(EVIDENCE, reason=Reason.TARGET_LOST), 0.15)[0] < 0.8
    assert many.of(RESCAN, replace(EVIDENCE, reason=Reason.UNCERTAIN, tries=3), 0.15)[0] > 0.7
    assert many.of(MOVE_TO, EVIDENCE, 0.15)[0] == 0.15


def test_candidates_of_one_kind_keep_the_ratio_of_their_estimates():
    chances = Chances({f"move_to/{estimate}/never_seen/0": [700, 300] for estimate in (0.05, 0.15, 0.5)})
    best, worse = (chances.of(MOVE_TO, EVIDENCE, estimate, 0.4)[0] for estimate in (0.4, 0.1))
    assert best == pytest.approx(0.7, abs=0.01)
    assert worse == pytest.approx(best / 4)
    assert chances.of(MOVE_TO, EVIDENCE, 0.0, 0.0)[0] == 0.0


def test_outcomes_of_hopeless_looks_say_nothing_of_better_ones():
    """After many looks in vain most estimates are around 0.01, and their failures outnumber all others."""
    counts = {"move_to/0.01/never_seen/8": [20, 980], "move_to/0.05/never_seen/8": [16, 84]}
    late = replace(EVIDENCE, tries=20)
    for estimate, chance in ((0.01, 0.02), (0.05, 0.16)):
        assert Chances(counts).of(MOVE_TO, late, estimate)[0] == pytest.approx(chance, abs=0.01)
    assert Chances(counts).of(MOVE_TO, late, 0.012)[1] == "move_to/0.01/never_seen/8"


def test_outcomes_of_own_runs_count_where_they_were_met():
    counts = {"detour/0.5/blocked_long/0": [900, 100], "detour/0.5/blocked_short/0": [900, 100]}
    own = Chances(counts, {"detour/0.5/blocked_long/0": [0, 20]})
    chances = {
        reason: own.of(DETOUR, replace(EVIDENCE, reason=reason), 0.5)[0]
        for reason in (Reason.BLOCKED_LONG, Reason.BLOCKED_SHORT)
    }
    assert chances[Reason.BLOCKED_LONG] == pytest.approx(0.3, abs=0.01)
    assert chances[Reason.BLOCKED_SHORT] == pytest.approx(0.9, abs=0.01)


@given(st.sampled_from(sorted(RECOVERIES)), st.sampled_from(REASONS), st.integers(0, 50), st.floats(0.0, 1.0))
def test_the_counts_that_come_with_it_give_a_probability_everywhere(name, reason, tries, estimate):
    chance, situation = Chances(shipped()).of(RECOVERIES[name], replace(EVIDENCE, reason=reason, tries=tries), estimate)
    assert 0.0 <= chance < 1.0
    assert situation.startswith(name)
    assert situation.split("/")[2] == reason


def test_the_counts_that_come_with_it_are_of_known_choices_and_failures():
    for situation, outcomes in shipped().items():
        choice, estimate, reason, tries = situation.split("/")
        assert choice in RECOVERIES
        assert Reason(reason)
        assert float(estimate) in ESTIMATES
        assert int(tries) >= 0
        assert len(outcomes) == 2


def test_choices_without_an_approach_are_counted_until_one_begins():
    attempts = Attempts()
    for recovery in (RESCAN, MOVE_TO):
        attempts.chose("a", recovery.name, (0.0, 0.0))
    attempts.chose("b", CHANGE_TARGET.name, (0.0, 0.0))
    assert (attempts.tries("a"), attempts.tries("b"), attempts.tries("c")) == (2, 1, 0)
    attempts.approached("a")
    assert (attempts.tries("a"), attempts.tries("b")) == (0, 1)


def test_a_wait_that_fails_costs_the_detour_that_follows():
    person = Blocker(400.0, 0.0, moving=True, hides=True)
    known = replace(EVIDENCE, reason=Reason.BLOCKED_SHORT, blocker=person, detour=Detour(25.0, ((9.0, 9.0),)))
    wait, detour = AdaptivePolicy(chances=Chances({})).candidates(known)
    assert (wait.choice.kind, detour.choice.kind) == (WAIT, DETOUR)
    assert detour.expected_s == pytest.approx(50.0)
    assert wait.expected_s == pytest.approx(wait.seconds + (1.0 - wait.chance) * 50.0)


MISSION = """\
[mission]
targets = ["a"]
[target.a]
detector = "color"
color = "red"
[adaptive]
chances = "own.json"
"""


def test_a_mission_names_the_counts_of_own_runs(tmp_path):
    (tmp_path / "m.toml").write_text(MISSION)
    counts = {"rescan/0.15/never_seen/0": [0, 1000]}
    (tmp_path / "own.json").write_text(json.dumps({"sources": [], "counts": counts}))
    mission = load_mission(tmp_path / "m.toml")
    assert mission.adaptive.chances == counts
    here = replace(EVIDENCE, here=Viewpoint(0.0, 8.0, 0.15))
    (own,) = AdaptivePolicy(mission.adaptive).candidates(here)
    (usual,) = AdaptivePolicy().candidates(here)
    assert own.chance < 0.05 < usual.chance


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, r"chances: .*own\.json: cannot be read \(No such file"),
        ("no JSON", "chances: 'own.json', beside the mission file, is not from nxtdrive chances --out$"),
        ("{}", "is not from nxtdrive chances --out$"),
        ("[1, 2]", "is not from nxtdrive chances --out$"),
        ('{"counts": {"wait": [1, -1]}}', "chances"),
        ('{"counts": [3]}', "chances"),
    ],
)
def test_a_mission_with_a_bad_file_of_counts_is_refused(tmp_path, text, said):
    (tmp_path / "m.toml").write_text(MISSION)
    if text is not None:
        (tmp_path / "own.json").write_text(text)
    with pytest.raises(MissionError, match=said):
        load_mission(tmp_path / "m.toml")
