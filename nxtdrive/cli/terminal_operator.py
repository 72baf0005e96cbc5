"""Ask the operator at the terminal before the robot recovers."""

from __future__ import annotations

import select
import sys
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from firmware_protocol.printable import printable
from input_files.mistakes import excerpt
from input_files.plain import whole_number
from nxtdrive.cli.output import make_console
from nxtdrive.cli.views.decision import CandidateTable, known_lines
from nxtdrive.recording.wording import reason_words

if TYPE_CHECKING:
    from behaviors.operator import Question
    from behaviors.recoveries import Choice
    from nxtdrive.recording.status_line import StatusLine

STOP = "s"
CHECK_INTERVAL_S = 0.2
"""How often a wait for the operator checks for signals."""


class TerminalOperator:
    """Asks the operator at a terminal; see `behaviors.operator.Ask`.

    The robot stands still until the answer. The link's own thread keeps real links awake; simulated time stands still.

    Args:
        status: Line that is hidden while the question is open.
        console: The terminal; standard error by default.
    """

    def __init__(self, status: StatusLine, console: Console | None = None) -> None:
        self._status = status
        self._console = console or make_console(stderr=True)

    def __call__(self, question: Question) -> Choice:
        """Ask until the answer is valid.

        Raises:
            KeyboardInterrupt: The operator stops the mission.
        """
        with self._status.paused():
            self._show(question)
            return self._answer(question)

    def _show(self, question: Question) -> None:
        evidence, console = question.evidence, self._console
        console.print()
        console.print(Text(printable(f"{evidence.target}: {reason_words(evidence.reason)}"), style="bold"))
        console.print(known_lines(evidence))
        numbers = [str(i) for i in range(1, len(question.candidates) + 1)]
        console.print(CandidateTable(question.candidates, numbers, chosen=0))
        console.print(Text(printable(f"proposed: 1, {question.proposed.why}")))

    def _answer(self, question: Question) -> Choice:
        count = len(question.candidates)
        others = "" if count == 1 else "number: do that instead, "
        while True:
            try:
                self._console.print(f"Enter: do 1, {others}{STOP}: stop the mission > ", end="")
                _await_line()
                answer = input()
            except EOFError:
                raise KeyboardInterrupt from None
            answer = answer.strip().lower()
            if answer == STOP:
                raise KeyboardInterrupt
            if not answer:
                return question.proposed
            if (number := whole_number(answer)) is not None and 1 <= number <= count:
                return question.candidates[number - 1].choice
            self._console.print(f"There is no {excerpt(answer)}.", markup=False)


def _await_line() -> None:
    """Wait until a line has been typed; a signal that arrives just before a blocking read would not be noticed."""
    if sys.platform != "win32" and sys.stdin.isatty():  # Windows cannot wait for a console
        while not select.select([sys.stdin], [], [], CHECK_INTERVAL_S)[0]:
            pass
