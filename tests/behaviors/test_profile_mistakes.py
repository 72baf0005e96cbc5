"""Common mistakes in a profile of another package: each is one sentence with its place in the profile's file."""

from __future__ import annotations

import json
import pickle
import re
import sys

import pytest

from behaviors.events import Reason
from behaviors.evidence import Evidence
from behaviors.mission import MissionError
from behaviors.operator import question
from behaviors.profiles import registry
from behaviors.profiles.registry import find_profile
from behaviors.recoveries import RECOVERIES, WAIT, Choice, Recovery
from behaviors.return_types import WrongReturn, checked
from nxtdrive.cli.main import USAGE, main
from nxtdrive.tools.sweep.task import Task, evaluate

MODULE = """\
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.recoveries import CHANGE_TARGET, WAIT, Candidate, Choice

class {name}(AdaptiveProfile):
    {body}
"""
POLICY = """\
@classmethod
    def own_policy(cls, mission): return Policy()

class Policy:
    def select(self, evidence): return {0}
    def candidates(self, evidence): return {1}
"""


WRONG_RESULT = ". Correct it there."
EXCEPTION = ". Correct it there, or report it to the profile's author."
BLOCKED = Evidence("lena", Reason.BLOCKED_SHORT, seen_since_search=True, researches=0)


@pytest.fixture(autouse=True)
def _folder(monkeypatch, here):
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(registry, "external_profiles", {})
    yield
    sys.modules.pop("mistaken", None)


def _write(folder, body):
    (folder / "mistaken.py").write_text(MODULE.format(name="Mistaken", body=body), encoding="utf-8")


def _error(seed=100):
    return evaluate(Task(0, "block_permanent", seed, "mistaken:Mistaken", "geometric")).error


@pytest.mark.parametrize(
    ("body", "text"),
    [
        (POLICY.format("None", ()), "select() of mistaken:Policy ({file}:9) returned NoneType, not a Choice."),
        (POLICY.format("'wait'", ()), "select() of mistaken:Policy ({file}:9) returned str, not a Choice."),
        (POLICY.format("Choice('wait', 5)", ()), "{file}:9: TypeError: kind must be one of WAIT, DETOUR"),
        (POLICY.format("Choice(WAIT, 'x', wait_s='5')", ()), "{file}:9: TypeError: wait_s must be a number, not '5'"),
        (POLICY.format("Choice(WAIT, 'x', wait_s=-5)", ()), "{file}:9: ValueError: wait_s must be 0 or more, not -5"),
        (
            POLICY.format("Choice(WAIT, 'x', route=(1, 2))", ()),
            "{file}:9: TypeError: route must be places (x_mm, y_mm)",
        ),
        (
            POLICY.format("Choice(WAIT, 'x', route=((0, float('nan')),))", ()),
            "{file}:9: TypeError: route must be places (x_mm, y_mm)",
        ),
        (POLICY.format("Choice(WAIT, 5)", ()), "{file}:9: TypeError: why must be text, not 5"),
        (
            POLICY.format("Choice(CHANGE_TARGET, 'x', instead=3)", ()),
            "{file}:9: TypeError: instead must be text, not 3",
        ),
        (
            POLICY.format("Choice(CHANGE_TARGET, 'x', instead='nobody')", ()),
            "select() of mistaken:Policy ({file}:9) chose the target 'nobody'; this mission has 'rilakkuma', 'lena'.",
        ),
        (
            "def select(self, evidence): return Choice(CHANGE_TARGET, 'x', instead='nobody')",
            "select() of mistaken:Mistaken ({file}:5) chose the target 'nobody'; this mission has",
        ),
        ("def skill(self, state, choice): return {}[state]", "({file}:5) has no skill for 'search'."),
        ("def select(self, evidence): raise ValueError", "failed at {file}:5: ValueError. Correct it there"),
        ("def select(self, evidence): raise OSError('No lamp.')", "{file}:5: OSError: No lamp. Correct it there"),
        ("def select(self, evidence): pass", "select() of mistaken:Mistaken ({file}:5) returned NoneType"),
        ("def skill(self, state, choice): pass", "skill() of mistaken:Mistaken ({file}:5) returned NoneType, not a Sk"),
        ("def evidence(self, basis): pass", "evidence() of mistaken:Mistaken ({file}:5) returned NoneType, not an Ev"),
        ("@classmethod\n    def own_policy(cls, mission): pass", "({file}:5) returned NoneType, not a RecoveryPolicy."),
        (
            "@classmethod\n    def own_policy(cls, mission): return object()",
            "({file}:5) returned object, not a RecoveryPolicy: it lacks select().",
        ),
        (
            "@classmethod\n    def own_policy(cls, mission): return Policy()\n\n"
            "class Policy:\n    def select(self): pass",
            "select() of mistaken:Policy ({file}:9) does not take its argument: Policy.select() takes 1 positional",
        ),
        ("def __init__(self): pass", "__init__() of mistaken:Mistaken ({file}:5) does not take the arguments of"),
        (
            "def learn(self): pass",
            "learn() of mistaken:Mistaken ({file}:5) does not take the arguments of learn(fa",
        ),
        (
            "def own_policy(self, mission): pass",
            "({file}:5) does not take the arguments of own_policy(mission), a",
        ),
    ],
)
def test_a_swept_mission_has_a_sentence_for_each(tmp_path, body, text):
    _write(tmp_path, body)
    error = _error()
    assert text.format(file=tmp_path / "mistaken.py") in error
    assert error.endswith((WRONG_RESULT, EXCEPTION, "behaviors.profiles.profile` shows the interface."))


