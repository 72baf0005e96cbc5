"""The chart: the thesis's path through it, and supervision from every state."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviors.chart import MISSION_STATES, MissionChart
from behaviors.chart_words import EVENTS, STATES
from behaviors.diagram import arrows, mermaid, regions, state_table
from behaviors.events import Event, Fact, Reason
from behaviors.recoveries import CHANGE_TARGET, MOVE_TO, RECOVERIES, WAIT, Choice, Recovery
from behaviors.target_queue import TargetOutcome, TargetQueue


def _chart(*choices: Recovery, targets: tuple[str, ...] = ("lena", "rilakkuma"), rounds: int = 1) -> MissionChart:
    left = list(choices)
    return MissionChart(TargetQueue(targets, rounds), lambda: Choice(left.pop(0) if left else CHANGE_TARGET, "test"))


def _send(chart: MissionChart, *events: Event) -> list[str]:
    states = []
    for event in events:
        chart.report(Fact(event, Reason.SIGHTED))
        states.append(chart.mission_state)
    return states


REACH = {
    "idle": [],
    "search": [Event.START],
    "arrive": [Event.START, Event.TARGET_SEEN],
    "wait": [Event.START, Event.SEARCH_FAILED],
    "suspended": [Event.START, Event.TARGET_SEEN, Event.LINK_LOST],
}


def test_a_target_reached_leads_to_the_next_and_the_last_one_ends_the_mission():
    chart = _chart()
    path = _send(chart, Event.START, Event.TARGET_SEEN, Event.CONTINUED, Event.ARRIVED)
    assert path == ["search", "arrive", "arrive", "search"]
    assert chart.queue.target == "rilakkuma"
    assert _send(chart, Event.TARGET_SEEN, Event.ARRIVED) == ["arrive", "finished"]
    assert chart.is_terminated
    assert chart.queue.achieved


def test_failures_pass_through_select_and_the_recovery_leads_back_to_search():
    chart = _chart(MOVE_TO, WAIT)
    path = _send(chart, Event.START, Event.SEARCH_FAILED, Event.RECOVERY_DONE)
    assert path == ["search", "move_to", "search"]
    path = _send(chart, Event.TARGET_SEEN, Event.ARRIVE_FAILED, Event.RECOVERY_DONE)
    assert path == ["arrive", "wait", "search"]


def test_giving_up_changes_the_target_and_giving_up_the_last_ends_the_mission():
    chart = _chart(CHANGE_TARGET, CHANGE_TARGET)
    assert _send(chart, Event.START, Event.SEARCH_FAILED) == ["search", "search"]
    assert [progress.outcome for progress in chart.queue.targets] == [TargetOutcome.GIVEN_UP, TargetOutcome.PENDING]
    assert _send(chart, Event.SEARCH_FAILED) == ["finished"]
    assert chart.is_terminated


def test_a_target_that_is_left_for_a_later_round_is_not_given_up():
    chart = _chart(CHANGE_TARGET, CHANGE_TARGET, CHANGE_TARGET, rounds=2)
    _send(chart, Event.START, Event.SEARCH_FAILED, Event.SEARCH_FAILED)
    assert [progress.outcome for progress in chart.queue.targets] == [TargetOutcome.PENDING, TargetOutcome.PENDING]
    _send(chart, Event.SEARCH_FAILED)
    assert [progress.outcome for progress in chart.queue.targets] == [TargetOutcome.GIVEN_UP, TargetOutcome.PENDING]


def test_a_decision_that_is_broken_off_does_not_repeat_the_one_before():
    decisions = iter([Choice(CHANGE_TARGET, "test")])

    def decide() -> Choice:
        for choice in decisions:
            return choice
        raise KeyboardInterrupt

    chart = MissionChart(TargetQueue(("lena", "rilakkuma"), rounds=2), decide)
    _send(chart, Event.START, Event.SEARCH_FAILED)
    with pytest.raises(KeyboardInterrupt):
        _send(chart, Event.SEARCH_FAILED)
    assert _send(chart, Event.TRIP) == ["finished"]
    assert chart.queue.target == "rilakkuma"


def test_the_policy_may_say_which_target_is_next_and_that_counts_once():
    decisions = iter([Choice(CHANGE_TARGET, "test", instead="box"), Choice(CHANGE_TARGET, "test")])
    chart = MissionChart(TargetQueue(("lena", "fox", "box"), rounds=2), lambda: next(decisions))
    _send(chart, Event.START, Event.SEARCH_FAILED)
    assert chart.queue.target == "box"
    _send(chart, Event.TARGET_SEEN, Event.ARRIVED)
    assert chart.queue.target == "fox"
    _send(chart, Event.SEARCH_FAILED)
    assert chart.queue.target == "lena"


@pytest.mark.parametrize("state", ["search", "arrive", "wait"])
def test_a_lost_link_suspends_any_state_and_its_return_resumes_it(state):
    chart = _chart(WAIT)
    _send(chart, *REACH[state])
    assert chart.mission_state == state
    assert _send(chart, Event.LINK_LOST, Event.LINK_BACK) == ["suspended", state]


def test_the_policy_may_say_which_target_is_next_after_one_that_is_given_up():
    chart = MissionChart(TargetQueue(("lena", "fox", "box")), lambda: Choice(CHANGE_TARGET, "test", instead="box"))
    _send(chart, Event.START, Event.SEARCH_FAILED)
    assert (chart.queue.target, chart.queue.outcomes["lena"]) == ("box", TargetOutcome.GIVEN_UP)


@pytest.mark.parametrize("ahead", [[], [Event.OBSTACLE], [Event.OBSTACLE, Event.CONTACT]], ids=str)
@pytest.mark.parametrize("state", list(REACH))
def test_a_trip_ends_the_mission_from_any_state(state, ahead):
    chart = _chart(WAIT)
    _send(chart, *REACH[state], *ahead)
    assert _send(chart, Event.TRIP) == ["finished"]
    assert chart.is_terminated


def test_an_exception_in_the_policy_surfaces():
    def broken() -> Choice:
        raise RuntimeError("no choice")

    chart = MissionChart(TargetQueue(["lena"]), broken)
    _send(chart, Event.START)
    with pytest.raises(RuntimeError, match="no choice"):
        _send(chart, Event.SEARCH_FAILED)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(
    facts=st.lists(st.sampled_from(list(Event)), max_size=40),
    choices=st.lists(st.sampled_from(list(RECOVERIES.values())), max_size=40),
    targets=st.integers(1, 3),
)
def test_any_sequence_of_facts_leaves_exactly_one_state_per_region(facts, choices, targets):
    chart = _chart(*choices, targets=tuple("abc"[:targets]))
    for event in facts:
        if chart.is_terminated:
            break
        _send(chart, event)
        now = chart.states_now
        if chart.is_terminated:
            assert now == {"done"}
        else:
            assert len(now & set(MISSION_STATES)) == 1
            assert len(now & {"up", "down"}) == 1
            assert len(now & {"clear", "held", "tripped"}) == 1
            assert len(now & {"seeing", "blind"}) == 1
            assert len(now & {"trusted", "distrusted"}) == 1
            assert "select" not in now, "select is passed through, never rested in"


def test_every_event_is_declared_in_the_chart_and_the_other_way_round():
    assert {arrow.event for arrow in arrows()} - {""} == {str(event) for event in Event}


def test_every_callback_names_a_state_of_the_chart():
    ids = {arrow.source for arrow in arrows()} | {arrow.target for arrow in arrows()}
    for name in vars(MissionChart):
        if name.startswith(("on_enter_", "on_exit_")):
            assert name.removeprefix("on_enter_").removeprefix("on_exit_") in ids


def test_every_state_and_event_has_a_sentence():
    ids = {arrow.source for arrow in arrows()} | {arrow.target for arrow in arrows()}
    ids |= {box.state for region in regions() for box in (region, *region.inner)}
    assert all(f"\n| {name} |" in state_table() for name in ids)
    assert set(EVENTS) == set(Event)
    assert all(text.endswith(".") for text in (*STATES.values(), *EVENTS.values()))


def test_the_diagram_has_no_arrow_into_a_compound_that_is_only_entered_elsewhere():
    assert "[*] --> search" in mermaid()
    assert "[*] --> wait" not in mermaid()


def test_driving_on_does_not_release_a_robot_that_the_safety_stop_holds():
    chart = _chart()
    _send(chart, Event.START, Event.TARGET_SEEN, Event.OBSTACLE, Event.CONTINUED)
    assert "held" in chart.states_now
    assert "clear" not in chart.states_now
