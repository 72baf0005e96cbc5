import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.errors import LocalProtocolError, RemoteProtocolError
from firmware_protocol.framing import FrameReader, frame, usb_packets

telegrams = st.lists(st.binary(min_size=1, max_size=128), max_size=8)


def whole(reader):
    found = []
    while (telegram := reader.next()) is not None:
        found.append(telegram)
    return found


@given(telegrams, st.data())
def test_telegrams_come_out_of_any_split(sent, data):
    stream = b"".join(map(frame, sent))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=10)))
    reader, received = FrameReader(), []

    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        reader.feed(stream[start:end])
        received += whole(reader)

    assert received == sent
    assert reader.incomplete == 0


def test_single_bytes_make_a_telegram():
    """Source: tests/golden/firmware.jsonl, scenario bluetooth, step 17."""
    reader = FrameReader()
    for byte in bytes.fromhex("0500020b004a1e"):
        assert reader.next() is None
        reader.feed(bytes([byte]))

    assert reader.next() == bytes.fromhex("020b004a1e")


@pytest.mark.parametrize("rest", [b"", b"abc"])
@pytest.mark.parametrize("length", ["0000", "8100", "ffff"])
def test_an_impossible_length_is_refused_at_once_and_forgotten(length, rest):
    reader = FrameReader()
    reader.feed(bytes.fromhex(length) + rest)

    with pytest.raises(RemoteProtocolError) as caught:
        reader.next()

    assert caught.value.telegram == bytes.fromhex(length) + rest
    reader.feed(frame(b"\x02\x01\x00"))
    assert reader.next() == b"\x02\x01\x00"


def test_the_message_about_a_stream_of_other_data_stays_short():
    reader = FrameReader()
    reader.feed(b"\xff" * 4096)

    with pytest.raises(RemoteProtocolError, match=r"\(received: ff( ff){127} and 3968 bytes more\)") as caught:
        reader.next()

    assert len(caught.value.telegram) == 4096


def test_a_message_shows_the_longest_telegram_of_a_brick_as_a_whole():
    assert str(RemoteProtocolError("odd", bytes(128))) == f"odd (received: {bytes(128).hex(' ')})"
    assert str(RemoteProtocolError("odd")) == "odd (received: nothing)"


@given(st.binary(max_size=300))
def test_no_bytes_break_the_reader(noise):
    reader = FrameReader()
    reader.feed(noise)
    try:
        whole(reader)
    except RemoteProtocolError:
        assert reader.incomplete == 0


def test_after_a_telegram_that_never_ends_a_reset_finds_the_next():
    """The firmware announces more than it sends when read beyond the end of a file (scenario bluetooth_short_read)."""
    reader = FrameReader(limit=300)
    reader.feed(bytes.fromhex("ce00028285") + bytes(121))
    assert reader.next() is None
    assert reader.incomplete == 126

    reader.reset()
    reader.feed(bytes.fromhex("040002840000"))

    assert reader.next() == bytes.fromhex("02840000")


@pytest.mark.parametrize("size", [0, 65536])
def test_what_a_length_cannot_say_is_not_framed(size):
    with pytest.raises(LocalProtocolError):
        frame(bytes(size))


def test_the_longest_telegram_is_framed():
    assert frame(bytes(65535)) == b"\xff\xff" + bytes(65535)


@given(st.binary(max_size=300))
def test_usb_splits_at_64_bytes(data):
    packets = usb_packets(data)

    assert b"".join(packets) == data
    assert all(len(packet) == 64 for packet in packets[:-1])
    assert all(1 <= len(packet) <= 64 for packet in packets[-1:])
