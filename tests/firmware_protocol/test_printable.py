"""Text from outside, made safe to print."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.printable import printable, printable_lines


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("NXT", "NXT"),
        ("ねこ °× é", "ねこ °× é"),
        ("[/] [bold]", "[/] [bold]"),
        ("a\x1b[2Jb", r"a\x1b[2Jb"),
        ("a\nb\r\tc", r"a\nb\r\tc"),
        ("\x00\x07\x7f\x9b", r"\x00\x07\x7f\x9b"),
        ("exe.\u202etxt", r"exe.\u202etxt"),
        ("\u2028\u2066", r"\u2028\u2066"),
        ("caf\udce9", r"caf\udce9"),
    ],
)
def test_what_a_terminal_would_interpret_is_shown_instead(text, shown):
    assert printable(text) == shown


@given(st.text(st.characters()))
def test_any_text_is_one_line_that_can_be_encoded(text):
    shown = printable(text)
    assert not {unicodedata.category(each) for each in shown} & {"Cc", "Cs", "Zl", "Zp"}
    assert not {unicodedata.bidirectional(each) for each in shown} & {"LRE", "RLE", "LRO", "RLO", "LRI", "RLI", "FSI"}
    shown.encode()
    assert printable(shown) == shown


def test_our_own_line_feeds_stay():
    assert printable_lines("one\ntwo\x1b") == "one\ntwo\\x1b"
