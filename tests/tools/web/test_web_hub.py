"""The hub: the robot never waits for a client, late clients catch up."""

from __future__ import annotations

import asyncio
import json

from nxtdrive.tools.web import hub as hub_module
from nxtdrive.tools.web.driver_arbiter import DriverArbiter
from nxtdrive.tools.web.hub import FRAME, Client, Hub


def _received(*publish) -> list[str | bytes]:
    """What a client is sent after these calls on its hub."""

    async def client() -> list[str | bytes]:
        hub = Hub()
        one = Client(asyncio.get_running_loop(), "page 1")
        hub.join(one)
        for call in publish:
            call(hub)
        return await one.next()

    return asyncio.run(client())


def test_only_the_latest_state_and_frame_are_sent():
    messages = _received(
        lambda hub: hub.show("state", {"range_mm": 1}),
        lambda hub: hub.show_image(FRAME, 1, 0.5, b"old"),
        lambda hub: hub.show("state", {"range_mm": 2}),
        lambda hub: hub.show_image(FRAME, 2, 0.55, b"new"),
    )
    assert [json.loads(message) for message in messages if isinstance(message, str)] == [
        {"type": "state", "range_mm": 2}
    ]
    (frame,) = [message for message in messages if isinstance(message, bytes)]
    assert frame[0] == FRAME
    assert frame.endswith(b"new")


def test_a_client_that_comes_late_in_a_long_run_still_learns_that_it_runs(monkeypatch):
    monkeypatch.setattr(hub_module, "BACKLOG", 3)

    async def late() -> list[str | bytes]:
        hub = Hub()
        hub.begin_run()
        hub.publish("run", {"name": "long"})
        for number in range(5):
            hub.publish("line", {"text": str(number)})
        one = Client(asyncio.get_running_loop(), "page 1")
        hub.join(one)
        return await one.next()

    assert [json.loads(message) for message in asyncio.run(late())] == [
        {"type": "run", "name": "long"},
        {"type": "line", "text": "3"},
        {"type": "line", "text": "4"},
    ]


def test_no_event_is_left_out_and_their_order_stays():
    messages = _received(*[lambda hub, n=n: hub.publish("line", {"text": str(n)}) for n in range(100)])
    assert [json.loads(message)["text"] for message in messages] == [str(n) for n in range(100)]


def test_a_client_that_connects_later_receives_the_run_so_far():
    async def late() -> list[str | bytes]:
        hub = Hub()
        hub.publish("line", {"text": "of the last run"})
        hub.show("state", {"doing": "at rest", "pose": [0, 0, 0]})
        hub.begin_run()
        hub.publish("line", {"text": "searching"})
        hub.show("paused", {"paused": True})
        one = Client(asyncio.get_running_loop(), "page 1")
        hub.join(one)
        return await one.next()

    assert [json.loads(message) for message in asyncio.run(late())] == [
        {"type": "line", "text": "searching"},
        {"type": "paused", "paused": True},
    ], "not where the robot stood before the run"


def test_the_wheel_changes_hands_by_consent():
    seen: list[tuple[str, str]] = []
    arbiter = DriverArbiter(lambda driver, asking: seen.append((driver, asking)))
    for _ in range(3):
        assert arbiter.take("one")
    assert seen == [("one", "")], "nothing is told while nothing changes"
    assert not arbiter.take("two")
    assert seen[-1] == ("one", "two")
    arbiter.give("two")
    assert seen[-1] == ("one", ""), "a request can be withdrawn"
    arbiter.take("two")
    arbiter.give("one")
    assert seen[-1] == ("two", "")
    arbiter.give("two")
    assert seen[-1] == ("", "")
    assert arbiter.take("one")
