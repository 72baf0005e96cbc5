"""Every event in every state of the mission: its transition, and no other transitions."""

from __future__ import annotations

import pytest

from behaviors.chart import MissionChart
from behaviors.events import Event, Fact, Reason
from behaviors.recoveries import DETOUR, MOVE_TO, RESCAN, WAIT, Choice
from behaviors.target_queue import TargetQueue

WAYS = {
    "idle": ([], WAIT),
    "search": ([Event.START], WAIT),
    "arrive": ([Event.START, Event.TARGET_SEEN], WAIT),
    "verify": ([Event.START, Event.TARGET_SEEN, Event.DOUBTED], WAIT),
    "retreat": ([Event.START, Event.SEARCH_FAILED, Event.BACKING_OFF], DETOUR),
    "wait": ([Event.START, Event.SEARCH_FAILED], WAIT),
    "move_to": ([Event.START, Event.SEARCH_FAILED], MOVE_TO),
    "detour": ([Event.START, Event.TARGET_SEEN, Event.ARRIVE_FAILED], DETOUR),
    "rescan": ([Event.START, Event.SEARCH_FAILED], RESCAN),
    "suspended": ([Event.START, Event.LINK_LOST], WAIT),
    "finished": ([Event.START, Event.ABORT], WAIT),
}
"""How to come into each state in which a mission can rest, and what the policy chooses from then on."""

RECOVERIES = ("wait", "move_to", "detour", "rescan")
LOST = (Event.LINK_LOST, Event.CAMERA_LOST, Event.SENSOR_LOST)
ACTIVE = ("search", "arrive", "verify", "retreat", *RECOVERIES)

LEADS_TO = {
    ("idle", Event.START): "search",
    ("search", Event.TARGET_SEEN): "arrive",
    ("search", Event.SEARCH_FAILED): "wait",
    ("arrive", Event.CONTINUED): "arrive",
    ("arrive", Event.ARRIVED): "search",  # for the next target
    ("arrive", Event.ARRIVE_FAILED): "wait",
    ("arrive", Event.MISTAKEN): "wait",
    ("arrive", Event.DOUBTED): "verify",
    ("verify", Event.MOVED_OFF): "arrive",
    ("verify", Event.ARRIVED): "search",  # for the next target
    ("verify", Event.ARRIVE_FAILED): "wait",
    ("verify", Event.MISTAKEN): "wait",
    **{(state, Event.BACKING_OFF): "retreat" for state in ("arrive", "move_to", "detour")},
    ("retreat", Event.RETREATED): "detour",
    ("retreat", Event.ARRIVE_FAILED): "detour",  # through select, which chooses the same again
    **{(state, Event.TARGET_SEEN): "arrive" for state in RECOVERIES},
    **{(state, Event.RECOVERY_DONE): "search" for state in RECOVERIES},
    **{(state, Event.RECOVERY_FAILED): state for state in RECOVERIES},  # through select, which chooses the same again
    **{(state, Event.SUSPEND): "suspended" for state in ACTIVE},
    **{(state, lost): "suspended" for state in ACTIVE for lost in LOST},
    **{("suspended", back): "search" for back in (Event.LINK_BACK, Event.CAMERA_BACK, Event.SENSOR_BACK)},
    **{(state, Event.ABORT): "finished" for state in WAYS},
    **{(state, Event.TRIP): "finished" for state in WAYS},
}
"""Where an event leads; a pair that is not here changes nothing."""


@pytest.mark.parametrize("event", list(Event))
@pytest.mark.parametrize("state", list(WAYS))
def test_every_event_in_every_state(state, event):
    way, kind = WAYS[state]
    chart = MissionChart(TargetQueue(["lena", "rilakkuma"]), lambda: Choice(kind, "test"))
    for step in way:
        chart.report(Fact(step, Reason.SIGHTED))
    assert chart.mission_state == state
    if not chart.is_terminated:
        chart.report(Fact(event, Reason.SIGHTED))
    assert chart.mission_state == LEADS_TO.get((state, event), state)


def test_a_resume_asked_for_while_the_link_is_down_changes_nothing():
    chart = MissionChart(TargetQueue(["lena"]), lambda: Choice(WAIT, "test"))
    for event in (Event.START, Event.LINK_LOST, Event.RESUME):
        chart.report(Fact(event, Reason.SIGHTED))
    assert chart.mission_state == "suspended"
