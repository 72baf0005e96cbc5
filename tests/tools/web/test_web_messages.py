"""Messages that a page may send, and refused ones."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nxtdrive.tools.web.messages import Drive, StartMission, Stop, read_message


def test_messages_are_read():
    assert read_message('{"type": "stop"}') == Stop(type="stop")
    assert read_message('{"type": "drive", "ahead": 0.5, "turn": -1}') == Drive(type="drive", ahead=0.5, turn=-1.0)
    assert read_message('{"type": "start_mission"}') == StartMission(type="start_mission")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        '{"type": "fly"}',
        '{"type": "drive"}',
        '{"type": "drive", "ahead": 1.5, "turn": 0}',
        '{"type": "drive", "ahead": NaN, "turn": 0}',
        '{"type": "stop", "more": 1}',
        '{"type": "answer", "question": 1, "choice": -1}',
        '{"type": "answer", "question": true, "choice": 0}',
        '{"type": "speed_limit", "percent": "50"}',
        '{"type": "start_mission", "confirm": "no"}',
        "[" * 100_000,
    ],
)
def test_anything_else_is_refused_with_a_sentence(text):
    with pytest.raises(ValueError, match=r"\w"):
        read_message(text)


@settings(max_examples=40)
@given(
    st.recursive(st.none() | st.booleans() | st.floats() | st.text(), lambda inner: st.dictionaries(st.text(), inner))
)
def test_no_json_raises_anything_but_value_error(value):
    with pytest.raises(ValueError, match=r"\w"):
        read_message(json.dumps(value))
