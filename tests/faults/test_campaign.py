"""The runner of the fault campaigns: counts, seeds, reproduction of one trial."""

from __future__ import annotations

from collections import Counter

import pytest

from nxtdrive.tools.dev.faults import __main__ as command
from nxtdrive.tools.dev.faults import telegrams
from nxtdrive.tools.dev.faults.campaign import Campaign, Tally, Violation, batch_of, run_campaign


def _odd_multiples_of_seven(seed: int, numbers: range) -> Tally:
    tally = Tally()
    for number in numbers:
        if (number + seed) % 7 == 0 and number % 2:
            tally.violations.append(Violation(number, "odd"))
        else:
            tally.outcomes["even"] += 1
    return tally


CAMPAIGN = Campaign("No odd multiples.", "numbers", count=100, batch=8, run=_odd_multiples_of_seven)


def test_all_trials_are_made_once_and_in_order():
    *_, (made, tally) = run_campaign(CAMPAIGN, 0, 100)
    assert made == 100
    assert [violation.number for violation in tally.violations] == [7, 21, 35, 49, 63, 77, 91]
    assert tally.outcomes == Counter(even=93)


def test_two_processes_make_the_same_trials_as_one():
    alone, shared = ([*run_campaign(telegrams.CAMPAIGN, 0, 2 * telegrams.BATCH, workers)] for workers in (1, 2))
    assert shared == alone


def test_one_trial_is_reproduced_with_those_before_it_in_its_batch():
    assert batch_of(CAMPAIGN, 21) == range(16, 22)
    assert CAMPAIGN.run(0, batch_of(CAMPAIGN, 21)).violations[-1].number == 21


def test_an_unknown_campaign_is_refused_with_the_known_ones(capsys):
    with pytest.raises(SystemExit) as left:
        command.main(["nosuch"])
    assert left.value.code == 2
    assert "nosuch" in capsys.readouterr().err


@pytest.mark.parametrize("name", command.CAMPAIGNS)
def test_each_campaign_states_its_guarantee(name):
    assert command.load(name).guarantee.endswith(".")
