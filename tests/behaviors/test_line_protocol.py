"""The line protocol's grammar: the meaning of a line, and that no bytes break it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.line_protocol import (
    LINE_LIMIT,
    THESIS_FAILURES,
    BadLine,
    ErrorReply,
    Request,
    RequestReader,
    Verb,
    parse,
)


@pytest.mark.parametrize(
    ("line", "request_"),
    [
        (b"connect", Request(Verb.CONNECT)),
        (b"connect\r", Request(Verb.CONNECT)),
        (b"  select  ", Request(Verb.SELECT)),
        (b"select()", Request(Verb.SELECT)),
        (b"arrive", Request(Verb.ARRIVE)),
        (b"arrive lena", Request(Verb.ARRIVE, "lena")),
        (b"arrive(lena)\r", Request(Verb.ARRIVE, "lena")),
        (b'arrive("the red door")', Request(Verb.ARRIVE, "the red door")),
        ("target ねこ".encode(), Request(Verb.TARGET, "ねこ")),
        (b"choose", Request(Verb.CHOOSE, number=0)),
        (b"choose 3", Request(Verb.CHOOSE, number=3)),
        (b"choose(12)\r", Request(Verb.CHOOSE, number=12)),
        (b"evidence()", Request(Verb.EVIDENCE)),
        (b"move_to 90", Request(Verb.MOVE_TO, direction_deg=90.0)),
        (b"move_to( -45.5 )", Request(Verb.MOVE_TO, direction_deg=-45.5)),
    ],
)
def test_a_line_is_a_verb_and_perhaps_an_argument(line, request_):
    assert parse(line) == request_


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        (b"", ErrorReply.UNKNOWN_VERB),
        (b"dance", ErrorReply.UNKNOWN_VERB),
        (b"ARRIVE", ErrorReply.UNKNOWN_VERB),
        (b"(90)", ErrorReply.UNKNOWN_VERB),
        (b"\xff\xfe", ErrorReply.UNKNOWN_VERB),
        (b"target", ErrorReply.BAD_ARGUMENT),
        (b"stop now", ErrorReply.BAD_ARGUMENT),
        (b"target " + b"x" * LINE_LIMIT, ErrorReply.BAD_ARGUMENT),
        (b"choose -1", ErrorReply.BAD_ARGUMENT),
        (b"choose 1.5", ErrorReply.BAD_ARGUMENT),
        ("choose \u0663".encode(), ErrorReply.BAD_ARGUMENT),
        (b"evidence now", ErrorReply.BAD_ARGUMENT),
        (b"move_to", 1),
        (b"move_to right", 1),
        (b"move_to nan", 1),
        (b"move_to -inf", 1),
        (b"move_to 361", 1),
        (b"arrivelena", 2),
        (b"arrive " + b"x" * LINE_LIMIT, 2),
        (b"connect now", 0),
        (b"select\0", 0),
        (b"bye bye", 0),
    ],
)
def test_a_line_that_is_not_a_request_has_its_reply(line, reply):
    bad = parse(line)
    assert isinstance(bad, BadLine)
    assert bad.reply == reply


@given(st.binary(max_size=2 * LINE_LIMIT))
def test_any_bytes_are_a_request_or_a_bad_line(line):
    assert isinstance(parse(line), Request | BadLine)


@given(st.sampled_from(sorted(THESIS_FAILURES)), st.binary(max_size=2 * LINE_LIMIT))
def test_a_line_that_begins_with_a_verb_of_the_thesis_is_never_answered_by_an_unknown_number(verb, rest):
    line = parse(verb.encode() + rest.replace(b"\n", b""))
    assert isinstance(line, Request) or line.reply in (0, 1, 2)


@given(st.lists(st.sampled_from([b"arrive(lena)", b"stop", b"x" * 300, b"\xff", b"", b"move_to 9"])), st.data())
def test_requests_do_not_depend_on_how_the_bytes_arrive(lines, data):
    stream = b"".join(line + data.draw(st.sampled_from([b"\n", b"\r\n"])) for line in lines)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)))))
    reader = RequestReader()
    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        reader.feed(stream[start:end])
    assert [reader.take() for _ in lines] == [parse(line) for line in lines]
    assert reader.take() is None


@given(st.lists(st.binary(max_size=600)))
def test_every_line_counts_once_whatever_its_bytes(chunks):
    reader = RequestReader()
    for chunk in chunks:
        reader.feed(chunk)
    assert len(reader) == b"".join(chunks).count(b"\n")


def test_a_stop_is_seen_behind_other_lines():
    reader = RequestReader()
    reader.feed(b"arrive\nmove_to 90\nsto")
    assert not reader.stop_waits
    reader.feed(b"p\r\n")
    assert reader.stop_waits
    assert [reader.take() for _ in range(3)][-1] == Request(Verb.STOP)
    assert not reader.stop_waits
