"""Start, power, warnings and keys of the user interface, pass by pass. Each result is that of LEGO's firmware."""

import pytest

PROGRAM = [
    "0181676f2e727865000000000000000000000000000040000000",
    "0183004d696e6473746f726d734e585400000501000e0004000a0000000a00000000000400010004000501000004000a000100ffffffff000000002540",
    "01830002002540feff",
    "018400",
]
"""Uploads a program that runs until it is stopped."""
START = ["0000676f2e7278650000000000000000000000000000"]
OFF = ["!button 1", "!tick 5", "!button 0", "!tick 5", "!button 8", "!tick 500", "!button 0", "!tick 2"]
ON = [*OFF, "!button 8", "!tick 5", "!button 0"]
"""Switch the brick off in the menu, and on again."""

FORCE_OFF = "019501000c002700010001"
"""Write 1 to ForceOff in the map."""

UI, BUTTON = "019401000c001a000200", "019401000c001a000300"
STATUS, POWER = "0194010001001c000400", "01940100060000000200"
FLAGS, MASKS, CENTERED = "019401000a0075000100", "019401000a0004000800", "019401000a0076000100"
ICONS, BT_BUFFER = "019401000a006c000400", "01940100050085040400"
"""What is read in each pass of the maps of the user interface, the program, the power, the display and the radio."""

