"""A mission that halts at each decision until its caller has taken one: the caller and the mission take turns.

The mission runs in a thread of its own, but never at the same time as its caller, so its course depends on the
decisions alone. While it halts the robot stands still, since every skill ends at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from queue import SimpleQueue
from threading import Thread

from behaviors.executive import Report
from behaviors.operator import Ask, Question
from behaviors.pause import Pause
from behaviors.recoveries import Choice


class SteppedMission:
    """A mission, decision by decision.

    Args:
        run: Runs the mission, which asks for each decision (see `behaviors.profiles.registry.supervised`) and obeys the
            pause, by which `end` ends it.

    Attributes:
        question: The decision that is to be taken; None before the first step and after the end.
        report: The mission's result, once it has ended.
    """

    def __init__(self, run: Callable[[Ask, Pause], Report]) -> None:
        self.question: Question | None = None
        self.report: Report | None = None
        self._run = run
        self._pause = Pause()
        self._answers: SimpleQueue[Choice | None] = SimpleQueue()
        self._turns: SimpleQueue[BaseException | None] = SimpleQueue()
        self._thread: Thread | None = None

    def step(self, number: int = 0) -> Question | None:
        """Take a candidate, or begin the mission, and run it to its next decision; returns that, or None at the end.

        Args:
            number: Index of the candidate; 0 is the one that the profile proposes, and begins a mission.

        Raises:
            IndexError: There is no such candidate.
            Exception: An error of the mission; the motors are off.
        """
        candidates = self.question.candidates if self.question else ()
        if not 0 <= number < max(1, len(candidates)):
            raise IndexError(number)
        if self._thread is None:
            self._thread = Thread(target=self._work, daemon=True)
            self._thread.start()
        elif self.question is not None:
            self._answers.put(candidates[number].choice)
        else:
            return None
        return self._wait()

    def end(self) -> None:
        """End the mission as Ctrl-C does, halted or not, and wait until it has ended; its errors are ignored."""
        if self._thread is not None:
            self._pause.end()
            self._answers.put(None)
            self._thread.join()

    def _wait(self) -> Question | None:
        """Let the mission run; it hands the turn back when it asks and when it ends."""
        error = self._turns.get()
        if error is not None:
            raise error
        return self.question

    def _work(self) -> None:
        error: BaseException | None = None
        try:
            self.report = self._run(self._ask, self._pause)
        except BaseException as raised:  # noqa: BLE001 - raised again in the caller's thread
            error = raised
        self.question = None
        self._turns.put(error)

    def _ask(self, question: Question) -> Choice:
        self.question = question
        self._turns.put(None)
        choice = self._answers.get()
        if choice is None:
            raise KeyboardInterrupt
        return choice
