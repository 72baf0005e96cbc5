"""What explanations say of the outcome of a decision."""

from __future__ import annotations

import pytest

from behaviors.journal import Kind, Record
from nxtdrive.cli.explanation_view import outcome_words
from nxtdrive.recording.decisions import decisions


@pytest.mark.parametrize(
    ("next_target", "words"),
    [
        ("lena", "lena failed again after 2.5 s: a scan did not bring it into view"),
        ("rilakkuma", "rilakkuma failed after 2.5 s: a scan did not bring it into view"),
    ],
)
def test_only_a_failure_of_the_same_target_is_one_again(next_target, words):
    failed = {"source": "search", "to": "select", "reason": "never_seen"}
    records = [
        Record(1.0, Kind.CHOICE, "select", "lena", {"choice": "change_target", "why": "", "evidence": {}}),
        Record(1.0, Kind.TRANSITION, "select", "lena", failed),
        Record(3.5, Kind.TRANSITION, "select", next_target, failed),
    ]
    (decision,) = decisions(records)
    assert outcome_words(decision) == words