CASES = [
    (
        "the end of a program draws the icons, also with a sample in that pass",
        [*PROGRAM, *START, "!tick 171"],
        {1: "0001"},
        ICONS,
        "1a210111*2 1a210211*6",
    ),
    (
        "a start shows an empty battery instead of the logo, once",
        [*OFF, "!battery 445", "!button 8"],
        {},
        UI,
        "8006*3 8000 4002*166 4102*2 c001*2000 4002*2 4102*2784 4103*897 4104 4105 4106 c007 8007*141",
    ),
    (
        "a sample counts when it is taken",
        [*ON],
        {900: "!battery 430", 1100: "!battery 560"},
        UI,
        "4002*165 4102*837 c001*2000 4002*2 4102*1996",
    ),
    (
        "there is no warning then",
        [*OFF, "!battery 430", "!button 8", "!tick 6000"],
        {},
        UI,
        "8007*1500",
    ),
    (
        "the logo ends with a refresh of the screen",
        [*OFF, "!tick 15", "!button 8"],
        {},
        UI,
        "8006*2 8000 4002*166 4102*2615 4103*897 4104 4105 4106 c007 8007*115",
    ),
    (
        "exit that is held for long does nothing in a start",
        [*ON],
        {200: "!button 1", 3500: "!button 0"},
        UI,
        "4002*165 4102*2629 4103*897 4104 4105 4106 c007 8007*105",
    ),
    (
        "nor while a program runs",
        [*PROGRAM, *START, "!tick 10"],
        {1: "!button 8", 3: "!button 9"},
        UI,
        "e60e*6 e00e 8005 8006*3 8007*1994 8006*95",
    ),
    (
        "ForceOff acts in a start",
        [*ON],
        {200: FORCE_OFF},
        UI,
        "4002*165 4102*35 4106*100",
    ),
    (
        "and leaves a program",
        [*PROGRAM, *START],
        {30: FORCE_OFF},
        UI,
        "e00d e00e*7 e60e*22 e606*3 e006*27",
    ),
    (
        "which it stops in the next pass",
        [*PROGRAM, *START],
        {30: FORCE_OFF},
        STATUS,
        "00010000*7 00010100 02010000*23 02010001 04010000*28",
    ),
    (
        "and a warning",
        ["!battery 430", "!tick 1500"],
        {30: FORCE_OFF},
        UI,
        "c00f*30 c006*30",
    ),
    (
        "the sleep timer does so, too",
        ["019501000c002100010001", "!tick 59900", *PROGRAM, *START],
        {},
        UI,
        "e00d e00e*7 e60e*112",
    ),
    (
        "the map shows the power a pass earlier",
        [],
        {0: FORCE_OFF},
        POWER,
        "0000*6 005a*251 0000*43",
    ),
    (
        "and the display",
        [],
        {0: FORCE_OFF},
        FLAGS,
        "83*2 82*13 02 82*14",
    ),
    (
        "the warning of a low battery waits for the screen",
        [*PROGRAM, *START, "!battery 430", "!tick 1500", "0001"],
        {},
        UI,
        "e60e e00e*750 8005 8006*3 8007*17 c00f*128",
    ),
    (
        "it keeps the display's flags",
        ["!battery 430", "!tick 990"],
        {45: "!button 8"},
        FLAGS,
        "0b*46 03 83*13",
    ),
    (
        "and draws the status bar",
        ["!battery 430", "!tick 990"],
        {},
        MASKS,
        "0000000000000000*24 0000000000800100 0000000000800000 0000000000000000*14",
    ),
    (
        "a brick that is off shows it, too",
        [*OFF, "!battery 430", "!tick 1200"],
        {10: "!button 8", 20: "!button 0"},
        UI,
        "c00f*12 8006*48",
    ),
    (
        "and can start a file",
        [*PROGRAM, *OFF, *START],
        {30: "!button 1", 35: "!button 0", 80: "!button 2", 84: "!button 0"},
        UI,
        "e00d e00e*7 e60e*24 e00e 8005 8006*3 8007*44 8009 8005 8006 8007*36",
    ),
    (
        "a button that is held in a start does not count",
        [*ON],
        {600: "!button 4"},
        UI,
        "4002*165 4102*2629 4103*897 4104 4105 4106 c007 8007*1805",
    ),
    (
        "a key of the map waits for its end",
        [*ON],
        {500: "019501000c001c00010002"},
        BUTTON,
        "400200*165 410200*335 410202*2293 410302*897 410402 410502 410602 c00702 800a00 800500 800600 800700*103",
    ),
    (
        "a button held from before does not end the message",
        ["!button 2", "!tick 20", *PROGRAM, *START, "!tick 10", "0001"],
        {},
        UI,
        "e60e e00e*750 8005 8006*3 8007*11 8009 8005 8006 8007*31",
    ),
    (
        "nor one pressed while the program ran, if it was not read since",
        ["!button 4", "!tick 20", *PROGRAM, *START, "!tick 10", "!button 0", "!tick 5", "!button 4", "!tick 5", "0001"],
        {},
        UI,
        "e60e e00e*750 8005 8006*3 8007 8008 8005 8006 8007*41",
    ),
    (
        "a key of the map waits until it is let go",
        ["!button 2", "!tick 20", *PROGRAM, *START, "!tick 10", "0001"],
        {20: "019501000c001c00010003", 100: "!button 0"},
        UI,
        "e60e e00e*100 8005 8006*3 8007*95",
    ),
    (
        "the list follows a file started at the question",
        ["!button 1", "!tick 5", "!button 0", "!tick 5", *PROGRAM, *START, "!tick 10", "0001"],
        {},
        UI,
        "e60e e00e*750 8005 8006*7 8007*41",
    ),
    (
        "the pause of a refresh that was stopped moves",
        [],
        {3: "019501000a007500010001", 23: "019501000a007500010003"},
        FLAGS,
        "83*3 81*12 41*8 83*16 03 83*16 03 83*3",
    ),
    (
        "a refresh begins when its end is written away",
        [],
        {3: "019501000a007500010001", 29: "019501000a007500010001"},
        FLAGS,
        "83*3 81*12 41*14 81*16 41*35",
    ),
    (
        "the lines of text that are taken away are not centered",
        [*PROGRAM, *START, "!tick 9"],
        {1: "!button 1"},
        CENTERED,
        "00*3 18 08*21 00*15",
    ),
    (
        "a file that is started at once keeps the brick on",
        [*PROGRAM, FORCE_OFF, *START],
        {},
        POWER,
        "0000*60",
    ),
    (
        "and one that is started five passes later does not",
        [*PROGRAM, FORCE_OFF, "!tick 5", *START],
        {},
        POWER,
        "005a*60",
    ),
    (
        "ForceOff acts again while the brick is off",
        [FORCE_OFF, "!tick 500", FORCE_OFF],
        {},
        POWER,
        "0000*6 005a*251 0000*43",
    ),
    (
        "a state of the radio that the map brings is not busy",
        ["019501000c001b00010010"],
        {},
        UI,
        "8010*2630 8005 8006 8007*68",
    ),
    (
        "DeactivateFlag counts only if it is 1",
        [*PROGRAM, *START, "!tick 10"],
        {4: "0195010001001f00010005", 8: "0195010001001f00010001"},
        STATUS,
        "02010000*4 02010005*4 04010000*12",
    ),
    (
        "the second byte of the Bluetooth buffer stays 0",
        [],
        {1: "01950100050085040300010203"},
        BT_BUFFER,
        "05000100 01000300*2",
    ),
    (
        "a key of the map waits for the first passes of a warning",
        ["!battery 430", "!tick 847"],
        {4: "019501000c001c00010001"},
        BUTTON,
        "800700*2 c00f00*2 c00f01*5 800700*21",
    ),
    (
        "a written state of a button counts until the next sample",
        ["!tick 2"],
        {2: "0195010004002300010080"},
        UI,
        "8007*2 800a 8005 8006 8007*3",
    ),
    (
        "a key that comes with a warning is lost",
        ["!battery 430", "!tick 847"],
        {1: "019501000c001c00010001"},
        BUTTON,
        "800700 c00f00*29",
    ),
    (
        "the icon of an empty battery begins anew with a start",
        [*OFF, "!battery 430", "!button 8"],
        {},
        ICONS,
        "1a210311 1a21040e*171 1a21020e*165 1a21030d*63",
    ),
    (
        "the end of a start draws the menu",
        [*ON, "!tick 3685"],
        {},
        MASKS,
        "0000000000000000*6 0000002000000000 0000000000000000*2 0002004000f70f00 0002000000e70f00 "
        "0000000000e70f00 0000000000e70700 0000000000e70300 0000000000e70100 0000000000e70000 "
        "0000000000670000 0000000000270000 0000000000070000 0000000000030000 0000000000010000 "
        "0000000000000000*9",
    ),
    (
        "a file started from its page begins to draw anew",
        [
            *PROGRAM,
            "!button 8",
            "!tick 4",
            "!button 0",
            "!tick 20",
            "!button 8",
            "!tick 4",
            "!button 0",
            "!tick 20",
            "!button 8",
            "!tick 4",
            "!button 0",
            "!tick 6",
        ],
        {0: "!button 8", 4: "!button 0"},
        MASKS,
        "0006020008f70f00 0006000008f70f00 0002000008f70f00 0000000008f70f00 0000000008f70700 "
        "0000000008f70300 0000004018100000 0000000018000000 0000000008000000 0000000000000000*11",
    ),
    (
        "a file requested in the message of one from its page starts at its end",
        [
            *PROGRAM,
            "!button 8",
            "!tick 4",
            "!button 0",
            "!tick 30",
            "!button 8",
            "!tick 4",
            "!button 0",
            "!tick 30",
            "!button 8",
            "!tick 4",
            "!button 0",
            "!tick 30",
            "!button 8",
            "!tick 4",
            "!button 0",
            "!tick 30",
            "0001",
            "!tick 700",
        ],
        {10: "0000676f2e7278650000000000000000000000000000"},
        UI,
        "c006*10 e006*40 e00d e00e*7 e60e*22",
    ),
    (
        "a key of the map counts while keys are disabled",
        ["019501000c001a00010006"],
        {1: "019501000c001c00010001"},
        BUTTON,
        "060700 060800 060500 060600 860700*4",
    ),
    (
        "and while a button that is disabled is held",
        ["019501000c001a00010002"],
        {1: "!button 4", 3: "019501000c001c00010002", 8: "!button 0"},
        BUTTON,
        "020700*3 020a00 020500 020600 820700*10",
    ),
]


@pytest.mark.parametrize(("setup", "then", "read", "expected"), [pytest.param(*case, id=name) for name, *case in CASES])
def test_the_passes_are_those_of_the_firmware(seen_in_passes, setup, then, read, expected):
    assert seen_in_passes(setup, then, read, expected) == expected
