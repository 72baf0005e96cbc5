"""Questions to the clients of the page."""

from __future__ import annotations

import pytest

from behaviors.pause import Pause
from nxtdrive.tools.web.answers import Answers


def test_the_first_answer_to_a_question_counts():
    answers = Answers[str, float](Pause())

    def reply(number: int) -> None:
        assert answers.open == (number, "how far?")
        assert answers.answer(number, 30.0)
        for late in (number, -number, 0):
            assert not answers.answer(late, 40.0)

    assert answers.ask("how far?", reply) == 30.0
    assert answers.open is None


def test_a_question_of_what_was_ended_gets_no_answer():
    pause = Pause()
    answers = Answers[str, float](pause)
    with pytest.raises(KeyboardInterrupt):
        answers.ask("how far?", lambda _: pause.end())
    assert not answers.answer(1, 30.0)
