"""Records of clumps at the beginning of the memory pool; the bytes are those that LEGO's firmware showed."""

import struct

import pytest

from firmware_protocol.direct import StartProgram
from firmware_protocol.iomap import COMMAND
from firmware_protocol.system import IOMapRead
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.rxe import Type

WAIT, STOP_CLUMP, JUMP, COMPARE, BUILD = 0x34, 0x2D, 0x25, 0x11, 0x18
SIZES = {"1.29": 28, "1.05": 20, "1.32": 48}


def program(waits):
    """A clump that ends and starts the second one, which runs forever."""
    variables = Variables()
    time = variables.number(40)
    begin = [instruction(WAIT, 0xFFFF, time)] if waits else []
    first = [*begin, instruction(STOP_CLUMP, 0, 0)]
    return assemble(variables, first, [[0x4000 | JUMP, 0]], fire=(0, 1), dependents=[[1], []])


def records(firmware, passes, content, count=2):
    bench = Bench(SimBrick(firmware=firmware))
    store(bench.brick, "a.rxe", content)
    bench.telegram(StartProgram("a.rxe").encode().hex())
    bench.control(f"!tick {passes}")
    at, size = COMMAND.field("MemoryPool").offset, SIZES[firmware]
    reads = (IOMapRead(COMMAND.module_id, at + number * size, size) for number in range(count))
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
    assert records(firmware, passes, program(waits=firmware != "1.05")) == [first, second]


@pytest.mark.parametrize(("firmware", "at"), [("1.29", 15), ("1.32", 16)])
@pytest.mark.parametrize(("kind", "flag"), [(Type.SWORD, 0), (Type.UBYTE, 1), (None, 1)])
def test_a_record_tells_whether_its_clump_compares_arrays_other_than_texts(firmware, at, kind, flag):
    variables = Variables()
    first, second = (variables.array([1, 2], kind) if kind else variables.number(1) for _ in range(2))
    lines = instruction(COMPARE, variables.number(), first, second), [0x4000 | JUMP, 0]
    (record,) = records(firmware, 20, assemble(variables, lines), 1)
    assert bytes.fromhex(record)[at] & 1 == flag


def test_in_1_05_an_array_in_an_array_tells_where_its_number_is():
    variables = Variables()
    texts = len(variables.table)
    variables.table += [(Type.ARRAY, 0, len(variables.static)), (Type.ARRAY, 1, 0), (Type.UBYTE, 1, 0)]
    variables.static += bytes([len(variables.arrays) + 1, 0, 0, 0])
    variables.arrays.append((2, b""))
    lines = instruction(BUILD, texts, variables.text(b"a\0"), variables.text(b"b\0")), [0x4000 | JUMP, 0]
    bench = Bench(SimBrick(firmware="1.05"))
    store(bench.brick, "a.rxe", assemble(variables, lines))
    bench.telegram(StartProgram("a.rxe").encode().hex())
    bench.control("!tick 20")
    pool = b"".join(
        bytes.fromhex(bench.telegram(IOMapRead(COMMAND.module_id, 52 + at, 50).encode().hex()))[9:]
        for at in range(0, 400, 50)
    )
    fields = bench.telegram(IOMapRead(COMMAND.module_id, 24, 4).encode().hex())
    variables_at, descriptors_at = struct.unpack("<HH", bytes.fromhex(fields)[9:])
    backs = [struct.unpack_from("<H", pool, descriptors_at - 52 + 10 * number + 6)[0] for number in (4, 5)]
    assert [struct.unpack_from("<H", pool, variables_at - 52 + back)[0] for back in backs] == [4, 5]
