"""The campaign of errors: a sample, and proof that it finds violations."""

from __future__ import annotations

import pytest

from firmware_protocol.errors import BrickError, LinkTimeout
from nxtdrive.tools.dev.faults import errors

FEW = range(30 * len(errors.PROVOKED))


@pytest.fixture(autouse=True)
def _few(monkeypatch):
    monkeypatch.setattr(errors, "WARM", 50)
    monkeypatch.setattr(errors, "TRACED", 50)


def test_a_sample():
    tally = errors.CAMPAIGN.run(1, FEW)
    assert tally.violations == []
    assert set(tally.outcomes) == set(errors.PROVOKED)


def test_what_is_left_behind_is_found(monkeypatch):
    kept = []

    def leave_behind(*_):
        kept.append([bytes(100 + i % 2) for i in range(1000)])
        raise LinkTimeout("too late.")

    monkeypatch.setitem(errors.PROVOKED, "timeout", (leave_behind, LinkTimeout))
    violations = str(errors.CAMPAIGN.run(1, FEW).violations)
    assert "objects behind" in violations
    assert "bytes behind" in violations


def test_what_is_kept_once_is_not_a_leak(monkeypatch):
    kept = []

    def keep_once(*_):
        if len(kept) < 27:
            kept.append(bytes(1_000_000 if len(kept) == 26 else 100))
        raise LinkTimeout("too late.")

    monkeypatch.setitem(errors.PROVOKED, "timeout", (keep_once, LinkTimeout))
    assert errors.CAMPAIGN.run(1, FEW).violations == []


@pytest.mark.parametrize(("provoke", "text"), [(lambda *_: None, "no error"), (lambda *_: 1 / 0, "ZeroDivisionError")])
def test_another_error_than_the_expected_one_is_found(provoke, text, monkeypatch):
    monkeypatch.setitem(errors.PROVOKED, "refusal", (provoke, BrickError))
    assert text in str(errors.CAMPAIGN.run(1, range(1)).violations)
