"""Telegrams without lengths: any number of them that was sent at once is split correctly."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.direct import LSWrite, MessageWrite, SetProperty
from firmware_protocol.enums import Property
from firmware_protocol.system import IOMapWrite, Write
from firmware_protocol.telegram import COMMANDS
from sim_backend.doors.splitter import END_S, SHORT_S, TelegramSplitter

TAILED = [
    MessageWrite.text(3, "hello"),
    LSWrite(3, 2, 8, b"\x02\x42"),
    IOMapWrite(0x00020001, 12, 3, b"abc"),
    SetProperty.volume(3),
    SetProperty(Property.SLEEP_TIME, (600_000).to_bytes(4, "little")),
    SetProperty(Property.BLUETOOTH, b"\1"),
]
FIXED = [command for command in COMMANDS.values() if not command.layout.tail]
GET_BATTERY = bytes.fromhex("00 0b")


def _example(command, rng):
    header = bytes((command.kind | rng.choice((0, 0x80)), command.opcode))
    return header + rng.randbytes(command.layout.size)


def _split(pieces, silent_s=0.0):
    splitter = TelegramSplitter()
    found = []
    for piece in pieces:
        splitter.feed(piece)
        while (telegram := splitter.next(silent_s)) is not None:
            found.append(telegram)
    return found


@given(seed=st.integers(0, 2**32), cuts=st.lists(st.integers(1, 200), max_size=20))
def test_any_burst_comes_apart_however_it_arrives(seed, cuts):
    rng = random.Random(seed)
    burst = [rng.choice(TAILED).encode() if rng.random() < 0.3 else _example(rng.choice(FIXED), rng) for _ in range(20)]
    stream, pieces = b"".join(burst), []
    for cut in cuts:
        pieces.append(stream[:cut])
        stream = stream[cut:]
    assert _split([*pieces, stream]) == burst


@pytest.mark.parametrize("telegram", [Write(1, bytes(50)).encode(), b"\x00\xee\x01\x02", b"\x33\x44"], ids=bytes.hex)
def test_a_telegram_of_unknown_length_ends_with_a_pause(telegram):
    splitter = TelegramSplitter()
    splitter.feed(telegram)
    assert splitter.next(END_S / 2) is None
    assert splitter.next(END_S) == telegram
    splitter.feed(GET_BATTERY)
    assert splitter.next(0.0) == GET_BATTERY


def test_a_write_in_front_of_others_has_the_size_of_a_packet():
    write = Write(0, bytes(61)).encode()
    assert _split([write + GET_BATTERY]) == [write, GET_BATTERY]


def test_a_short_telegram_is_passed_on_as_it_is_when_nothing_more_comes():
    splitter = TelegramSplitter()
    splitter.feed(b"\x00\x06")
    assert splitter.next(SHORT_S / 2) is None
    assert splitter.next(SHORT_S) == b"\x00\x06"


def test_the_servers_own_telegrams_are_single_bytes():
    assert _split([b"\x98" + GET_BATTERY + b"\x99"]) == [b"\x98", GET_BATTERY, b"\x99"]


@given(pieces=st.lists(st.binary(max_size=300), max_size=10))
def test_nothing_is_lost_and_nothing_exceeds_a_packet(pieces):
    splitter = TelegramSplitter()
    found = []
    for piece in pieces:
        splitter.feed(piece)
        while (telegram := splitter.next(0.0)) is not None:
            found.append(telegram)
    while (telegram := splitter.next(SHORT_S)) is not None:
        found.append(telegram)
    assert b"".join(found) == b"".join(pieces)
    assert all(0 < len(telegram) <= 64 for telegram in found)
