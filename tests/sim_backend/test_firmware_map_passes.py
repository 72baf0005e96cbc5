"""What becomes of bytes written to IO maps; the last result of each conversation is that of LEGO's firmware."""

import pytest

from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick

CONVERSATIONS = [
    (
        "DeviceInfo shows the bytes behind the name",
        "1.29",
        ["019501000500740401000041", "019b"],
        "029b004e5854000000000000000000000000001653010203000000000024d80100",
    ),
    (
        "and the quality of the connections in the map",
        "1.29",
        ["019501000500d703010009", "019b"],
        "029b004e5854000000000000000000000000001653010203000900000024d80100",
    ),
    (
        "the request bit of the high speed port is taken back",
        "1.29",
        ["0195010005006307010003", "01940100050063070300"],
        "029400010005000300020000",
    ),
    (
        "its first state leads to the second",
        "1.29",
        ["01950100050063070300010001", "01940100050063070300"],
        "029400010005000300010002",
    ),
    (
        "1.32 ends with state 6",
        "1.32",
        ["01950100050063070300010002", "01940100050063070300"],
        "029400010005000300000006",
    ),
    (
        "the event of a new press lasts to the end of the pass",
        "1.29",
        ["!tick 2", "01950100040022000200ffff", "01940100040020000400"],
        "0294000100040004000000fefe",
    ),
    (
        "a message of the radio is state 16",
        "1.29",
        ["019501000c001f00010008", "019401000c001a000600"],
        "02940001000c000600c01000010408",
    ),
    (
        "with the flag busy in each pass",
        "1.29",
        ["019501000c001f00010008", "019501000c001a00010000", "019401000c001a000600"],
        "02940001000c000600401000010408",
    ),
    (
        "and the menu after it",
        "1.29",
        ["019501000c001f00010008", "!tick 2631", "019401000c001a000600"],
        "02940001000c000600800500010400",
    ),
    (
        "or a file that was requested",
        "1.29",
        [
            "019501000c001f00010008",
            "0181612e72786500000000000000000000000000000001000000",
            "01830041",
            "018400",
            "0000612e727865000000000000000000000000000000",
            "!tick 2627",
            "019401000c001a000600",
        ],
        "02940001000c000600e00d00010400",
    ),
    (
        "a question of the radio is state 12",
        "1.29",
        ["019501000c001f00010048", "!tick 3000", "019401000c001a000600"],
        "02940001000c000600c00c00010448",
    ),
    (
        "with a sound",
        "1.29",
        ["019501000c001f00010040", "!tick 1", "0194010008001a000400"],
        "02940001000800040001000004",
    ),
    (
        "whose name replaces the last one",
        "1.29",
        ["019501000c001f00010040", "!tick 1", "01940100080006001400"],
        "0294000100080014002120417474656e74696f6e2e72736f0000000000",
    ),
    (
        "keys do not click while a message of the radio is shown",
        "1.29",
        ["019501000c001f00010008", "!button 8", "!tick 4", "01940100080006001400"],
        "0294000100080014002120537461727475702e72736f00000000000000",
    ),
    (
        "ForceOff draws the menu in state 6, whatever was written before",
        "1.29",
        ["019501000c001b00010040", "019501000c002700010001", "019401000c001a000300"],
        "02940001000c000300800600",
    ),
    (
        "ForceOff is taken back, also when the brick is off",
        "1.29",
        ["019501000c002700010001", "!tick 50", "019501000c002700010001", "019401000c0027000100"],
        "02940001000c00010000",
    ),
    (
        "the command to switch off is taken back after 257 passes",
        "1.29",
        ["019501000c002700010001", "!tick 256", "01940100060000000200"],
        "029400010006000200005a",
    ),
    (
        "and not before",
        "1.29",
        ["019501000c002700010001", "!tick 255", "01940100060000000200"],
        "029400010006000200005a",
    ),
    (
        "a write to its own receive buffer changes the reply's opcode",
        "1.29",
        ["019501000500950602000194"],
        "029400010005000200",
    ),
    (
        "or says that no reply is wanted",
        "1.29",
        ["019501000500950602008195"],
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
