"""What explanations say of the outcome of a decision."""

from __future__ import annotations

import pytest

from behaviors.journal import Record, RecordKind
from nxtdrive.cli.views.explanation import outcome_words
from nxtdrive.recording.decisions import decisions


@pytest.mark.parametrize(
    ("next_target", "words"),
    [
        ("lena", "the attempt at lena failed again after 2.5 s: a scan did not bring it into view"),
        ("rilakkuma", "the attempt at rilakkuma failed after 2.5 s: a scan did not bring it into view"),
    ],
)
def test_only_a_failure_of_the_same_target_is_one_again(next_target, words):
    failed = {"source": "search", "to": "select", "reason": "never_seen"}
    records = [
        Record(1.0, RecordKind.CHOICE, "select", "lena", {"choice": "change_target", "why": "", "evidence": {}}),
        Record(1.0, RecordKind.TRANSITION, "select", "lena", failed),
        Record(3.5, RecordKind.TRANSITION, "select", next_target, failed),
    ]
    (decision,) = decisions(records)
    assert outcome_words(decision) == words


@pytest.mark.parametrize(
    ("reason", "words"),
    [("no_way", "there is no path to where the robot wanted to go"), ("there", "the robot got there")],
)
def test_recoveries_and_reasons_are_in_words_and_the_failure_is_reported_once(reason, words):
    """Not "move to 2.0 s (no way)", which names a state and a reason of the journal."""
    steps = [
        Record(
            1.0, RecordKind.TRANSITION, "select", "lena", {"source": "search", "to": "select", "reason": "never_seen"}
        ),
        Record(1.0, RecordKind.TRANSITION, "move_to", "lena", {"source": "select", "to": "move_to"}),
        Record(3.0, RecordKind.TRANSITION, "search", "lena", {"source": "move_to", "to": "search", "reason": reason}),
        Record(
            4.5, RecordKind.TRANSITION, "select", "lena", {"source": "search", "to": "select", "reason": "never_seen"}
        ),
    ]
    chosen = Record(1.0, RecordKind.CHOICE, "select", "lena", {"choice": "move_to", "why": "", "evidence": {}})
    (decision,) = decisions([chosen, *steps])
    assert outcome_words(decision) == (
        f"look elsewhere 2.0 s ({words}), search 1.5 s\n"
        "the attempt at lena failed again after 3.5 s: a scan did not bring it into view"
    )
