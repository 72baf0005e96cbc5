"""Counts of passes, of which the scheduler skips some."""

from __future__ import annotations

import pytest

from sim_backend.firmware.module import Clock
from sim_backend.firmware.ui.pass_counter import PassCounter


class Passes:
    """A counter and the passes that run; in all of them something counts `per_pass` times."""

    def __init__(self, per_pass: int) -> None:
        self._clock = Clock(0)
        self.counter, self._per_pass = PassCounter(self._clock), per_pass

    def run(self, *times_ms: int, counts: bool = True) -> int:
        """Run passes, and skip those between them; return the count."""
        for self._clock.now_ms in times_ms:
            self.counter.settle()
            for _ in range(self._per_pass if counts else 0):
                self.counter.count()
        return self.counter.value


@pytest.mark.parametrize("per_pass", [1, 2])
def test_skipped_passes_count_like_the_one_before_them(per_pass):
    assert Passes(per_pass).run(1, 2, 10) == 10 * per_pass


def test_passes_without_a_count_stand_still():
    passes = Passes(1)
    passes.run(1, 5)
    assert passes.run(6, 90, counts=False) == 5
    assert passes.run(91) == 6


def test_a_count_that_was_restarted_begins_in_the_next_pass():
    passes = Passes(1)
    passes.run(1, 5)
    passes.counter.restart()
    assert passes.run(6) == 1
    assert passes.run(10) == 5
