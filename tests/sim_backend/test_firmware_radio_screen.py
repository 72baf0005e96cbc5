"""What commands to the radio draw on the screen; the last result of each is the one that LEGO's firmware gave."""

import pytest

from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick

NEW_NAME = "0198616c7068612062657461000000000000"

CONVERSATIONS = [
    (
        "a new name draws the status bar in its own pass",
        "1.29",
        [NEW_NAME, "019401000a0004000800"],
        "02940001000a0008000002000000f20100",
    ),
    (
        "a new name requests the status bar again when the radio has answered",
        "1.05",
        [NEW_NAME, "!tick 3", "019401000c001a000600"],
        "02940001000c000600880700010401",
    ),
    (
        "that is drawn in the next pass",
        "1.32",
        [NEW_NAME, "!tick 4", "019401000a0004000800"],
        "02940001000a0008000002000000f20100",
    ),
    (
        "a new name in stream mode draws the status bar at once",
        "1.29",
        ["!btmode 1", NEW_NAME, "019401000a0004000800"],
        "02940001000a0008000002000000f20100",
    ),
    (
        "the radio's answer after stream mode draws it again",
        "1.29",
        [
            "!btmode 1",
            NEW_NAME,
            "!tick 300",
            "!btmode 0",
            "!tick 2",
            "019401000a0004000800",
        ],
        "02940001000a0008000002000000f20100",
    ),
    (
        "switching the radio off draws its icon",
        "1.29",
        ["001f0000", "!tick 5", "019401000a006c000400"],
        "02940001000a0004001d210c11",
    ),
    (
        "switching on requests the status bar three times",
        "1.29",
        ["001f0000", "!tick 20", "001f0001", "!tick 159", "019401000c001a000600"],
        "02940001000c000600880700010404",
    ),
    (
        "the last one still shows that the radio is off",
        "1.29",
        ["001f0000", "!tick 20", "001f0001", "!tick 162", "019401000a006c000400"],
        "02940001000a0004001d210211",
    ),
    (
        "a reset requests it as the radio starts again",
        "1.05",
        ["01a4", "!tick 159", "019401000c001a000600"],
        "02940001000c000600880700010404",
    ),
    (
        "a radio that is off is shown at power-on",
        "1.29",
        ["001f0000", "!tick 20", "!reboot", "019401000a006c000400"],
        "02940001000a0004001d210c11",
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
