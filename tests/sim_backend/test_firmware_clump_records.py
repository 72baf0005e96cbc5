"""Records of clumps at the beginning of the memory pool; the bytes are those that LEGO's firmware showed."""

import pytest

from firmware_protocol.direct import StartProgram
from firmware_protocol.iomap import COMMAND
from firmware_protocol.system import IOMapRead
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick

WAIT, STOP_CLUMP, JUMP = 0x34, 0x2D, 0x25
SIZES = {"1.29": 28, "1.05": 20, "1.32": 48}


def program(waits):
    """A clump that ends and starts the second one, which runs for ever."""
    variables = Variables()
    time = variables.number(40)
    begin = [instruction(WAIT, 0xFFFF, time)] if waits else []
    first = [*begin, instruction(STOP_CLUMP, 0, 0)]
    return assemble(variables, first, [[0x4000 | JUMP, 0]], fire=(0, 1), dependents=[[1], []])


def records(firmware, passes, *, waits=True):
    bench = Bench(SimBrick(firmware=firmware))
    store(bench.brick, "a.rxe", program(waits))
    bench.telegram(StartProgram("a.rxe").encode().hex())
    bench.control(f"!tick {passes}")
    at, size = COMMAND.field("MemoryPool").offset, SIZES[firmware]
    reads = (IOMapRead(COMMAND.module_id, at + number * size, size) for number in range(2))
    return [bench.telegram(each.encode().hex())[18:] for each in reads]


@pytest.mark.parametrize(
    ("firmware", "passes", "first", "second"),
    [
        (
            "1.29", 20,
            "66221200702212006c2212000000ffdf64221200a117000001beadde",
            "7222120074221200722212000101ffdf00000000efbeadde00beadde",
        ),
        (
            "1.29", 200,
            "66221200702212006c2212000000ffdf642212000000000001beadde",
            "7222120074221200722212000101ffdf00000000efbeadde00beadde",
        ),
        ("1.05", 20, "0000020000000000ff14adde6415120001beadde", "0300040000000101ff14adde0000000000beadde"),
        (
            "1.32", 200,
            "66651200706512006c6512000000ff14efbeadde646512000000000001ff000000be000000be000000be000000beadde",
            "7265120074651200726512000101ff14efbeadde00000000efbeadde00ff000000be000000be000000be000000beadde",
        ),
    ],
)  # fmt: skip
def test_a_record_tells_where_its_clump_is(firmware, passes, first, second):
    assert records(firmware, passes, waits=firmware != "1.05") == [first, second]
