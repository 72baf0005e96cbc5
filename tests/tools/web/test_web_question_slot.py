"""Questions to the clients of the page."""

from __future__ import annotations

import pytest

from behaviors.pause import Pause
from nxtdrive.tools.web.question_slot import QuestionSlot


def test_the_first_answer_to_a_question_counts():
    slot = QuestionSlot[str, float](Pause())

    def reply(number: int) -> None:
        assert slot.open == (number, "how far?")
        assert slot.answer(number, 30.0)
        for late in (number, -number, 0):
            assert not slot.answer(late, 40.0)

    assert slot.ask("how far?", reply) == 30.0
    assert slot.open is None


def test_a_question_of_what_was_ended_gets_no_answer():
    pause = Pause()
    slot = QuestionSlot[str, float](pause)
    with pytest.raises(KeyboardInterrupt):
        slot.ask("how far?", lambda _: pause.end())
    assert not slot.answer(1, 30.0)
