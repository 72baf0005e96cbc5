"""The simulated brick's power-off and its radio, as LEGO's firmware shows them.

Each result is what the firmware gave to the last line. Source: docs/firmware.md sections 8 and 10.
"""

import pytest

from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick

CONVERSATIONS = [
    (
        "the power goes off when the radio has ended its connections",
        "1.29",
        ["019501000c002700010001", "!tick 6", "!power"],
        "power=00 display=0 inpower=00 div0=0",
    ),
    (
        "a radio that is off takes longer",
        "1.29",
        ["001f0000", "!tick 700", "019501000c002700010001", "!tick 108", "!power"],
        "power=00 display=0 inpower=00 div0=0",
    ),
    (
        "but not forever",
        "1.29",
        ["001f0000", "!tick 700", "019501000c002700010001", "!tick 109", "!power"],
        "power=5a display=0 inpower=00 div0=0",
    ),
    (
        "a busy radio is not waited for",
        "1.29",
        ["0198526f626f2d3100000000000000000000", "019501000c002700010001", "!tick 4", "!power"],
        "power=5a display=0 inpower=00 div0=0",
    ),
    (
        "stream mode makes the power-off wait",
        "1.05",
        ["!btmode 1", "019501000c002700010001", "!tick 300", "!power"],
        "power=00 display=0 inpower=00 div0=0",
    ),
    (
        "until the radio has left it",
        "1.05",
        ["!btmode 1", "019501000c002700010001", "!tick 300", "!btmode 0", "!tick 1", "!power"],
        "power=5a display=0 inpower=00 div0=0",
    ),
    (
        "the radio is busy while it ends its connections",
        "1.29",
        ["019501000c002700010001", "!tick 4", "0198526f626f2d3100000000000000000000"],
        "029894",
    ),
    (
        "a boot with the radio off clears its state in the Comm map",
        "1.29",
        ["001f0000", "!tick 700", "!reboot", "01940100050066041f00"],
        "029400010005001f004e585400000000000000000000000000010000165301020300000000000000",
    ),
    (
        "whose bits come as it starts",
        "1.29",
        ["001f0000", "!tick 700", "!reboot", "001f0001", "!tick 161", "01940100050066041f00"],
        "029400010005001f004e585400000000000000000000000000010000165301020300010000000000",
    ),
    (
        "a radio that is off gets the default name when it has started for the reset",
        "1.29",
        [
            "0198526f626f2d31323334353637380000",
            "001f0000",
            "!tick 700",
            "!reboot",
            "01a4",
            "!tick 316",
            "01940100050066041f00",
        ],
        "029400010005001f004e585400000000000000000000000000010000165301020300030000000000",
    ),
    (
        "a command that the beginning of the stream has lost makes its telegrams lost",
        "1.29",
        ["0198526f626f2d3100000000000000000000", "!btmode 1", "!bt 0200019b"],
        "",
    ),
    (
        "until the radio is free again",
        "1.29",
        ["0198526f626f2d3100000000000000000000", "!btmode 1", "!tick 498", "!bt 0200019b"],
        "2100029b00526f626f2d31000000000000000000001653010203000000000024d80100",
    ),
    (
        "a radio that is off has no stream",
        "1.32",
        ["001f0000", "!tick 50", "!btmode 1", "!bt 02000188"],
        "",
    ),
    (
        "nor after that",
        "1.29",
        ["001f0000", "!tick 50", "!btmode 1", "!tick 600", "!bt 0200019b"],
        "",
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
