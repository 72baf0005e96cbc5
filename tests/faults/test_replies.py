"""Hostile replies to the driver: a sample of the campaign, and proof that it finds violations."""

from __future__ import annotations

from firmware_protocol.dialogue import Dialogue
from nxtdrive.tools.dev.faults.campaign import batch_of
from nxtdrive.tools.dev.faults.replies import CAMPAIGN

SAMPLE = 750


def test_a_sample_of_replies_is_harmless():
    tally = CAMPAIGN.run(1, range(250)), CAMPAIGN.run(1, range(250, 500)), CAMPAIGN.run(1, range(500, SAMPLE))
    assert [each.violations for each in tally] == [[], [], []]
    assert sum(each.outcomes.total() for each in tally) == SAMPLE


def test_an_error_that_is_not_the_drivers_own_is_found(monkeypatch):
    monkeypatch.setattr(Dialogue, "expire", lambda _: KeyError("expired"))
    found = CAMPAIGN.run(1, range(40)).violations
    assert "KeyError" in found[0].text
    assert CAMPAIGN.run(1, batch_of(CAMPAIGN, found[-1].number)).violations[-1] == found[-1]


def _careless(dialogue, command, now, timeout_s, opened=Dialogue.open):
    """Open a request, but forget what its reply repeats."""
    request = opened(dialogue, command, now, timeout_s)
    dialogue._expected = dialogue._expected[:3]
    return request


def test_the_value_of_another_request_is_found(monkeypatch):
    monkeypatch.setattr(Dialogue, "open", _careless)
    texts = [violation.text for violation in CAMPAIGN.run(1, range(CAMPAIGN.batch)).violations]
    assert any("gets the reply" in text for text in texts)
