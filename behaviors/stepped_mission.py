"""A mission that halts at each decision until its caller has taken one: the caller and the mission take turns.

The mission runs in a thread of its own, but never at the same time as its caller, so its course depends on the
decisions alone. While it halts the robot stands still, since every skill ends at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from queue import SimpleQueue
from threading import Event, Thread

from behaviors.executive import Report
from behaviors.operator import Ask, Question
from behaviors.pause import Pause
from behaviors.recoveries import Choice

NOTICE_S = 0.2
"""Python notices a Ctrl-C that comes just before it begins to wait only when the wait is over, so waits are short."""


class SteppedMission:
    """A mission, decision by decision.

    Args:
        run: Runs the mission, which asks for each decision (see `behaviors.profiles.registry.supervised`) and obeys the
            pause, by which `end` ends it.

    Attributes:
        question: The decision that is to be taken; None before the first step, after an interrupted one, and after the
            end.
        report: The mission's result, once it has ended by itself or was ended.
        broke: Whether an error ended it instead.
    """

    def __init__(self, run: Callable[[Ask, Pause], Report]) -> None:
        self.question: Question | None = None
        self.report: Report | None = None
        self.broke = False
        self._run = run
        self._pause = Pause()
        self._answers: SimpleQueue[Choice | None] = SimpleQueue()
        self._halted = Event()
        self._asked: Question | None = None
        self._error: BaseException | None = None
        self._thread: Thread | None = None

    def step(self, number: int = 0) -> Question | None:
        """Take a candidate, or begin the mission, and run it to its next decision; returns that, or None at the end.

        After a step that Ctrl-C interrupted this takes nothing: it waits for the decision that was not returned.

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
            self._halted.clear()
            self.question = None
            self._answers.put(candidates[number].choice)
        while not self._halted.wait(NOTICE_S):
            pass
        self.question = self._asked
        error, self._error = self._error, None
        if error is not None:
            raise error
        return self.question

    def end(self) -> None:
        """End the mission as Ctrl-C does, halted or not, and wait until it has ended; its errors are ignored."""
        if self._thread is not None:
            self._pause.end()
            self._answers.put(None)
            self._thread.join()
            self.question = self._error = None

    def _work(self) -> None:
        try:
            self.report = self._run(self._ask, self._pause)
        except BaseException as error:  # noqa: BLE001 - raised again in the caller's thread
            self._error, self.broke = error, True
        self._asked = None
        self._halted.set()

    def _ask(self, question: Question) -> Choice:
        self._asked = question
        self._halted.set()
        choice = self._answers.get()
        if choice is None:
            raise KeyboardInterrupt
        return choice
