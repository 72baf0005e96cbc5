"""Keys and written menus: a sample of the campaign, and proof that it finds violations."""

from __future__ import annotations

from nxtdrive.tools.dev.faults.campaign import batch_of
from nxtdrive.tools.dev.faults.menus import CAMPAIGN
from sim_backend.firmware.ui.menu_place import MenuPlace

SAMPLE = 4000


def test_a_sample_of_actions_is_harmless():
    tally = CAMPAIGN.run(1, range(SAMPLE))
    assert tally.violations == []
    assert tally.outcomes.total() == SAMPLE


def test_menus_that_fail_are_found_and_the_trial_is_reproducible(monkeypatch):
    monkeypatch.setattr(MenuPlace, "go_up", lambda *_: [].pop())
    found = CAMPAIGN.run(1, range(CAMPAIGN.batch)).violations
    assert "IndexError" in found[0].text
    assert CAMPAIGN.run(1, batch_of(CAMPAIGN, found[-1].number)).violations[-1] == found[-1]


def test_equal_seeds_give_equal_tallies():
    assert CAMPAIGN.run(2, range(200)) == CAMPAIGN.run(2, range(200))
