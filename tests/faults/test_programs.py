"""Any program file in the simulated brick: a sample of the campaign, and proof that it finds failures."""

from __future__ import annotations

from nxtdrive.tools.dev.faults.campaign import batch_of
from nxtdrive.tools.dev.faults.programs import CAMPAIGN
from sim_backend.firmware.vm.memory import Memory

SAMPLE = 200


def test_a_sample_of_programs_is_harmless():
    tally = CAMPAIGN.run(1, range(SAMPLE))
    assert tally.violations == []
    assert tally.outcomes.total() == SAMPLE
    assert tally.outcomes["started, running"] > 0


def test_an_exception_in_the_interpreter_is_found_and_the_trial_is_reproducible(monkeypatch):
    monkeypatch.setattr(Memory, "set_bytes", lambda *_: None + 1)
    found = CAMPAIGN.run(1, range(CAMPAIGN.batch)).violations[0]
    assert "TypeError" in found.text
    assert CAMPAIGN.run(1, batch_of(CAMPAIGN, found.number)).violations[-1] == found