def test_a_sentence_is_whole_behind_the_pipe_of_a_worker():
    with pytest.raises(WrongReturn) as caught:
        checked(str, int, 1)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


EVIDENCE = """\
def evidence(self, basis): return replace(super().evidence(basis), {0})

from dataclasses import replace
"""


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ("spent_s='long'", "spent_s: must be a number"),
        ("spent_s=float('inf')", "spent_s: must be a number"),
        ("others=(object(),)", "cannot be written into a journal"),
    ],
)
def test_evidence_that_a_journal_cannot_have_is_named(tmp_path, wrong, text):
    _write(tmp_path, EVIDENCE.format(wrong))
    error = _error()
    assert (
        f"evidence() of mistaken:Mistaken ({tmp_path / 'mistaken.py'}:5) returned evidence that a journal cannot have"
        in error
    )
    assert text in error
    assert error.endswith(WRONG_RESULT)


SKILL = """\
def skill(self, state, choice): return Skill()

from behaviors.events import Event, Fact, Reason

class Skill:
    def call(self): return {0}
"""


@pytest.mark.parametrize(
    ("result", "text"),
    [
        ("None", "returned NoneType, not a Fact."),
        (
            "Fact(Event.RECOVERY_DONE, Reason.THERE)",
            "returned recovery_done in the state 'search', which ends with target_seen or search_failed, or continued.",
        ),
        ("Fact(Event.OBSTACLE, Reason.OBSTACLE_AHEAD)", "returned obstacle in the state 'search', which ends with"),
        ("Fact(Event.SEARCH_FAILED, Reason.NEVER_SEEN)", "returned search_failed as a Fact, not as a Failure."),
        ("Fact(Event.CONTINUED, Reason.DRIVING_ON)", "returned continued without letting time pass."),
    ],
)
def test_a_skill_that_returns_what_its_state_cannot_end_with_is_named(tmp_path, result, text):
    _write(tmp_path, SKILL.format(result))
    assert f"call() of mistaken:Skill ({tmp_path / 'mistaken.py'}:10) {text}" in (error := _error())
    assert error.endswith(WRONG_RESULT)


@pytest.mark.parametrize("command", [["sweep", "--map", "block_permanent:100:mistaken:Mistaken"]])
def test_a_command_prints_one_line(tmp_path, refused, command):
    _write(tmp_path, POLICY.format("None", ()))
    (said,) = refused(*command).splitlines()
    assert said.startswith("nxtdrive: select() of mistaken:Policy (")


@pytest.mark.slow
def test_a_sweep_counts_the_missions_that_broke_and_ends_with_2(tmp_path, capsys, printed):
    _write(tmp_path, POLICY.format("None", ()))
    words = ["sweep", "--classes", "block_permanent", "--seeds", "100"]
    assert main([*words, "--agents", "mistaken:Mistaken,thesis"]) == USAGE
    table = capsys.readouterr().out
    assert re.search(r"agent .* broken ", table)
    assert re.search(r"mistaken:Mistaken\W+1 of 1 ", table)
    assert re.search(r"thesis\W+0 of 1 ", table)
    assert "block_permanent:100:mistaken:Mistaken failed: WrongReturn: select() of mistaken:Policy (" in table
    assert "broken" not in printed(*words, "--agents", "thesis", "--out", "thesis.jsonl")


