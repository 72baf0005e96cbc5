"""Writes to maps while nothing runs, or something else does, pass by pass, as in LEGO's firmware."""

import pytest

PROGRAM = [
    "0181676f2e727865000000000000000000000000000040000000",
    "0183004d696e6473746f726d734e585400000501000e0004000a0000000a00000000000400010004000501000004000a000100ffffffff000000002540",
    "01830002002540feff",
    "018400",
]
"""Uploads a program that runs until it is stopped."""

CONTENT = bytes.fromhex("0100000007d00000") + bytes(400)
SOUND = [
    "0181" + b"a.rso".ljust(20, b"\0").hex() + len(CONTENT).to_bytes(4, "little").hex(),
    *["018300" + CONTENT[start : start + 58].hex() for start in range(0, len(CONTENT), 58)],
    "018400",
]
"""Uploads a silent sound file."""

GO = "0000676f2e7278650000000000000000000000000000"

UI = "019401000c001a000200"
NAME = "01940100080006001400"
MASKS = "019401000a0004000800"
VOLUME = "019401000c0024000100"
TIMER = "019401000c001a000900"
HIGH_SPEED = "01940100050063070300"
SOUND_FLAGS = "0194010008001a000300"
"""What is read in each pass of the maps of the user interface, the sound, the display and the radio."""

