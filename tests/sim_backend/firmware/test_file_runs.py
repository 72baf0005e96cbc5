"""Files that the user interface runs, pass by pass. Each result is that of LEGO's firmware."""

import pytest

PROGRAM = [
    "0181676f2e727865000000000000000000000000000040000000",
    "0183004d696e6473746f726d734e585400000501000e0004000a0000000a00000000000400010004000501000004000a000100ffffffff000000002540",
    "01830002002540feff",
    "018400",
]
"""Uploads a program that runs until it is stopped."""


def sound(name, samples):
    """Upload a silent sound file of 2000 samples a second."""
    content = bytes.fromhex("0100000007d00000") + bytes(samples)
    pieces = [content[start : start + 58].hex() for start in range(0, len(content), 58)]
    opened = "0181" + name.encode().ljust(20, b"\0").hex() + len(content).to_bytes(4, "little").hex()
    return [opened, *["018300" + piece for piece in pieces], "018400"]


SOUND, LONG_SOUND = sound("a.rso", 400), sound("b.rso", 1000)
TEXT = [
    "0181612e74787400000000000000000000000000000001000000",
    "01830061",
    "018400",
]
GO = "0000676f2e7278650000000000000000000000000000"
PLAY = "0000612e72736f000000000000000000000000000000"
PLAY_LONG = "0000622e72736f000000000000000000000000000000"
OPEN_TEXT = "0000612e747874000000000000000000000000000000"
STOP = "0001"
ENTER = ["!button 8", "!tick 4", "!button 0", "!tick 30"]

UI = "019401000c001a000200"
NAME = "01940100080006001400"
MASKS = "019401000a0004000800"
SOUND_FLAGS = "0194010008001a000200"
"""What is read in each pass of the maps of the user interface, the sound and the display."""

