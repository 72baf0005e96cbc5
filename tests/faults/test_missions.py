"""A sample of the campaign of random missions, and proof that it finds violations."""

from __future__ import annotations

from itertools import count

import pytest

from behaviors.journal import Record, RecordKind
from nxtdrive.tools.dev.faults import missions
from nxtdrive.tools.dev.faults.random_missions import draw
from sim_backend.simulation import Simulation


@pytest.mark.slow
def test_a_sample():
    tally = missions.CAMPAIGN.run(1, range(6, 9))
    assert tally.violations == []
    assert tally.outcomes.total() == 3


@pytest.fixture
def monitor(tmp_path):
    trials = (draw(1, number, tmp_path, camera=False) for number in count())
    drawn = next(each for each in trials if each.described and each.mission.mission.profile == "adaptive")
    return missions.TruthMonitor(Simulation(drawn.world, seed=drawn.seed), drawn)


def test_a_claim_of_a_target_that_the_robot_is_not_at_is_found(monitor):
    monitor(Record(3.0, RecordKind.TRANSITION, "verify", "nothing here", {"to": "reached"}))
    assert "wrong stop" in monitor.wrong[0]


def _choice(time_s: float, what: str = "move_to") -> Record:
    return Record(time_s, RecordKind.CHOICE, "select", "lena", {"choice": what, "evidence": {"reason": "no_way"}})


def _look(x_mm: float) -> Record:
    return Record(0.0, RecordKind.LOOK, "search", "lena", {"pose": [x_mm, 0.0, 0.0]})


@pytest.mark.parametrize(
    ("records", "found"),
    [
        ([_choice(1.0), _choice(3.0), _choice(5.0)], ["recovery number 3"]),
        ([_choice(1.0), _choice(3.0), _look(300.0), _choice(5.0)], []),
        ([_choice(1.0), _choice(3.0), _choice(5.0, "change_target"), _choice(7.0)], []),
        ([_choice(1.0), _choice(1.5)], ["two decisions within 0.500 s"]),
    ],
)
def test_decisions_that_repeat_themselves_are_found(monitor, records, found):
    for record in records:
        monitor(record)
    assert len(monitor.livelocks()) == len(found)
    assert all(text.startswith(begin) for text, begin in zip(monitor.livelocks(), found, strict=True))
