"""docs/agentspeak.md lists all verbs and numbers of the protocol."""

from __future__ import annotations

import re
from pathlib import Path

from behaviors.line_protocol import LINE_LIMIT, ErrorReply, Verb, Why

TEXT = (Path(__file__).parents[2] / "docs" / "agentspeak.md").read_text(encoding="utf-8")


def test_every_verb_is_listed_in_order():
    assert re.findall(r"^\| `([a-z_]+)(?: [^`]+)?` \| \w+ ", TEXT, re.MULTILINE)[: len(Verb)] == list(Verb)


def test_every_number_is_listed():
    listed = re.findall(r"^\| (-?\d+) \| (\w+) \|", TEXT, re.MULTILINE)
    assert listed == [(str(member.value), member.name.lower()) for numbers in (ErrorReply, Why) for member in numbers]


def test_the_limit_of_a_line_is_named():
    assert f"at most {LINE_LIMIT} bytes" in TEXT