@pytest.mark.slow
def test_a_run_prints_one_line_and_keeps_it(tmp_path, refused):
    _write(tmp_path, "def skill(self, state, choice): pass")
    (said,) = refused("run", "--no-video", "--profile", "mistaken:Mistaken").splitlines()
    assert said.startswith("nxtdrive: skill() of mistaken:Mistaken (")
    (run,) = (tmp_path / "runs").iterdir()
    assert "returned NoneType, not a Skill" in json.loads((run / "summary.json").read_text(encoding="utf-8"))["error"]


@pytest.mark.parametrize(
    ("body", "text"),
    [
        ("def learn(self): pass", "does not take the arguments of learn(failure)"),
        ("def skill(self", "mistaken.py:5: SyntaxError"),
        ("raise SystemExit", "mistaken.py:5: SystemExit"),
    ],
)
def test_a_check_of_the_mission_finds_it(tmp_path, refused, body, text):
    _write(tmp_path, body)
    mission = tmp_path / "mission.toml"
    mission.write_text(
        '[mission]\ntargets = ["tag"]\nprofile = "mistaken:Mistaken"\n'
        '[target.tag]\ndetector = "marker"\nid = 7\nheight_mm = 150\n',
        encoding="utf-8",
    )
    said = refused("mission", "check", mission)
    assert "1 mistake\n  mission.profile: profile 'mistaken:Mistaken' cannot be " in said
    assert text in said


@pytest.mark.parametrize(
    ("candidates", "text"),
    [
        ("None", "returned NoneType, not a Sequence."),
        ("[Choice(WAIT, 'x')]", "returned a list with Choice, not Candidate."),
        ("'wait'", "returned a list with str, not Candidate."),
        ("[Candidate(Choice(WAIT, 'x'), 5.0, 70)]", "returned a candidate with a chance of 70, not one from 0 to 1."),
        ("[Candidate(Choice(WAIT, 'x'), 5.0, '1')]", "returned a candidate with a chance of '1', not one from 0 to 1."),
        ("[Candidate(Choice(WAIT, 'x'), 5.0, float('nan'))]", "with a chance of nan, not one from 0 to 1."),
        ("[Candidate(Choice(WAIT, 'x'), None, 1.0)]", "with seconds of None, not a number."),
        ("[Candidate(Choice(WAIT, 'x'), float('nan'), 1.0)]", "with seconds of nan, not a number."),
        ("[Candidate('wait', 5.0, 1.0)]", "returned a candidate with str, not a Choice."),
    ],
)
def test_candidates_that_are_none_are_named_before_a_person_is_asked(tmp_path, candidates, text):
    _write(tmp_path, POLICY.format("Choice(WAIT, 'x')", candidates))
    policy = find_profile("mistaken:Mistaken").own_policy(None)
    with pytest.raises(MissionError) as error:
        question(policy, BLOCKED)
    assert f"candidates() of mistaken:Policy ({tmp_path / 'mistaken.py'}:10) " in str(error.value)
    assert text in str(error.value)


def test_a_list_of_recoveries_has_choices_only(tmp_path):
    listing = POLICY.format("Choice(WAIT, 'x')", "()").replace("def candidates(self, evidence)", "def recoveries(self)")
    _write(tmp_path, listing.replace("return ()", "return [WAIT]"))
    policy = find_profile("mistaken:Mistaken").own_policy(None)
    with pytest.raises(MissionError, match=r"recoveries\(\) of .* returned a list with Recovery, not Choice\."):
        question(policy, BLOCKED)


def test_a_choice_takes_only_recoveries_that_are_registered():
    assert all(Choice(each, "test").kind is each for each in RECOVERIES.values())
    dance = Recovery("dance", "dance", str, (0, 0, 0), "square")
    with pytest.raises(TypeError, match="not 'dance'"):
        Choice(dance, "test")
    with pytest.raises(ValueError, match="wait_s must be finite, not nan"):
        Choice(WAIT, "test", wait_s=float("nan"))
