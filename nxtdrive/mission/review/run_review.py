"""Observe a run and give hints, each of which comes from a check of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from behaviors.journal import Record
from nxtdrive.mission.review import build, recognition, sizes
from nxtdrive.mission.review.reviewed_run import Hints, Moment, ReviewedRun

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

Check = Callable[[ReviewedRun, Moment], Hints]


class RunReview:
    """Observes a run; receives its records.

    Args:
        run: The run, which learns from them.
        say: Called with each hint, as soon as there is one.

    Attributes:
        run: As given.
        hints: What to check or change, one sentence or two each; about a target only the first.
    """

    def __init__(self, run: ReviewedRun, say: Callable[[str], None]) -> None:
        self.hints: list[str] = []
        self.run, self._say, self._reported = run, say, set[str]()
        self._checks: list[Check] = [
            recognition.something_else,
            sizes.size_at_arrival,
            sizes.range_mismatch,
            sizes.scale,
            recognition.not_in_this_world,
            recognition.too_high,
            recognition.not_recognised,
            build.WeakBattery(),
            build.ports,
            sizes.StopsBeforeTarget(),
            recognition.not_reached,
            build.motors,
        ]

    def compare_brick(self, brick: Brick) -> None:
        """Give a hint if the mission or its robot file describes another robot."""
        self._give(build.another_build(self.run))
        self._give(build.another_brick(self.run, brick))

    def __call__(self, record: Record) -> None:
        """Learn from a record."""
        moment = self.run.learn(record)
        for check in self._checks:
            self._give(check(self.run, moment))

    def _give(self, hints: Hints) -> None:
        for target, text in hints:
            if target not in self._reported:
                self._reported |= {target} - {""}
                self.hints.append(text)
                self._say(text)
