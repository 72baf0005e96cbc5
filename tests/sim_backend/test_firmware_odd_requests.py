"""Odd requests, and requests in odd moments; the last result of each conversation is that of LEGO's firmware."""

import pytest

from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick

CONVERSATIONS = [
    (
        "a reply that wants no reply is a direct command",
        "1.29",
        ["820401320701002000000000", "01940100020020002000"],
        "0294000100020020000000000000000000000000000000000000000007320060202020010000000000",
    ),
    (
        "in 1.05, too",
        "1.05",
        ["8203b8016400", "!sound"],
        "tone hz=440 ms=100 vol=4 playing",
    ),
    (
        "a reply that wants none to MessageRead stores nothing",
        "1.32",
        [
            "0181702e727865000000000000000000000000000000be000000",
            "0183004d696e6473746f726d734e58540000050c0030001c00180004001400000001001c000300220005010000060104000501080005010c0003011000",
            "01830004001200010114000201150001011600010117000700180006000000000101001c000a000200ffff0100ffff040000001800ffff000000000100",
            "018300120001002000f94b09001a800a00070005001c6001002c01ff48010004480000fb4b06002a60ffffffff35400300008002000300040035400300",
            "0183002680feff030002002f4006002f400900",
            "018400",
            "0000702e727865000000000000000000000000000000",
            "!tick 12",
            "82130000046162630000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000",
            "0013000001",
        ],
        "02134000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000",
    ),
    (
        "without the cable the status bar shows that",
        "1.29",
        ["!btmode 1", "!usb 0", "!tick 170", "!bt 0a00019401000a006c000400"],
        "0d0002940001000a0004001a1f0111",
    ),
    (
        "and both maps do",
        "1.29",
        ["!btmode 1", "!usb 0", "!tick 1", "!bt 0a00019401000c0020000100"],
        "0a0002940001000c00010000",
    ),
    (
        "the Comm map, too",
        "1.29",
        ["!btmode 1", "!usb 0", "!bt 0a0001940100050066070200"],
        "0b000294000100050002000000",
    ),
    (
        "with the cable the icon stays until it is drawn again",
        "1.05",
        ["!usb 0", "!tick 50", "!usb 1", "019401000a006c000400"],
        "02940001000a0004001a1f0111",
    ),
    (
        "1.05 lets a file be deleted that a handle behind the deletion's own reads",
        "1.05",
        [
            "0181612e74787400000000000000000000000000000002000000",
            "0183004142",
            "018400",
            "0181622e74787400000000000000000000000000000002000000",
            "0183004142",
            "0180612e747874000000000000000000000000000000",
            "018400",
            "0185622e747874000000000000000000000000000000",
            "0185612e747874000000000000000000000000000000",
        ],
        "028500612e747874000000000000000000000000000000",
    ),
]


@pytest.mark.parametrize(
    ("firmware", "lines", "result"), [pytest.param(*case, id=f"{case[0]} {name}") for name, *case in CONVERSATIONS]
)
def test_the_last_result_is_that_of_the_firmware(firmware, lines, result):
    bench = Bench(SimBrick(firmware=firmware))
    for line in lines:
        got = bench.answer(line)
    assert got == result
