"""Conversations over Bluetooth; the last result of each is the one that LEGO's firmware gave."""

import pytest

from firmware_protocol import system
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick

UPLOAD = ["0181732e62696e00000000000000000000000000002c010000", *["018300" + "5a" * 50] * 6, "018400"]

CONVERSATIONS = [
    (
        "a telegram of one byte has the opcode 0",
        ["!btmode 1", "!bt 02000188", "!bt 010000"],
        "03000200c0",
    ),
    (
        "the buffer shows the telegram with its opcode cleared",
        ["!btmode 1", "!bt 0300000b77", "01940100050085040800"],
        "02940001000500080000007700ffdf0000",
    ),
    (
        "the buffer has the length of the last piece",
        ["!btmode 1", f"!bt cb00018305{'11' * 200}", "01940100050005050100"],
        "0294000100050001004b",
    ),
    (
        "the buffer has the last piece of a long telegram",
        ["!btmode 1", f"!bt cb00018305{'11' * 200}", "01940100050085040800"],
        "0294000100050008001100111111111111",
    ),
    (
        "an incomplete telegram is not in the buffer",
        ["!btmode 1", "!bt 640001a1bb", "!tick 5", "01940100050085040800"],
        "02940001000500080005000100ffdf0000",
    ),
    (
        "only a Write may be longer than the buffer",
        ["!btmode 1", f"!bt 810001a1{'00' * 127}"],
        "050002a100000003000200c0",
    ),
    (
        "a Write of 256 bytes is two telegrams",
        ["!btmode 1", f"!bt 0001018305{'00' * 253}"],
        "060002839305000003000200c0",
    ),
    (
        "a telegram that crosses the end of the ring takes two passes",
        ["!btmode 1", f"!bt 410001a1{'00' * 63}", "!tick 0"],
        "ok t=6002",
    ),
    (
        "the rest of a telegram that crossed it takes one",
        [
            "!btmode 1",
            f"!bt 640001a1{'00' * 76}",
            "!tick 5",
            f"!bt {'00' * 22}",
            "!tick 0",
        ],
        "ok t=6006",
    ),
    (
        "pieces of a long telegram cross it, too",
        ["!btmode 1", f"!bt 0101018305{'00' * 254}", "!tick 0"],
        "ok t=6005",
    ),
    (
        "the end of the stream mode drops an incomplete telegram",
        ["!btmode 1", "!bt 02", "!btmode 0", "!btmode 1", "!bt 0200000b"],
        "0500020b004a1e",
    ),
    (
        "a new name ends the stream",
        ["!btmode 1", "0198526f626f000000000000000000000000", "!tick 4", "!bt 02000188"],
        "",
    ),
    (
        "but not before three passes",
        ["!btmode 1", "0198526f626f000000000000000000000000", "!tick 2", "!bt 02000188"],
        "07000288007c011d01",
    ),
    (
        "the wait for the reply is long",
        ["!btmode 1", "0198526f626f000000000000000000000000", "!tick 4", "!bt 02000188", "!tick 0"],
        "ok t=11006",
    ),
    (
        "the stream begins again when the name has changed",
        [
            "!btmode 1",
            "0198526f626f000000000000000000000000",
            "!tick 20",
            "!btmode 0",
            "!tick 81",
            "!btmode 1",
            "!bt 02000188",
        ],
        "07000288007c011d01",
    ),
    (
        "a long Read takes a pass for each piece",
        [*UPLOAD, "!btmode 1", "!bt 16000180732e62696e000000000000000000000000000000", "!bt 0500018200fa00", "!tick 0"],
        "ok t=6012",
    ),
    (
        "a Write to a map takes what follows the buffer",
        [
            "!btmode 1",
            f"!bt 8200019501000100d0077a00{bytes(range(1, 119)).hex()}aabb",
            "01940100010042080c00",
        ],
        "029400010001000c007374757680000000addeefbe",
    ),
    (
        "and over USB as well",
        [
            "019501000100d0073c000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f202122232425262728292a2b2c2d2e2f30313233343536",
            "01940100010002080c00",
        ],
        "029400010001000c0033343536000000000000efbe",
    ),
    (
        "a write to a map overwrites its size in the buffer",
        ["!btmode 1", "!bt 0e00019501000100409c0400aabbccdd", "01940100050085040c00"],
        "029400010005000c00010001000100409c409caabb",
    ),
    (
        "the radio's answer to a new name takes places in the ring buffer",
        [
            "0198616c7068612062657461000000000000",
            "!tick 9",
            "!btmode 1",
            f"!bt 020001883c0001a1{'00' * 58}0200",
            "!tick 0",
        ],
        "ok t=6012",
    ),
    (
        "so do those to switching off and on, which fill it to the end",
        [
            "001f0000",
            "!tick 700",
            "001f0001",
            "!tick 700",
            "!btmode 1",
            f"!bt 7e0001a1{'00' * 124}",
            "!tick 0",
        ],
        "ok t=7403",
    ),
    (
        "and those of a boot, fewer if the radio is off",
        [
            "001f0000",
            "!tick 9",
            "!reboot",
            "001f0001",
            "!tick 700",
            "!btmode 1",
            "!bt 0e0001a1000000000000000000000000",
            "!bt 030001a101",
            "!tick 0",
        ],
        "ok t=6703",
    ),
    (
        "outside of stream mode an incomplete telegram takes no pass",
        ["!bt 05000184", "!tick 0"],
        "ok t=6000",
    ),
    (
        "and the end of it takes two",
        ["!bt 05000184", "!bt 000000", "!tick 0"],
        "ok t=6002",
    ),
    (
        "one, if another one begins with it",
        ["!bt 05000184", "!bt 0000000500", "!tick 0"],
        "ok t=6001",
    ),
]


