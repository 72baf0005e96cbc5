"""The campaign of a day: with short hours, and proof that it finds violations."""

from __future__ import annotations

import pytest

from nxtdrive.link import link
from nxtdrive.tools.dev.faults import soak


@pytest.fixture
def short_hours(monkeypatch):
    """Hours of three minutes, of which none is traced."""
    monkeypatch.setattr(soak, "HOUR_S", 180.0)
    monkeypatch.setattr(soak, "POLLS", 20)
    monkeypatch.setattr(soak, "TRACED_EVERY", 100)


def test_a_sample(short_hours):
    tally = soak.CAMPAIGN.run(1, range(1))
    assert tally.violations == []
    assert tally.outcomes["hour without a finding"] == 1


def test_a_timer_that_drifts_is_found(short_hours, monkeypatch):
    monkeypatch.setattr(link, "PROBE_S", 3.0)
    monkeypatch.setattr(soak, "pursue", lambda *_: [])
    assert "keep-alive telegrams in an hour" in str(soak.CAMPAIGN.run(1, range(1)).violations)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("traced_every", "found"), [(100, "more objects"), pytest.param(1, "bytes behind", marks=pytest.mark.nightly)]
)
def test_memory_that_grows_is_found(short_hours, monkeypatch, traced_every, found):
    kept = []
    monkeypatch.setattr(soak, "pursue", lambda *_: kept.append([bytes(100 + i % 2) for i in range(2000)]) or [])
    monkeypatch.setattr(soak, "TRACED_EVERY", traced_every)
    assert found in str(soak.CAMPAIGN.run(1, range(3)).violations)


@pytest.mark.nightly
def test_three_hours(monkeypatch):
    """Of 20 minutes: longer than the time after which an idle brick switches itself off."""
    monkeypatch.setattr(soak, "HOUR_S", 1200.0)
    monkeypatch.setattr(soak, "POLLS", 200)
    monkeypatch.setattr(soak, "BEFORE_WRAP_MS", 30 * 60 * 1000)
    tally = soak.CAMPAIGN.run(1, range(3))
    assert tally.violations == []
    assert tally.outcomes["counter of the brick that wrapped"] == 1
