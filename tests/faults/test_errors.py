"""The campaign of errors: a sample, and that it finds broken promises."""

from __future__ import annotations

import pytest

from firmware_protocol.errors import BrickError, LinkTimeout
from nxtdrive.tools.dev.faults import errors

FEW = range(20 * len(errors.PROVOKED))


def test_a_sample():
    tally = errors.CAMPAIGN.run(1, FEW)
    assert tally.violations == []
    assert set(tally.outcomes) == set(errors.PROVOKED)


def test_what_is_left_behind_is_found(monkeypatch):
    kept = []

    def leave_behind(*_):
        kept.append(bytearray(100_000))
        raise LinkTimeout("too late.")

    monkeypatch.setitem(errors.PROVOKED, "timeout", (leave_behind, (LinkTimeout,)))
    monkeypatch.setattr(errors, "WARM", 10)
    assert "bytes behind" in str(errors.CAMPAIGN.run(1, FEW).violations)


@pytest.mark.parametrize(("provoke", "text"), [(lambda *_: None, "no error"), (lambda *_: 1 / 0, "ZeroDivisionError")])
def test_another_error_than_the_promised_one_is_found(provoke, text, monkeypatch):
    monkeypatch.setitem(errors.PROVOKED, "refusal", (provoke, (BrickError,)))
    assert text in str(errors.CAMPAIGN.run(1, range(1)).violations)
