"""Programs that the flags of IO maps start and end, counters and masks of those maps.

Each value is the one that LEGO's firmware gave. Source: docs/firmware.md sections 8 and 8.5.
"""

import struct

import pytest

from firmware_protocol import direct
from firmware_protocol.iomap import COMMAND, DISPLAY, UI, ProgramStatus
from firmware_protocol.system import IOMapWrite
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import FIRMWARES
from sim_backend.firmware.vm.rxe import Type
from tests.sim_backend.firmware.test_ui import LOOP

MESSAGE_MS = 765
NO_FILE = 0xF5
"""ProgStatus of firmware 1.32 without the file."""
WAIT, SYSTEM_CALL, JUMP, DRAW_POINT = 0x34, 0x28, 0x25, 14
FULL, DRAWING, STATUS_BAR = 0x1F200, 0x2000_0000, 0x8000


@pytest.fixture(params=FIRMWARES)
def bench(request):
    bench = Bench(SimBrick(firmware=request.param))
    store(bench.brick, "loop.rxe", LOOP)
    return bench


def field(bench, of, name):
    return bytes.fromhex(bench.telegram(of.field(name).read().encode().hex()))[9:]


def write(bench, of, name, content):
    telegram = of.field(name).write(content)
    bench.telegram(telegram.encode().hex())


def start(bench):
    bench.telegram(direct.StartProgram("loop.rxe").encode().hex())


def tick(bench, passes):
    bench.control(f"!tick {passes}")


def command(bench):
    """ProgStatus and ActivateFlag."""
    return field(bench, COMMAND, "ProgStatus")[0], field(bench, COMMAND, "ActivateFlag")[0]


def test_a_start_waits_until_no_end_of_a_program_is_shown(bench):
    """The flag starts a file without a name; the user interface does not know of it and never resets its status."""
    write(bench, COMMAND, "ActivateFlag", 1)
    tick(bench, 5)
    start(bench)
    tick(bench, 1000)
    assert command(bench) in ((ProgramStatus.ERROR, 0), (NO_FILE, 0))
    write(bench, COMMAND, "ProgStatus", 0)
    tick(bench, 10)
    assert command(bench) == (ProgramStatus.IDLE, 1), "requested, but the interpreter waits for a reset"
    write(bench, COMMAND, "ProgStatus", ProgramStatus.RESET)
    tick(bench, 10)
    assert command(bench) == (ProgramStatus.RUNNING, 0)


def test_the_flag_starts_a_program_whatever_the_status_tells(bench):
    write(bench, COMMAND, "ProgStatus", 1)
    name = b"loop.rxe".ljust(20, b"\0")
    bench.telegram(IOMapWrite(COMMAND.module_id, COMMAND.field("FileName").offset, len(name), name).encode().hex())
    write(bench, COMMAND, "ActivateFlag", 1)
    assert command(bench) == (ProgramStatus.RUNNING, 0)


def test_a_program_that_the_flag_starts_disables_the_keys_until_its_end(bench):
    start(bench)
    tick(bench, 50)
    write(bench, COMMAND, "ActivateFlag", 1)
    bench.telegram(direct.StopProgram().encode().hex())
    tick(bench, MESSAGE_MS)
    assert command(bench) == (ProgramStatus.RUNNING, 0)
    assert field(bench, UI, "Flags") == b"\x86"
    bench.telegram(direct.StopProgram().encode().hex())
    tick(bench, 2)
    assert field(bench, UI, "Flags") == b"\x80"


def test_an_abort_clears_the_counters_of_releases(bench):
    start(bench)
    tick(bench, 15)
    for line in ("!button 2", "!tick 4", "!button 0", "!tick 6"):
        bench.control(line)
    button = "0194010004000800" + "0800"
    assert bench.telegram(button)[18:] == "0100010001000000"
    bench.telegram(direct.StopProgram().encode().hex())
    tick(bench, 1)
    assert bench.telegram(button)[18:] == "0100000000000000"


def masks(bench, times):
    """EraseMask and UpdateMask, pass by pass."""
    read = DISPLAY.between("EraseMask", "UpdateMask").read().encode().hex()
    return [struct.unpack("<II", bytes.fromhex(bench.telegram(read))[9:]) for _ in range(times)]


def test_a_request_to_draw_the_status_again_is_worked_off_part_by_part(bench):
    tick(bench, 37)
    write(bench, UI, "Flags", 0x88)
    shown = [(0x200, FULL), (0, FULL), (0, 0xF200), (0, 0x7200), (0, 0x3200), (0, 0x1200), (0, 0x200), (0, 0)]
    assert masks(bench, 8) == shown


def test_erasing_the_screen_takes_a_part_to_draw_away(bench):
    tick(bench, 37)
    new = struct.pack("<II", 0x6000_0200, 0x2000_1018)
    bench.telegram(IOMapWrite(DISPLAY.module_id, DISPLAY.field("EraseMask").offset, len(new), new).encode().hex())
    expected = [(0x2000_0200, 0x2000_0018), (0x200, 0x2000_0018), (0, 0x2000_0018), (0, 0x18)]
    assert masks(bench, 4) == expected


def test_what_a_program_draws_is_shown_by_a_bit_for_one_pass():
    bench = Bench(SimBrick())
    variables = Variables()
    call = len(variables.table)
    variables.table.append((Type.CLUSTER, 0, 3))
    variables.number()
    variables.table.append((Type.CLUSTER, 0, 2))
    for _ in range(3):
        variables.number(5)
    code = [instruction(WAIT, 0xFFFF, variables.number(8)), instruction(SYSTEM_CALL, DRAW_POINT, call)]
    store(bench.brick, "loop.rxe", assemble(variables, [*code, instruction(JUMP, -sum(map(len, code)))]))
    start(bench)
    tick(bench, 9)
    shown = [update & ~STATUS_BAR for _, update in masks(bench, 16)]
    first = shown.index(DRAWING)
    assert shown[first : first + 8] == [DRAWING, *[0] * 7]


@pytest.mark.parametrize(("firmware", "rests"), [("1.05", False), ("1.29", False), ("1.32", True)])
@pytest.mark.parametrize("passes", [20, 23])
def test_the_refresh_of_the_screen_rests_in_the_pass_after_the_end_of_a_program(firmware, rests, passes):
    bench = Bench(SimBrick(firmware=firmware))
    store(bench.brick, "loop.rxe", LOOP)
    start(bench)
    tick(bench, passes)
    bench.telegram(direct.StopProgram().encode().hex())
    busy = [field(bench, DISPLAY, "Flags")[0] >> 7 for _ in range(3)]
    assert busy == [1, int(not rests), 1]
