"""Any telegram to the simulated brick: a sample of the campaign, and proof that it finds violations."""

from __future__ import annotations

import pytest

from nxtdrive.tools.dev.faults.campaign import batch_of
from nxtdrive.tools.dev.faults.telegrams import CAMPAIGN
from sim_backend.firmware.live_map import LiveMap

SAMPLE = 1500


def test_a_sample_of_telegrams_is_harmless():
    tally = CAMPAIGN.run(1, range(SAMPLE))
    assert tally.violations == []
    assert tally.outcomes.total() == SAMPLE
    assert tally.outcomes["carried out"] > SAMPLE / 5


def test_a_brick_that_fails_over_a_telegram_is_found_and_the_trial_is_reproducible(monkeypatch):
    monkeypatch.setattr(LiveMap, "settle", lambda *_: 1 / 0)
    found = CAMPAIGN.run(1, range(CAMPAIGN.batch)).violations
    assert "ZeroDivisionError" in found[0].text
    assert CAMPAIGN.run(1, batch_of(CAMPAIGN, found[-1].number)).violations[-1] == found[-1]


@pytest.mark.parametrize("seed", [1, 2])
def test_equal_seeds_give_equal_tallies(seed):
    assert CAMPAIGN.run(seed, range(100)) == CAMPAIGN.run(seed, range(100))


@pytest.mark.parametrize("number", [34249, 63749])
def test_a_telegram_longer_than_the_bluetooth_buffer_has_a_reply_for_each_piece(number):
    tally = CAMPAIGN.run(41, batch_of(CAMPAIGN, number))
    assert tally.violations == []
    assert tally.outcomes["split"] == 1


def test_a_write_over_its_own_opcode_gets_a_reply_with_what_it_wrote():
    assert CAMPAIGN.run(91, batch_of(CAMPAIGN, 89377)).violations == []