CASES = [
    (
        "a key that ends the message clicks",
        [*PROGRAM, GO, "!tick 20", STOP, "!tick 20"],
        {2: "!button 2", 4: "!button 0"},
        NAME,
        "2120537461727475702e72736f00000000000000*4 2120436c69636b2e72736f006f00000000000000*4",
    ),
    (
        "a key that is held in its first pass, too",
        [*PROGRAM, GO, "!tick 20", "!button 2", STOP],
        {},
        NAME,
        "2120537461727475702e72736f00000000000000*2 2120436c69636b2e72736f006f00000000000000*6",
    ),
    (
        "one that is let go before does not",
        [*PROGRAM, GO, "!tick 20", "!button 2", "!tick 3", "!button 0", STOP],
        {},
        NAME,
        "2120537461727475702e72736f00000000000000*20",
    ),
    (
        "exit that ends a program clicks as the message begins",
        [*PROGRAM, GO, "!tick 20"],
        {1: "!button 1", 4: "!button 0"},
        NAME,
        "2120537461727475702e72736f00000000000000*8",
    ),
    (
        "keys are not read in the last pass of the message",
        [*PROGRAM, GO, "!tick 20", STOP, "!tick 748"],
        {0: "!button 2", 1: "!button 2"},
        SOUND_FLAGS,
        "0000*2 0100 0000*17",
    ),
    (
        "exit stops a sound",
        [*SOUND, PLAY, "!tick 50"],
        {3: "!button 1", 6: "!button 0"},
        UI,
        "e00e*756 8005 8006*3 8007*20",
    ),
    (
        "other keys click while it plays",
        [*SOUND, PLAY, "!tick 50"],
        {3: "!button 4", 6: "!button 0"},
        NAME,
        "612e72736f007475702e72736f00000000000000*5 2120436c69636b2e72736f006f00000000000000*3",
    ),
    (
        "the name of a sound is written over the one before up to its end",
        [*SOUND, PLAY, "!tick 5"],
        {},
        NAME,
        "2120537461727475702e72736f00000000000000*2 612e72736f007475702e72736f00000000000000*6",
    ),
    (
        "enter that is held delays no sound",
        [*SOUND, "!button 8", PLAY],
        {},
        SOUND_FLAGS,
        "0000*7 0100 0302 0202*11",
    ),
    (
        "a sound has a picture that changes",
        [*LONG_SOUND, PLAY_LONG, "!tick 100"],
        {},
        MASKS,
        "0000000000000000*32 0000040000000400 0000000000000400 0000000000000000*24 0000000000800000 "
        "0000000000000000*98 0000040000000400 0000000000000400 0000000000000000*66 0000000000800000 "
        "0000000000000000*56 0000040000000400 0000000000000400 0000000000000000*41 0002004018f20500 "
        "0002000018e20500 0000000018e20500 0000000018e20100 0000000018e20000 0000000018620000 "
        "0000000018220000 0000000018020000 0000000018000000 0000000008000000 0000000000000000*15",
    ),
    (
        "a program waits until all is drawn",
        [*PROGRAM, GO, "!tick 3"],
        {1: "019501000a0008000400ff000000"},
        MASKS,
        "0000004018100000 000000007f000000 000000003f000000 000000001f800000 000000001f000000 "
        "000000000f000000 0000000007000000 0000000003000000 0000000001000000 0000000000000000*21",
    ),
    (
        "in which pass it starts",
        [*PROGRAM, GO, "!tick 3"],
        {1: "019501000a0008000400ff000000"},
        UI,
        "e00e*11 e60e*19",
    ),
    (
        "and then until nothing is left to erase",
        [*PROGRAM, GO],
        {6: "019501000a0004000400ff000000"},
        UI,
        "e00d e00e*13 e60e*16",
    ),
    (
        "a sound does not",
        [*SOUND, PLAY],
        {6: "019501000a0004000400ff000000"},
        SOUND_FLAGS,
        "0000*6 0100 0202*23",
    ),
    (
        "the page of an unknown file follows it",
        [*TEXT, OPEN_TEXT, "!tick 50"],
        {2: "!button 1", 6: "!button 0"},
        UI,
        "c007*4 c00b c005 c006*3 c00b c005 c006 c007*18",
    ),
    (
        "it is shown again when it is run from there",
        [*TEXT, OPEN_TEXT, "!tick 50"],
        {2: "!button 8", 6: "!button 0"},
        MASKS,
        "0000000000000000*8 0000004018100000 0000000018000000 0000000008000000 0000000000000000 "
        "00060e0000f70f00 0006060000f70f00 0006020000f70f00 0006000000f70f00 0002000000f70f00 "
        "0000000000f70f00 0000000000f70700 0000000000f70300 0000000000f70100 0000000000f70000 "
        "0000000000770000 0000000000370000 0000000000170000 0000000000070000 0000000000030000 "
        "0000000000010000 0000000000000000*2",
    ),
    (
        "so is the page of a program after its message",
        [*PROGRAM, *4 * ENTER, STOP, "!tick 10"],
        {2: "!button 2", 6: "!button 0"},
        MASKS,
        "0000000008000000 0000000000000000*2 1000000008040e00 00060e0008f70f00 0006060008f70f00 "
        "0006020008f70f00 0006000008f70f00 0002000008f70f00 0000000008f70f00 0000000008f70700 "
        "0000000008f70300 0000000008f70100 0000000008f70000 0000000008770000 0000000008370000 "
        "0000000008170000 0000000008070000 0000000008030000 0000000008010000 0000000008000000 "
        "0000000000000000*7 0000000000800000 0000000000000000",
    ),
    (
        "a request in a page that is being drawn begins behind what that pass draws",
        [*PROGRAM, GO, "!tick 20", STOP, "!tick 754"],
        {0: GO},
        MASKS,
        "00060e0008f70f00 0006060008000000 0006020008000000 0006004018100000 0006000018000000 "
        "0002000018000000 0000000018000000 0000000008000000 0000000000000000*4",
    ),
    (
        "the status bar is drawn after a file's name",
        [*PROGRAM, "!tick 134", GO],
        {},
        MASKS,
        "0000000000000000 0000000008000000 0000000000000000 0000004018100000 0000000018000000 "
        "0000000008000000 0000000000000000*6",
    ),
    *(
        (
            f"a name that ends in {kind} and fills its field has no extension",
            [f"019501000c0006001500{(b'a' * 16 + kind.encode()).hex()}a0"],
            {},
            UI,
            "e00d e00e*5 c005 c006*3 c007*100",
        )
        for kind in (".rso", ".rxe")
    ),
]


@pytest.mark.parametrize(("setup", "then", "read", "expected"), [pytest.param(*case, id=name) for name, *case in CASES])
def test_a_file_runs_as_in_the_firmware(seen_in_passes, setup, then, read, expected):
    assert seen_in_passes(setup, then, read, expected) == expected
