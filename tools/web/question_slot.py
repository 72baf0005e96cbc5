"""Questions to the clients: the robot's thread waits for the answer, any other thread gives it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from behaviors.pause import Pause

CHECK_INTERVAL_S = 0.2
"""How often a wait for an answer checks for signals, which an unlimited wait ignores on Windows."""

Q = TypeVar("Q")
A = TypeVar("A")


class QuestionSlot(Generic[Q, A]):
    """Holds the question that waits for an answer, if there is one; the first answer to each is taken.

    Args:
        pause: Has the request to end the mission or calibration that asks.

    Attributes:
        number: Of the latest question, from 1.
    """

    def __init__(self, pause: Pause) -> None:
        self._pause = pause
        self._changed = threading.Condition()
        self.number = 0
        self._open: tuple[int, Q] | None = None
        self._answer: A | None = None

    @property
    def open(self) -> tuple[int, Q] | None:
        """The question that waits for an answer, with its number, if there is one."""
        return self._open

    def ask(self, question: Q, show: Callable[[int], None]) -> A:
        """Ask, and wait for the answer.

        Args:
            question: The question.
            show: Shows it to the clients, with this number.

        Raises:
            KeyboardInterrupt: What asks was ended instead.
        """
        with self._changed:
            self.number += 1
            self._answer, self._open = None, (self.number, question)
            try:
                show(self.number)
                while self._answer is None:
                    self._pause.check_end()
                    self._changed.wait(CHECK_INTERVAL_S)
                return self._answer
            finally:
                self._open = None

    def answer(self, number: int, answer: A) -> bool:
        """Answer a question; return whether it was open. Any thread."""
        with self._changed:
            if self._open is None or self._open[0] != number:
                return False
            self._answer, self._open = answer, None
            self._changed.notify_all()
            return True

    def wake(self) -> None:
        """Check now whether what asks is to end; any thread."""
        with self._changed:
            self._changed.notify_all()
