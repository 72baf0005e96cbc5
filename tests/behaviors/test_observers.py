"""Observers cannot break a mission."""

from __future__ import annotations

import pytest

from behaviors.journal import Record, RecordKind
from behaviors.observers import Observers

RECORD = Record(0.0, RecordKind.START, "idle", "lena")


def _failing(error):
    def observe(record):
        raise error

    return observe


def test_one_that_fails_is_reported_once_and_left_out():
    received, failed = [], []
    observers = Observers(on_failure=lambda name, error: failed.append((name, error)))
    observers.add("console", _failing(ConnectionError("closed")))
    observers.add("journal", received.append)
    observers(RECORD)
    observers(RECORD)
    assert failed == [("console", "closed")]
    assert received == [RECORD, RECORD]
    assert observers.failures == {"console": "closed"}
    assert observers.summary() == {"observer_failures": {"console": "closed"}}


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (OSError(28, "No space left on device", "map.png"), "No space left on device"),
        (OSError("full"), "full"),
        (KeyError(), "KeyError"),
    ],
)
def test_an_error_is_reported_in_words_without_the_systems_number(error, text):
    observers = Observers([], on_failure=lambda *_: None)
    observers.attempt("map.png", _failing(error), RECORD)
    assert observers.failures == {"map.png": text}


def test_all_of_one_name_are_left_out_together():
    shown = []
    observers = Observers(on_failure=lambda name, error: None)
    look, frame = observers.guarded("video", _failing(OSError("full"))), observers.guarded("video", shown.append)
    frame(1), look(2), frame(3)
    assert shown == [1]


def test_a_program_that_says_nothing_finds_a_warning_in_the_log(caplog):
    Observers([_failing(ValueError("a bug"))])(RECORD)
    assert "a bug" in caplog.text


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit])
def test_the_end_of_the_program_is_not_a_failure(error):
    with pytest.raises(error):
        Observers([_failing(error)])(RECORD)
