"""A mission that is ended between two decisions."""

from __future__ import annotations

import signal
import threading
from types import SimpleNamespace

import pytest

from behaviors.stepped_mission import SteppedMission


@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="needs signals to a thread")
def test_ctrl_c_while_a_mission_runs_ends_it_before_the_caller_continues():
    steps = 0

    def run(ask, pause):
        nonlocal steps
        with pause.interrupting():
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
            while steps < 100_000_000:
                steps += 1
                pause.check()

    stepped, threads = SteppedMission(run), threading.enumerate()
    with pytest.raises(KeyboardInterrupt):
        stepped.step()
    stepped.end()
    assert steps < 100_000_000
    assert threading.enumerate() == threads


@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="needs signals to a thread")
def test_an_interrupted_step_passes_its_choice_to_no_later_decision():
    chosen = []

    def question(*choices):
        return SimpleNamespace(candidates=[SimpleNamespace(choice=choice) for choice in choices])

    first, second = question("a", "b"), question("c", "d")

    def run(ask, pause):
        chosen.append(ask(first))
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
        interrupted.wait()
        chosen.append(ask(second))

    stepped, interrupted = SteppedMission(run), threading.Event()
    assert stepped.step() is first
    with pytest.raises(KeyboardInterrupt):
        stepped.step(1)
    assert stepped.question is None
    interrupted.set()
    assert stepped.step() is second
    assert chosen == ["b"]
    assert stepped.step(1) is None
    assert chosen == ["b", "d"]


def test_a_mission_that_has_not_begun_or_is_over_may_be_ended():
    stepped = SteppedMission(lambda ask, pause: None)
    stepped.end()
    stepped.step()
    stepped.end()
    assert stepped.step() is None


def test_the_error_of_a_mission_that_is_ended_is_ignored():
    def run(ask, pause):
        try:
            ask(None)
        finally:
            raise ValueError

    stepped = SteppedMission(run)
    stepped.step()
    stepped.end()
    assert stepped.step() is None
