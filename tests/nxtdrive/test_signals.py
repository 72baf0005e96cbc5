"""Signals end commands in good order: after an import, and not within sections that must not be interrupted."""

from __future__ import annotations

import importlib
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pymunk
import pytest

from nxtdrive.cli.main import SIGNALLED, main
from nxtdrive.signals import SignalInterrupt, handling, held, signals_as_interrupt

NUMBERS = pytest.mark.parametrize(
    "number", [signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
)


@NUMBERS
def test_a_signal_interrupts(number):
    with signals_as_interrupt(), pytest.raises(SignalInterrupt) as interrupt:
        signal.raise_signal(number)
    assert interrupt.value.number == number


def test_a_section_that_another_thread_drops_ends_without_an_error():
    """As with a brick that was never closed, when its memory is reclaimed in whichever thread needs some."""
    before = signal.getsignal(signal.SIGTERM)
    section = handling(lambda *_: None, ("SIGTERM",))
    section.__enter__()
    try:
        with ThreadPoolExecutor() as pool:
            pool.submit(section.__exit__, None, None, None).result(timeout=5)
    finally:
        signal.signal(signal.SIGTERM, before)


@NUMBERS
def test_a_second_signal_does_not_disturb_the_end_of_the_program(number):
    with signals_as_interrupt():
        with pytest.raises(SignalInterrupt):
            signal.raise_signal(number)
        signal.raise_signal(number)


@NUMBERS
def test_a_third_signal_interrupts_an_end_that_hangs(number):
    with signals_as_interrupt():
        with pytest.raises(SignalInterrupt):
            signal.raise_signal(number)
        signal.raise_signal(number)
        with pytest.raises(SignalInterrupt):
            signal.raise_signal(number)


@NUMBERS
def test_an_import_is_completed_first(number, tmp_path, monkeypatch):
    (tmp_path / "interrupted_module.py").write_text(f"import signal\nsignal.raise_signal({number:d})\nwhole = True\n")
    monkeypatch.syspath_prepend(tmp_path)

    def import_and_wait():
        importlib.import_module("interrupted_module")
        while True:
            time.sleep(0.01)

    with signals_as_interrupt(), pytest.raises(SignalInterrupt):
        import_and_wait()
    assert sys.modules.pop("interrupted_module").whole


@NUMBERS
def test_what_is_held_back_is_delivered_once_at_the_end(number):
    done = []

    def hold():
        with held():
            signal.raise_signal(number)
            signal.raise_signal(number)
            done.append(True)

    with signals_as_interrupt(), pytest.raises(SignalInterrupt):
        hold()
    assert done


def test_what_is_held_back_may_be_released_earlier():
    with signals_as_interrupt(), held() as release:
        release()
        release()
        with pytest.raises(SignalInterrupt):
            signal.raise_signal(signal.SIGTERM)


@NUMBERS
def test_a_command_that_a_signal_ends_exits_as_in_shells(number, monkeypatch):
    def type_a_line():
        signal.raise_signal(number)
        yield "00 0b"

    monkeypatch.setattr("sys.stdin", type_a_line())
    assert main(["explain", "-"]) == SIGNALLED + number


class _InterruptedWhenDeleted:
    def __del__(self):
        signal.raise_signal(signal.SIGTERM)


@NUMBERS
def test_a_signal_while_an_error_is_reported_leaves_no_traceback(number, monkeypatch):
    monkeypatch.setattr("nxtdrive.cli.main.write_error", lambda _message: signal.raise_signal(number))
    assert main(["explain", "not hex"]) == SIGNALLED + number


def _from_c(callback):
    """Call `callback` from C, as the simulation's physics does."""
    space, body = pymunk.Space(), pymunk.Body(1.0, 1.0)
    space.add(body, pymunk.Circle(body, 1.0))
    body.velocity_func = lambda *_: callback()
    space.step(0.01)


@pytest.mark.parametrize(
    "drops",
    [_InterruptedWhenDeleted, lambda: _from_c(lambda: signal.raise_signal(signal.SIGTERM))],
    ids=["in a finaliser", "in a callback from C"],
)
def test_an_interrupt_that_python_drops_is_raised_again(drops):
    def drop_and_wait():
        drops()
        time.sleep(5.0)

    with pytest.raises(SignalInterrupt) as interrupted, signals_as_interrupt():
        drop_and_wait()
    assert interrupted.value.number == signal.SIGTERM
