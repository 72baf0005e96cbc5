"""Writes to IO maps; the last result of each conversation is the one that LEGO's firmware gave."""

import pytest

from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick

CONVERSATIONS = [
    (
        "the user interface goes on from state 5 in the same pass",
        "1.29",
        ["019501000c001b00010005", "019401000c001a000300"],
        "02940001000c000300800600",
    ),
    (
        "and waits two passes later",
        "1.29",
        ["019501000c001b00010005", "!tick 1", "019401000c001a000300"],
        "02940001000c000300800700",
    ),
    (
        "state 3 leads there through 4 and 5",
        "1.29",
        ["019501000c001b00010003", "019401000c001a000300"],
        "02940001000c000300800400",
    ),
    (
        "state 6 draws the menu at once",
        "1.29",
        ["019501000c001b00010006", "019401000a0004000800"],
        "02940001000a0008000002004000f70f00",
    ),
    (
        "state 8 is that of the left key",
        "1.29",
        ["019501000c001b00010008", "019401000c001a000300"],
        "02940001000c000300800500",
    ),
    (
        "state 10 enters the item of the menu",
        "1.29",
        [
            "019501000c001b0001000a",
            "!tick 20",
            "019501000c001b0001000b",
            "!tick 20",
            "019501000c001b0001000b",
            "!tick 20",
            "019501000c001b0001000a",
            "!tick 8",
            "01940100060000000200",
        ],
        "029400010006000200005a",
    ),
    (
        "state 0 starts the user interface again",
        "1.29",
        ["019501000c001b00010000", "019401000c001a000300"],
        "02940001000c000300400200",
    ),
    (
        "state 13 opens the file of the map",
        "1.29",
        ["019501000c001b0001000d", "019401000c001a000300"],
        "02940001000c000300800e00",
    ),
    (
        "state 14 runs it and is busy",
        "1.29",
        ["019501000c001b0001000e", "019401000c001a000300"],
        "02940001000c000300c00e00",
    ),
    (
        "an unknown state stays",
        "1.29",
        ["019501000c001b00010011", "!tick 20", "019401000c001a000300"],
        "02940001000c000300801100",
    ),
    (
        "state 15 waits for a key, then starts again",
        "1.29",
        ["019501000c001b0002000f04", "019401000c001a000300"],
        "02940001000c000300800000",
    ),
    (
        "a key of the map closes the warning, disabled or not",
        "1.29",
        ["!battery 430", "!tick 1500", "019501000c001a00010086", "019501000c001c00010004", "019401000c001a000300"],
        "02940001000c000300860700",
    ),
    (
        "a disabled button does not click in the warning",
        "1.29",
        ["!battery 430", "!tick 1500", "019501000c001a00010086", "!button 8", "!tick 5", "01940100080006001400"],
        "0294000100080014002120537461727475702e72736f00000000000000",
    ),
    (
        "a sleep timer that has passed its limit waits for the end of a minute",
        "1.29",
        ["019501000c00220001000c", "!tick 1000", "01940100060000000200"],
        "0294000100060002000000",
    ),
    (
        "and then switches off",
        "1.29",
        ["019501000c00220001000c", "!tick 54020", "01940100060000000200"],
        "029400010006000200005a",
    ),
    ("icons can be written", "1.29", ["019501000a006e000100aa", "019401000a006c000400"], "02940001000a0004001a21aa11"),
    (
        "radio states above 5 keep the icon",
        "1.29",
        ["019501000c001f00010006", "!tick 200", "019401000a006c000400"],
        "02940001000a0004001a210211",
    ),
    (
        "radio states count three bits",
        "1.29",
        ["019501000c001f00010015", "!tick 200", "019401000a006c000400"],
        "02940001000a0004001e210211",
    ),
    (
        "lines of text are centered",
        "1.29",
        [
            "0181612e72736f00000000000000000000000000000001000000",
            "01830041",
            "018400",
            "0000612e72736f000000000000000000000000000000",
            "019401000a0076000100",
            "019401000a0076000100",
        ],
        "02940001000a00010008",
    ),
    (
        "and no longer when they are drawn",
        "1.29",
        ["019501000a0076000100ff", "019501000a0008000100ff", "!tick 3", "019401000a0076000100"],
        "02940001000a0001000f",
    ),
    (
        "releases are the sum of short and long ones",
        "1.29",
        ["019501000400120002001122", "!tick 2", "01940100040010000800"],
        "0294000100040008000000112233000000",
    ),
    (
        "the state of a button is that of the last sample",
        "1.29",
        ["0195010004002100010081", "!tick 2", "01940100040020000400"],
        "02940001000400040000000000",
    ),
    (
        "the free flash of the map can be written",
        "1.29",
        ["019501000900040002000102", "01940100090004000400"],
        "02940001000900040001020100",
    ),
    (
        "ActivateFlag is 1 or nothing",
        "1.29",
        ["0195010001001e00010002", "!tick 3", "0194010001001c000400"],
        "02940001000100040000010200",
    ),
    (
        "a Tick that was written is one behind",
        "1.29",
        ["0195010001001400010001", "01940100010014000400"],
        "02940001000100040070170000",
    ),
    (
        "the offsets of the variables can be written",
        "1.29",
        ["0195010001001800040001020304", "01940100010018000400"],
        "02940001000100040001020304",
    ),
    (
        "the colour sensor's values can be written",
        "1.29",
        ["019501000300830002003f01", "01940100030080000800"],
        "0294000100030008000000003f01000000",
    ),
    (
        "a new type overwrites the bits of InvalidData",
        "1.29",
        ["019501000300100001006e", "0195010003000800010005", "01940100030010000100"],
        "02940001000300010001",
    ),
    (
        "a telegram, too",
        "1.29",
        ["019501000300100001006e", "0005000500", "!tick 30", "01940100030010000100"],
        "02940001000300010000",
    ),
    ("bytes that wait are a difference of bytes", "1.29", ["019501000b0023000100a3", "000e01"], "020ee0a3"),
    (
        "the hardware state of the radio can be written",
        "1.29",
        ["0195010005008004010005", "01940100050080040100"],
        "02940001000500010005",
    ),
    ("the cable's state cannot", "1.29", ["0195010005006607010005", "01940100050066070100"], "02940001000500010001"),
    ("a write into the send buffer changes the reply", "1.29", ["019501000500dc0602000908"], "029500090805000200"),
    (
        "data that overlap their target are copied byte by byte",
        "1.29",
        [
            "019501000500b80636000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f202122232425262728292a2b2c2d2e2f30313233343536"
        ],
        "0295000c0d0e0f3600",
    ),
    (
        "the status bar is drawn again when the menu shows it",
        "1.29",
        ["019501000c001a0002000804", "!tick 5", "019401000c001a000200"],
        "02940001000c0002008007",
    ),
    (
        "in a pass that samples the buttons it is not seen",
        "1.29",
        ["!tick 1", "0195010004002000010004", "!tick 20", "!power"],
        "power=00 display=1 inpower=00 div0=0",
    ),
    (
        "a long press of exit in the button map switches the brick off",
        "1.29",
        ["0195010004002000010004", "!tick 20", "!power"],
        "power=5a display=0 inpower=00 div0=0",
    ),
    (
        "a page of the menus draws the icons that were written",
        "1.29",
        ["019501000a006c000400aabbccdd", "!button 2", "!tick 7", "019401000a006c000400"],
        "02940001000a0004001a210c11",
    ),
    (
        "the reset before a program clears bit 80 of the flags of an output",
        "1.29",
        [
            "0181676f2e727865000000000000000000000000000048000000",
            "0183004d696e6473746f726d734e5854000005020012000800120008000a00000000000800010002000600000006000400030000000000000008000a00",
            "0183000100ffffffff0000000029400100",
            "018400",
            "01950100020012000100d0",
            "0000676f2e7278650000000000000000000000000000",
            "!tick 12",
            "01940100020012000100",
        ],
        "02940001000200010000",
    ),
    (
        "the calibration of a colour sensor that does not answer is read as FF",
        "1.29",
        ["!sensor 2 20", "0005020e00", "!tick 109", "019401000300f8000400"],
        "029400010003000400ffffff00",
    ),
    (
        "one byte in each pass",
        "1.32",
        ["!sensor 2 20", "0005021000", "!tick 158", "0194010003002a010400"],
        "029400010003000400ffff0000",
    ),
    (
        "a converter that sees no sensor stops it",
        "1.32",
        ["!sensor 2 20", "0005020d00", "!tick 109", "!sensor 2 51", "!tick 100", "019401000300f8000400"],
        "029400010003000400ffffffff",
    ),
    (
        "the end of a colour sensor reads it too",
        "1.29",
        ["!sensor 2 20", "0005021200", "!tick 109", "019401000300f8000400"],
        "029400010003000400ffffff00",
    ),
    (
        "the reading begins again when it has failed",
        "1.29",
        [
            "!sensor 2 20",
            "0005020e00",
            "!tick 158",
            "019501000300f800040000000000",
            "!tick 106",
            "019401000300f8000400",
        ],
        "02940001000300040000000000",
    ),
]


@pytest.mark.parametrize(
    ("firmware", "lines", "result"), [pytest.param(*case, id=name) for name, *case in CONVERSATIONS]
)
def test_the_last_result_is_that_of_the_firmware(firmware, lines, result):
    bench = Bench(SimBrick(firmware=firmware))
    for line in lines:
        got = bench.control(line) if line.startswith("!") else bench.telegram(line)
    assert got == result
