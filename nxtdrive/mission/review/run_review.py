"""Observe a run and give hints, each of which comes from a check of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from behaviors.journal import Record, RecordKind
from nxtdrive.mission.review import build, equipment, recognition, sizes
from nxtdrive.mission.review.reviewed_run import Hints, ReviewedRun, Transition

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.vision.camera import Frame

Check = Callable[[ReviewedRun, Transition], Hints]

AT_ARRIVAL: Sequence[Check] = (recognition.something_else, sizes.size_at_arrival, sizes.scale)
AT_OTHER_TRANSITIONS: Sequence[Check] = (
    sizes.range_mismatch,
    recognition.never_seen,
    equipment.weak_link,
    equipment.slipping_wheel,
    build.ports,
)
GIVEN_UP = ("given_up", "time_up")
"""Endings of a mission that had time to reach its targets."""


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
        self._sonar, self._lens = equipment.DeafSonar(run.mission.robot.ultrasonic), equipment.FoggedLens()

    def compare_brick(self, brick: Brick) -> None:
        """Give a hint if the mission or its robot file describes another robot."""
        self._give(build.another_build(self.run))
        self._give(build.another_brick(self.run, brick))

    def see(self, frame: Frame) -> None:
        """Learn from a frame that the robot looks at."""
        self._lens.see(frame)

    def __call__(self, record: Record) -> None:
        """Learn from a record."""
        match record.kind:
            case RecordKind.LOOK:
                self.run.learn_look(record)
                self._give(self._sonar.look(self.run.look))
                self._give(self._lens.look(self.run.look))
            case RecordKind.SENSOR:
                self._sonar.changed(record.data)
            case RecordKind.CALL:
                self._give(build.weak_battery(self.run, record.data.get("battery_mv")))
            case RecordKind.TRANSITION:
                self._review_transition(record)
            case RecordKind.END:
                self._give(sizes.stops_before_target(self.run))
                if record.data.get("ending") in GIVEN_UP:
                    self._give(recognition.not_reached(self.run))
                    self._give(build.motors(self.run))

    def _review_transition(self, record: Record) -> None:
        transition, arrived = Transition(record), record.data.get("to") == "reached"
        if arrived:
            self.run.learn_arrival(transition, record.time_s)
        for check in AT_ARRIVAL if arrived else AT_OTHER_TRANSITIONS:
            self._give(check(self.run, transition))
        if not arrived:
            sizes.note_stop(self.run, transition)

    def _give(self, hints: Hints) -> None:
        for target, text in hints:
            if target not in self._reported:
                self._reported |= {target} - {""}
                self.hints.append(text)
                self._say(text)
