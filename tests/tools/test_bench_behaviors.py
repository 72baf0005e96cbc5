"""The cost of behaviors is measured on the real chart and in real missions; the times depend on the machine."""

import math

import pytest

from behaviors.events import Fact, Reason
from nxtdrive.tools.dev.bench_behaviors import (
    FACTS,
    decision_times_s,
    frame_times_s,
    measure_behaviors,
    searching_chart,
    spread_ms,
)


@pytest.mark.nightly
def test_every_figure_is_there_and_has_its_goal():
    figures = {
        figure.name: figure
        for figure in measure_behaviors(turns=2, hard=["far"], seeds=[100], easy=["open", "link"], big=["open"])
    }
    assert all(figure.value > 0 for figure in figures.values())
    goals = {name: figure.goal for name, figure in figures.items() if figure.goal}
    for words, goal in [
        *((f"fact to the chart, {name}", "<= 500") for name in FACTS),
        ("adaptive: decision, 99 %", "<= 50"),
        ("missions a minute of CPU, thesis, 2 classes", ">= 100"),
        ("missions a minute of CPU, adaptive, open", ">= 30"),
    ]:
        (found,) = (name for name in goals if name.startswith(words))
        assert goals[found] == goal
    assert len(goals) == 8
    assert any(name.startswith("fact to a bare dict") for name in figures)
    assert any(name.startswith("adaptive: frame to world model, median") for name in figures)


@pytest.mark.parametrize(("name", "regions"), list(zip(FACTS, [{"mission"}, {"safety"}, set()], strict=True)))
def test_the_facts_match_their_names_and_lead_back_to_the_search(name, regions):
    chart = searching_chart()
    before, moved = chart.states_now, set()
    for event in FACTS[name]:
        was = chart.states_now
        chart.report(Fact(event, Reason.SIGHTED))
        changed = was ^ chart.states_now
        moved |= {"safety"} if changed & {"clear", "held"} else {"mission"} if changed else set()
    assert moved == regions
    assert chart.states_now == before
    assert chart.mission_state == "search"


@pytest.mark.nightly
def test_decisions_are_timed_throughout_a_mission_and_frames_while_looking_round():
    assert len(decision_times_s("far", 101)) >= 1
    assert len(frame_times_s("far", 101)) >= 30


def test_the_spread_of_times():
    assert spread_ms([i / 1000 for i in range(1, 201)]) == pytest.approx((100.5, 198.0))
    assert spread_ms([0.002]) == (2.0, 2.0)
    assert all(math.isnan(each) for each in spread_ms([]))
