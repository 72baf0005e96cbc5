"""The sequential test accepts steady detections and rejects occasional ones."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random
from statistics import median

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.target_verifier import TargetVerifier, Verdict

DOCUMENT = Path(__file__).parents[3] / "docs" / "adaptive.md"
SEQUENCES = 2000
FRAMES = 300
"""20 s of video."""


def _verify(rate: float, seed: int) -> tuple[Verdict, int]:
    """The verdict on something that is found in that share of the frames, and after how many frames it is given."""
    random, verifier = Random(f"{rate}/{seed}"), TargetVerifier()
    for frame in range(1, FRAMES + 1):
        verifier.frame(hit=random.random() < rate)
        if verifier.verdict is not Verdict.OPEN:
            return verifier.verdict, frame
    return Verdict.OPEN, FRAMES


def _row(rate: float) -> str:
    """A line of the document's table."""
    verified = [_verify(rate, seed) for seed in range(SEQUENCES)]
    counts = Counter(verdict for verdict, _ in verified)
    shares = " | ".join(f"{100 * counts[verdict] / SEQUENCES:.1f} %" for verdict in Verdict)
    frames = sorted(frames for _, frames in verified)
    return f"| {rate:.2f} | {shares} | {median(frames):.0f} | {frames[round(0.99 * SEQUENCES)]} |"


@pytest.mark.parametrize("rate", [0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 0.95])
def test_the_document_has_the_error_rates_as_they_are(rate):
    assert _row(rate) in DOCUMENT.read_text(encoding="utf-8")


@pytest.mark.parametrize(("rate", "verdict", "limit"), [(0.9, Verdict.REAL, 30), (0.2, Verdict.MISTAKEN, 150)])
def test_the_target_is_accepted_and_a_look_alike_rejected_in_a_bounded_number_of_frames(rate, verdict, limit):
    verified = [_verify(rate, seed) for seed in range(1000)]
    right = sum(each is verdict and frames <= limit for each, frames in verified)
    assert right >= 0.99 * len(verified)


def test_nothing_is_decided_by_one_frame():
    for hit in (True, False):
        verifier = TargetVerifier()
        verifier.frame(hit=hit)
        assert verifier.verdict is Verdict.OPEN


@given(misses=st.integers(1, 1000))
def test_a_hidden_target_is_not_doubted_until_it_is_found_again(misses):
    verifier = TargetVerifier()
    for _ in range(misses):
        verifier.frame(hit=False)
    assert verifier.odds == 0.0
    assert verifier.verdict is Verdict.OPEN


@given(misses=st.integers(0, 100), hits=st.integers(1, 30))
def test_misses_that_are_forgotten_never_count(misses, hits):
    plain, hidden = TargetVerifier(), TargetVerifier()
    for _ in range(misses):
        hidden.frame(hit=False)
    hidden.forget_misses()
    for verifier in (plain, hidden):
        for _ in range(hits):
            verifier.frame(hit=True)
    assert hidden == plain


@given(misses=st.integers(1, 100))
def test_misses_between_two_hits_do_count(misses):
    steady, patchy = TargetVerifier(), TargetVerifier()
    for hit in (True, *[False] * misses, True):
        patchy.frame(hit=hit)
    for _ in range(2):
        steady.frame(hit=True)
    assert patchy.odds < steady.odds


@given(hits=st.lists(st.booleans(), max_size=500))
def test_the_odds_can_always_be_turned_again(hits):
    """However long something looked like the target, a hundred frames of the other kind turn the verdict."""
    verifier = TargetVerifier()
    for hit in hits:
        verifier.frame(hit=hit)
    for frame in range(100):
        verifier.frame(hit=frame % 10 == 9)
    assert verifier.verdict is Verdict.MISTAKEN


@pytest.mark.parametrize(("rate", "clear"), [(0.97, True), (0.6, False), (0.4, False)])
def test_only_what_is_found_steadily_is_clear(rate, clear):
    for seed in range(200):
        random, verifier = Random(f"clear/{rate}/{seed}"), TargetVerifier()
        for _ in range(FRAMES):
            verifier.frame(hit=random.random() < rate)
        assert verifier.clear == clear
        assert not (verifier.unclear and clear)
