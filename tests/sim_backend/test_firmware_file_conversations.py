"""Conversations about files; the last result of each is the one that LEGO's firmware gave."""

import pytest

from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick

UNCOUNTED = [
    "018b6100000000000000000000000000000000000000da010000",
    "018400",
    "018b6200000000000000000000000000000000000000da010000",
    "018400",
]
"""Creates the files a and b, whose rounded headers take a sector more."""

PROGRAM = [
    "0181676f2e727865000000000000000000000000000040000000",
    "0183004d696e6473746f726d734e585400000501000e0004000a0000000a00000000000400010004000501000004000a000100ffffffff000000002540",
    "01830002002540feff",
    "018400",
]
"""Uploads a program that runs until it is stopped."""

READ_PART = [
    "01816e2e74000000000000000000000000000000000014000000",
    "018300000102030405060708090a0b0c0d0e0f10111213",
    "018400",
    "01806e2e740000000000000000000000000000000000",
    "0182000400",
]
"""Reads the first four bytes of a file of twenty."""

WRITE = ["0183000102"]
START = ["0000676f2e7278650000000000000000000000000000", "!tick 9", "0182000300"]
"""Starts the program and reads by its handle."""

DELETE_B = "01856200000000000000000000000000000000000000"

DATA_FILE = [
    "018b642e74787400000000000000000000000000000088130000",
    "0183005a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a",
    "018400",
]
FOUR = [f"0181{digit}2e62696e{'00' * 15}0a000000" for digit in range(30, 34)]

CONVERSATIONS = [
    (
        "crop by a reading handle",
        "1.29",
        [
            *DATA_FILE,
            "0180642e747874000000000000000000000000000000",
            "018d00",
            "01862a2e2a0000000000000000000000000000000000",
        ],
        "02860000642e74787400000000000000000000000000000028000000",
    ),
    (
        "crop by a search",
        "1.29",
        [
            *DATA_FILE,
            "01862a2e2a0000000000000000000000000000000000",
            "018d00",
            "01862a2e2a0000000000000000000000000000000000",
        ],
        "02860000642e74787400000000000000000000000000000028000000",
    ),
    (
        "crop by a handle beyond the table",
        "1.29",
        [*DATA_FILE, "018d10", "01862a2e2a0000000000000000000000000000000000"],
        "02860000642e74787400000000000000000000000000000028000000",
    ),
    (
        "crop by a download is that of the file that came after it",
        "1.29",
        [
            "0181732e62696e000000000000000000000000000000b80b0000",
            "018b642e74787400000000000000000000000000000088130000",
            "018d00",
            "01862a2e2a0000000000000000000000000000000000",
        ],
        "02860000642e74787400000000000000000000000000000000000000",
    ),
    (
        "crop frees the sectors of downloads",
        "1.29",
        [
            *DATA_FILE,
            "0181732e62696e00000000000000000000000000000030750000",
            "018c642e747874000000000000000000000000000000",
            "018d01",
            "019b",
        ],
        "029b004e5854000000000000000000000000001653010203000000000028d70100",
    ),
    (
        "crop keeps the size of the header",
        "1.29",
        [
            "018b642e747874000000000000000000000000000000204e0000",
            f"018300{'5a' * 58}",
            "0183005a5a5a5a5a5a5a",
            "018d00",
            "019b",
        ],
        "029b004e5854000000000000000000000000001653010203000000000028d60100",
    ),
    (
        "crop counts one sector of a large header",
        "1.29",
        ["018b642e747874000000000000000000000000000000a0860100", "018d00", "019b"],
        "029b004e5854000000000000000000000000001653010203000000000028d60100",
    ),
    (
        "no more than four files are written by appending, either",
        "1.29",
        [*DATA_FILE, *FOUR, "018c642e747874000000000000000000000000000000"],
        "028c8c0400000000",
    ),
    (
        "a full file comes before the lack of buffers",
        "1.29",
        [
            "018b642e74787400000000000000000000000000000001000000",
            "01830041",
            "018400",
            *FOUR,
            "018c642e747874000000000000000000000000000000",
        ],
        "028c8e0400000000",
    ),
    ("nothing arrives without a cable", "1.29", ["!usb 0", "000b"], ""),
    (
        "the last packet waits for the cable",
        "1.29",
        ["!usb 0", "0003b8016400", "000b", "!usb 1", "000c"],
        "020b004a1e020c00",
    ),
    (
        "each move of the cable takes a pass",
        "1.29",
        ["!usb 0", "!usb 1", "01940100010014000100"],
        "02940001000100010072",
    ),
    (
        "a file is created without the sectors that others took uncounted",
        "1.29",
        [*UNCOUNTED, "018b63000000000000000000000000000000000000001ad40100", "018400", DELETE_B, "019b"],
        "029b004e58540000000000000000000000000016530102030000000000d8020000",
    ),
    (
        "but no data file of 1.05",
        "1.05",
        [*UNCOUNTED, "018b6300000000000000000000000000000000000000fee10100"],
        "028b8900",
    ),
    ("the handle of a program reads on in its last file", "1.29", [*PROGRAM, *READ_PART, *START], "028200000300040506"),
    (
        "also in a data file that it wrote",
        "1.29",
        [*PROGRAM, "018b6e2e74000000000000000000000000000000000014000000", *WRITE, *START],
        "0282000003000102ff",
    ),
    (
        "which is not in the flash if it was a download",
        "1.29",
        [*PROGRAM, "01816e2e74000000000000000000000000000000000014000000", *WRITE, *START],
        "028200000300ffffff",
    ),
]


@pytest.mark.parametrize(
    ("firmware", "lines", "result"), [pytest.param(*case, id=name) for name, *case in CONVERSATIONS]
)
def test_the_last_result_is_that_of_the_firmware(firmware, lines, result):
    bench = Bench(SimBrick(firmware=firmware))
    for line in lines:
        got = bench.answer(line)
    assert got == result


@pytest.mark.parametrize(
    ("opened", "last"), [(["81", "81"], "0000"), (["8b", "8b"], "8301"), (["81", "8b", "8b"], "8302")]
)
def test_data_files_that_are_written_count_twice(opened, last):
    bench = Bench(SimBrick())
    bench.control("!mkfiles 124")
    replies = [
        bench.telegram(f"01{opcode}{number:02x}{'00' * 19}01000000") for number, opcode in enumerate(opened, 0x61)
    ]
    assert replies[-1] == f"02{opened[-1]}{last.replace('0000', '0001')}"
