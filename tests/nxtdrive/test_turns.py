"""Turns on the wire: nobody who waits is forgotten."""

from __future__ import annotations

import threading

import pytest

from nxtdrive.link.priority_lock import PriorityLock

WITHIN_S = 5.0


def _user(turns: PriorityLock, served: list[str], name: str, *, urgent: bool = False) -> threading.Thread:
    """A thread that uses the wire once, as requests do, and is waiting for it when this returns."""
    waiting = len(turns.queue)

    def use() -> None:
        try:
            if turns.queue or turns.wire.locked():
                turns.wait(urgent, WITHIN_S)
            with turns.wire:
                served.append(name)
        finally:
            if turns.queue:
                turns.leave()

    thread = threading.Thread(target=use)
    thread.start()
    while len(turns.queue) == waiting and thread.is_alive():
        thread.join(0.001)
    return thread


def test_who_waits_for_somebody_without_a_place_is_called():
    # the heartbeat sends between requests; a motor command that queued up meanwhile was once left waiting for ever
    turns, served = PriorityLock(), []
    with turns.aside():
        waiting = _user(turns, served, "motor", urgent=True)
    waiting.join(WITHIN_S / 2)
    assert served == ["motor"]
    assert not turns.queue


@pytest.mark.parametrize("aside", [True, False])
def test_all_who_wait_are_served_urgent_ones_first(aside):
    turns, served = PriorityLock(), []
    if aside:
        with turns.aside():
            threads = [_user(turns, served, name, urgent=name == "motor") for name in ("one", "two", "motor")]
    else:
        with turns.wire:
            threads = [_user(turns, served, name, urgent=name == "motor") for name in ("one", "two", "motor")]
        turns.leave()
    for thread in threads:
        thread.join(WITHIN_S / 2)
    assert served == ["motor", "one", "two"]
    assert not turns.queue