@pytest.mark.parametrize(
    ("lines", "result"), [case[1:] for case in CONVERSATIONS], ids=[case[0] for case in CONVERSATIONS]
)
def test_the_last_result_is_that_of_the_firmware(lines, result):
    bench = Bench(SimBrick())
    results = [bench.answer(line) for line in lines]
    assert results[-1] == result


@pytest.mark.parametrize(
    ("handle", "size", "announced", "sent"),
    [(0, 250, 256, 256), (0, 400, 406, 306), (5, 200, 206, 206)],
    ids=["within the file", "beyond its end", "refused"],
)
def test_a_long_read_sends_pieces(handle, size, announced, sent):
    brick = SimBrick()
    brick.loader.write(brick.loader.create("a.t", 300).handle, bytes(range(250)) + bytes(50))
    brick.loader.close(0)
    brick.loader.open_read("a.t")
    reply = brick.receive_bluetooth(b"\x05\x00" + system.Read(handle, size).encode())
    assert int.from_bytes(reply[:2], "little") == announced
    assert len(reply) - 2 == sent


def test_a_long_read_is_answered_even_if_no_reply_is_wanted():
    brick = SimBrick()
    reply = brick.receive_bluetooth(b"\x05\x00" + bytes([0x81, 0x82, 5, 200, 0]))
    assert reply[:8] == bytes.fromhex("ce0002829305c800")


def test_the_end_of_a_file_leaves_earlier_bytes_in_the_first_piece():
    brick = SimBrick()
    brick.loader.write(brick.loader.create("a.t", 300).handle, bytes([7]) * 180 + bytes(120))
    brick.loader.close(0)
    brick.loader.open_read("a.t")
    brick.receive_bluetooth(b"\x05\x00" + system.Read(0, 180).encode())
    brick.loader.read(0, 112)
    reply = brick.receive_bluetooth(b"\x05\x00" + system.Read(0, 200).encode())
    assert reply[2:] == bytes.fromhex("02828500c800") + bytes(8) + bytes([7]) * 112


@pytest.mark.parametrize(
    ("lines", "last"),
    [
        (["!btmode 1", "01940100010014000400"], "0294000100010004007517" + "0000"),
        (["!btmode 1", "!btmode 0", "!tick 1"], "ok t=6001"),
        (["000400640100002000000000", "!tick 100", "!btmode 1", "!motors"], "100/0/45 0/0/0 0/0/0"),
        (["!btmode 1", "!bt 0200019b", "!btmode 0", "01940100050005050200"], "029400010005000200" + "0000"),
        (["!bt 0200019b"], ""),
        (["!bt 0200019b", "!tick 1"], "ok t=6003"),
    ],
)
def test_the_radio_of_the_recordings_changes_its_mode(lines, last):
    """It takes five passes, not counted and without motion; outside of stream mode nothing replies."""
    bench = Bench(SimBrick())
    for line in lines:
        result = bench.answer(line)
    assert result == last


def test_an_unknown_telegram_of_128_bytes_is_replied_to_with_the_length_behind_the_buffer():
    bench = Bench(SimBrick())
    bench.control("!btmode 1")
    reply = bytes.fromhex(bench.control("!bt 8000010b" + "55" * 126))
    assert (len(reply), reply[-4:], bench.control("!tick 1")) == (132, b"\0\0\x82\0", "ok t=6003")