CASES = [
    (
        "the logo ends with the refresh of the screen",
        "1.29",
        ["!tick 13"],
        {2: "019501000c001b00010002"},
        UI,
        "8007*2 8002*17 8003 8004 8005 8006 8007*7",
    ),
    (
        "the first state behind it has marks",
        "1.29",
        [],
        {1: "019501000c001b00010003"},
        MASKS,
        "0000000000000000 0000002000000000 0000000000000000*2 0002004000f70f00 0002000000e70f00 "
        "0000000000e70f00 0000000000e70700 0000000000e70300 0000000000e70100 0000000000e70000*2",
    ),
    (
        "and does not show the status bar",
        "1.29",
        [],
        {1: "019501000c001a0002000403"},
        UI,
        "8007 0404 0405 0406 8407*4",
    ),
    (
        "keys do not click in states of no menu",
        "1.29",
        ["019501000c001b00010040"],
        {1: "!button 2", 4: "!button 0"},
        NAME,
        "2120537461727475702e72736f00000000000000*8",
    ),
    (
        "a state of the menus is gone on from while a file is opened",
        "1.29",
        [*PROGRAM, GO],
        {3: "019501000c001b00010008"},
        UI,
        "e00d e00e*2 e005 e006 e007*5",
    ),
    (
        "and while it runs",
        "1.29",
        [*PROGRAM, GO, "!tick 20"],
        {3: "019501000c001b00010008"},
        UI,
        "e60e*3 e605 e606 e607*5",
    ),
    (
        "state 5 then shows the file's page",
        "1.29",
        [*PROGRAM, GO, "!tick 20"],
        {3: "019501000c001b00010005"},
        MASKS,
        "0000000000000000*4 00060e0000f70f00 0006060008000000 00060e0008f70f00 0006060008f70f00 "
        "0006020008f70f00 0006000008f70f00",
    ),
    (
        "others stay",
        "1.29",
        [*PROGRAM, GO],
        {3: "019501000c001b00010002"},
        UI,
        "e00d e00e*2 e002*7",
    ),
    (
        "0 starts the menus anew",
        "1.29",
        [*PROGRAM, GO, "!tick 20"],
        {3: "019501000c001b00010000"},
        UI,
        "e60e*3 4002*7",
    ),
    (
        "12 is a question of the radio",
        "1.29",
        [*PROGRAM, GO, "!tick 20"],
        {3: "019501000c001b0001000c"},
        MASKS,
        "0000000000000000*5 0002000000f20100 0000004000f20100 0000100014f20100",
    ),
    (
        "16 is a message of the radio",
        "1.29",
        [*PROGRAM, GO, "!tick 20"],
        {3: "019501000c001b00010010"},
        MASKS,
        "0000000000000000*4 0e00000000000000 0600000000000000 0200000000000000 0000000000001000",
    ),
    (
        "a message of the radio is drawn part by part",
        "1.29",
        [],
        {1: "019501000c001f00010008"},
        MASKS,
        "0000000000000000*3 0e00000000000000 0600000000000000 0200000000000000 0000000000001000 "
        "0000000000100000 0000000000000000*3 0000000000a00000 0000000000200000 0000000000000000",
    ),
    (
        "when all before it is drawn",
        "1.29",
        [],
        {1: "019501000c001a0002008810"},
        MASKS,
        "0000000000000000 0002000000f20100 0000000000f20100 0000000000f20000 0000000000720000 "
        "0000000000320000 0000000000120000 0000000000020000 0e00000000000000 0600000000000000 "
        "0200000000000000 0000000000801000 0000000000800000 0000000000100000 0000000000000000*6",
    ),
    (
        "and ends later by as much",
        "1.29",
        ["019501000c001a0002008810", "!tick 2620"],
        {},
        UI,
        "8010*16 8005 8006 8007*12",
    ),
    (
        "the frame is drawn only with the status bar",
        "1.29",
        [],
        {1: "019501000c001a0002000010"},
        MASKS,
        "0000000000000000*2 0e00000000000000 0600000000000000 0200000000000000 0000000000001000 0000000000000000*8",
    ),
    (
        "so it is for a file",
        "1.29",
        [],
        {1: "019501000c001a00010020"},
        MASKS,
        "0000000000000000*2 0000000008000000 0000000000000000 0000004018000000 0000000018000000 "
        "0000000008000000 0000000000000000*2 00060e0000f70f00 0006060008000000 00060e0008f70f00 "
        "0006060008f70f00 0006020008f70f00",
    ),
    (
        "the radio interrupts any state",
        "1.29",
        ["019501000c001b00010040"],
        {1: "019501000c001f00010008"},
        UI,
        "8040 c010*5",
    ),
    (
        "also a file that was requested",
        "1.29",
        [*PROGRAM, GO],
        {0: "019501000c001a000600800d00000440"},
        UI,
        "c00c*6",
    ),
    (
        "unless the user interface is busy",
        "1.29",
        ["019501000c001a000100c0"],
        {1: "019501000c001f00010048"},
        UI,
        "c007*6",
    ),
    (
        "no file is opened in a start",
        "1.29",
        [*PROGRAM],
        {1: "019501000c001a000200a000"},
        UI,
        "8007 4002*5",
    ),
    (
        "a start sets the volume",
        "1.29",
        [
            "!button 1",
            "!tick 5",
            "!button 0",
            "!tick 5",
            "!button 8",
            "!tick 500",
            "!button 0",
            "019501000c002400010002",
        ],
        {1: "!button 8"},
        VOLUME,
        "02*5 04*3",
    ),
    (
        "a timer that never expires is reset a pass later",
        "1.29",
        [],
        {1: "019501000c00210002000003"},
        TIMER,
        "800700010401020a00 900700010401020003 900700010401020000*4",
    ),
    (
        "a state above 15 of the high speed port ends at once in 1.32",
        "1.32",
        [],
        {1: "01950100050063070300800f40"},
        HIGH_SPEED,
        "000f00 800f06*3",
    ),
    (
        "one from 7 to 15 does not end at all",
        "1.32",
        [],
        {1: "01950100050063070300010f08"},
        HIGH_SPEED,
        "000f00 000f08*3",
    ),
    (
        "a looped tone begins again with what the map says",
        "1.29",
        ["0003b801c800", "0195010008001c00010003", "!tick 100", "019501000800000002000020"],
        {250: "0195010008001c00010002"},
        SOUND_FLAGS,
        "020303*250 020302*50",
    ),
    (
        "a loop that the map starts opens its file",
        "1.29",
        [
            *SOUND,
            "000200612e72736f000000000000000000000000000000",
            "!tick 900",
            "0195010008001a000300000201",
            "!tick 500",
        ],
        {3: "0195010008001c00010000"},
        SOUND_FLAGS,
        "020201*3 020200*9 000000*288",
    ),
]


@pytest.mark.parametrize(
    ("firmware", "setup", "then", "read", "expected"), [pytest.param(*case, id=name) for name, *case in CASES]
)
def test_what_is_written_acts_as_in_the_firmware(seen_in_passes, firmware, setup, then, read, expected):
    assert seen_in_passes(setup, then, read, expected, firmware) == expected
