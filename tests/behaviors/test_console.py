"""The agent's lines, from records alone; whole consoles are in tests/missions."""

import pytest

from behaviors.console import Console
from behaviors.journal import Kind, Record
from behaviors.recoveries import RECOVERIES


def _said(data, *, choices):
    lines = []
    Console(lines.append, choices=choices)(Record(1.0, Kind.CHOICE, "select", "lena", data))
    return lines


@pytest.mark.parametrize("name", RECOVERIES)
def test_every_choice_is_one_clause_with_its_reason(name):
    (line,) = _said({"choice": name, "why": "it pays", "evidence": {}}, choices=True)
    assert line.startswith("[client2] ")
    assert line.endswith(": it pays")


def test_a_wait_says_how_long_it_may_take():
    data = {"choice": "wait", "why": "it may leave", "wait_s": 2.005, "evidence": {}}
    assert _said(data, choices=True) == ["[client2] Waiting up to 2.0 s: it may leave"]


@pytest.mark.parametrize(
    ("kind", "data", "says"),
    [
        (Kind.SENSOR, {"sensor": "sonar", "answers": False, "error": "no cable"}, "without sonar"),
        (Kind.SENSOR, {"sensor": "sonar", "answers": True, "error": ""}, "sonar answers again"),
        (Kind.TRANSITION, {"source": "up", "to": "down", "reason": "camera_lost"}, "camera gives no picture"),
    ],
)
def test_only_a_profile_that_speaks_tells_what_does_not_answer(kind, data, says):
    for choices in (True, False):
        lines = []
        Console(lines.append, choices=choices)(Record(1.0, kind, "search", "lena", data))
        assert len(lines) == choices
        assert all(says in line for line in lines)


def test_the_thesiss_agent_says_nothing_of_its_choices():
    assert _said({"choice": "wait", "why": "x", "wait_s": 15.0}, choices=False) == []
