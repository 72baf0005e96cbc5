"""System calls, and how other modules show a program's start and end, each answer as LEGO's firmware gave it.

Source: docs/firmware.md sections 8 to 8.5.
"""

import struct

import pytest

from firmware_protocol import direct
from firmware_protocol.iomap import COMMAND, SOUND, UI, ProgramStatus
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.ui.sleep_timer import MINUTE_MS
from sim_backend.firmware.vm.memory import SCALARS
from sim_backend.firmware.vm.rxe import Type

INDEX, SET, MOVE, ADD, STOP, SETIN, SETOUT, GETIN, GETOUT, WAIT, TICK, CALL = (
    *(0x15, 0x1C, 0x1B, 0x00, 0x29, 0x30, 0x31, 0x32, 0x33, 0x34, 0x35, 0x28),
)
BRANCH_IF_ZERO = 0x27
SET_SLEEP_TIME = 46
EQ = 4
NONE = 0xFFFF
FOREVER, END = [0x4025, 0], instruction(STOP, NONE)
CLUMP_1_29 = 28
POOL = COMMAND.field("MemoryPool").offset


class Run:
    """A program that was started, and what its variables contain some milliseconds later."""

    def __init__(self, variables, code, *, ms=40, brick=None):
        self.table, self.brick = variables.table, brick or SimBrick()
        store(self.brick, "a.rxe", assemble(variables, code), linear=True)
        self.brick.receive(direct.StartProgram("a.rxe").encode())
        self.brick.tick(ms)

    def __getitem__(self, variable):
        kind, _, data = self.table[variable]
        return SCALARS[kind].unpack_from(self.brick.command.pool, CLUMP_1_29 + data)[0]


def look(brick, io_map, name, index=None):
    spot = io_map.field(name) if index is None else io_map.field(name, index)
    return spot.decode(bytes(brick.receive(spot.read().encode())[9:]))


def called(number, *members, before=(), ms=40, brick=None):
    """The members of the arguments after a system call: numbers, and texts as bytes."""
    variables = Variables()
    lines = []
    for other, *arguments in before:
        lines.append(instruction(CALL, other, variables.call(*arguments)[0]))
    cluster, found = variables.call(*members)
    run = Run(variables, [*lines, instruction(CALL, number, cluster), FOREVER], ms=ms, brick=brick)
    return [run[variable] for variable, member in zip(found, members, strict=True) if isinstance(member, int)], run


@pytest.mark.parametrize(("value", "expected"), [(-60.4, -60), (-60.5, -61), (0.4, 0), (0.5, 1), (62.5, 63), (3e9, 0)])
def test_a_float_is_rounded_where_an_instruction_takes_an_integer(value, expected):
    variables = Variables()
    port, number, read = variables.number(1), variables.number(value, Type.FLOAT), variables.number()
    run = Run(variables, [instruction(SETOUT, port, 2, number), instruction(GETOUT, read, port, 2), FOREVER])
    assert run[read] == expected


@pytest.mark.parametrize(
    ("sleep_ms", "minutes"), [(59_999, 1), (300 * MINUTE_MS, 44), (258 * MINUTE_MS - 1, 1), (0xFFFF_FFFF, 158)]
)
def test_the_sleep_time_has_eight_bits_of_minutes(sleep_ms, minutes):
    """As LEGO's firmware answered."""
    _, run = called(SET_SLEEP_TIME, 0, sleep_ms)
    reply = run.brick.receive(direct.KeepAlive().encode())
    assert direct.KeepAlive.decode_reply(reply).sleep_ms == minutes * MINUTE_MS


@pytest.mark.parametrize(("value", "branches"), [(0.4, True), (-0.4, True), (0.5, False)])
def test_a_float_is_rounded_before_it_decides_a_branch(value, branches):
    variables = Variables()
    number, one, count = variables.number(value, Type.FLOAT), variables.number(1), variables.number()
    add = instruction(ADD, count, count, one)
    run = Run(variables, [instruction(BRANCH_IF_ZERO, 3 + len(add), number, flags=EQ), add, FOREVER])
    assert run[count] == (not branches)


def test_the_time_that_a_program_reads_is_that_of_the_telegrams_in_its_pass():
    variables = Variables()
    tick = variables.number(0, Type.ULONG)
    run = Run(variables, [instruction(TICK, tick), FOREVER], ms=1)
    before_ms = look(run.brick, COMMAND, "Tick")
    run.brick.tick(20)
    assert run[tick] == before_ms + 8


@pytest.mark.parametrize(("field", "value", "seen"), [(4, -60, -60), (1, -60, 196), (5, 100, 100), (2, -60, 65476)])
def test_fields_of_inputs_keep_the_bits_of_their_type(field, value, seen):
    variables = Variables()
    port, number, read = variables.number(1), variables.number(value), variables.number()
    run = Run(variables, [instruction(SETIN, number, port, field), instruction(GETIN, read, port, field), FOREVER])
    assert run[read] == seen


def test_a_field_beyond_the_last_is_one_of_the_next_port():
    variables = Variables()
    port, number = variables.number(1), variables.number(60)
    run = Run(variables, [instruction(SETOUT, port, 17, number), instruction(SETIN, number, port, 7), FOREVER], ms=12)
    assert (run.brick.output.outputs[2].power, run.brick.input.ports[2].mode) == (60, 60)


def test_a_program_reads_its_sensors_in_every_pass():
    variables = Variables()
    port, kind, power, mode, running, flags = (variables.number(value) for value in (1, 9, 0, 1, 32, 6))
    loop = [instruction(GETIN, power, port, 2), instruction(SETOUT, port, 1, mode, 2, power, 6, running, 0, flags)]
    bench = Bench(SimBrick())
    back = -sum(map(len, loop)) & 0xFFFF
    Run(variables, [instruction(SETIN, kind, port, 0), *loop, [0x4025, back]], brick=bench.brick)
    for raw in (20, 75):
        bench.control(f"!sensor 1 {raw}")
        bench.control("!tick 1")
        assert bench.brick.output.outputs[1].power == raw
        bench.control("!sensor 1 99")
        bench.control("!tick 5")


@pytest.mark.parametrize(
    ("low", "high", "raw", "scaled"),
    [(300, 700, 0, 0), (300, 700, 699, 99), (300, 700, 1023, 100), (500, 500, 600, 0), (700, 300, 400, 75),
     (700, 300, 800, 0), (100, 60000, 65000, 11)],
)  # fmt: skip
def test_a_calibration_scales_to_a_percentage(low, high, raw, scaled):
    (status, value), _ = called(42, 9, b"x\0", raw, before=[(43, 9, b"x\0", low, high)])
    assert (status, value) == (0, scaled)


def percentage_by(name, *files):
    """What 500 is by a calibration, in percent, in a program that begins with calibration files."""
    brick = SimBrick()
    for file, content in files:
        store(brick, file, content)
    return called(42, 9, name, 500, brick=brick)[0][1]


def test_a_program_begins_with_the_calibration_of_the_newest_file():
    files = ("old.cal", struct.pack("<hh", 100, 900)), ("new.cal", struct.pack("<hh", 300, 600))
    assert [percentage_by(name, *files) for name in (b"old\0", b"new\0")] == [48, 66]


def test_a_calibration_file_of_another_size_has_no_range():
    assert percentage_by(b"odd\0", ("odd.cal", bytes([1] * 5))) == 0


def test_calibrations_end_with_their_program():
    _, run = called(42, 9, b"x\0", 500, before=[(43, 9, b"x\0", 300, 700)])
    brick = run.brick
    brick.receive(direct.StopProgram().encode())
    brick.tick(1000)
    brick.loader.delete("a.rxe")
    assert called(42, 9, b"x\0", 500, brick=brick)[0] == [0xC0, 48]


def test_calibrations_are_an_array_in_the_pool():
    calls = [(43, 9, b"abc\0", 100, 600), (43, 9, b"defg\0", 200, 1000), (43, 9, b"abc\0", 100, 601)]
    _, run = called(42, 9, b"abc\0", 500, before=calls)
    first, second = bytes.fromhex("6400590261626300"), bytes.fromhex("c800e8036465666700")
    at = bytes(run.brick.command.pool).index(first)
    assert bytes(run.brick.command.pool[at + 24 :]).startswith(second)


def test_names_of_calibrations_are_case_sensitive():
    assert called(42, 9, b"X\0", 5000, before=[(43, 9, b"x\0", 300, 700)])[0] == [0xC0, 100]


@pytest.mark.parametrize(("count", "status"), [(64, 0x90), (65, -19 & 0xFF)])
def test_no_more_than_64_bytes_of_a_map_are_read_or_written_at_once(count, status):
    assert called(32, 9, b"Nothing.mod\0", 0, count, b"\0")[0][0] & 0xFF == status
    assert called(33, 9, b"Nothing.mod\0", 0, bytes(count))[0][0] & 0xFF == status


@pytest.mark.parametrize(
    ("action", "name", "connection", "result"),
    [(0, b"Rover\0", 1, 1), (1, b"Rover\0", 1, 0), (1, b"\0", 3, 1), (1, b"\0", 4, 0), (2, b"\0", 0, 0)],
)
def test_a_connection_is_only_asked_for(action, name, connection, result):
    assert called(36, 9, action, name, connection)[0][0] == result


@pytest.mark.parametrize(("port", "status"), [(0, -32), (3, -32), (4, -33)])
@pytest.mark.parametrize("number", [37, 38])
def test_the_calls_of_the_high_speed_port_are_those_of_i2c(number, port, status):
    assert called(number, 9, port, b"ab", 3)[0][0] & 0xFF == status & 0xFF


def test_the_call_for_a_colour_sensor_needs_its_type():
    assert look(called(34, 9, 1, 0, b"", b"", b"", 9)[1].brick, COMMAND, "ProgStatus") == ProgramStatus.ERROR
    variables = Variables()
    port, kind, pause = variables.number(1), variables.number(13), variables.number(3)
    cluster, (result, *_, invalid) = variables.call(9, 1, 0, b"", b"", b"", 9)
    code = [instruction(SETIN, kind, port, 0), instruction(WAIT, NONE, pause), instruction(CALL, 34, cluster)]
    code.append(FOREVER)
    run = Run(variables, code)
    assert (run[result], run[invalid]) == (0, 1)


@pytest.mark.parametrize("count", [4, 5, 6, 9])
def test_a_message_too_many_takes_the_array_of_the_oldest(count):
    variables = Variables()
    clusters = [variables.call(9, 10, b"%d" % number)[0] for number in range(count)]
    run = Run(variables, [*(instruction(CALL, 26, cluster) for cluster in clusters), FOREVER])
    pool, list_at = run.brick.command.pool, look(run.brick, COMMAND, "OffsetDVA") - POOL
    descriptors = [struct.unpack_from("<5H", pool, list_at + 10 * index) for index in range(2 * count + 6)]
    messages = sum(size == 1 and length == 1 for _, size, length, *_ in descriptors) - count
    assert messages == min(count, 5)


LINE = bytes.fromhex("0c00 0500 0000 0000 0000 0900 0900")
SHORT_PIXEL = bytes.fromhex("0800 0400 0000 0a00 0a00")
CIRCLE = bytes.fromhex("0a00 0700 0000 1e00 1e00 0500")


@pytest.mark.parametrize(
    ("content", "linear", "status", "black"),
    [
        (LINE, True, 0xFD, 10),
        (LINE, False, 0x86, 0),
        (SHORT_PIXEL + LINE, True, 0xFD, 10),
        (CIRCLE + LINE, True, 0xFD, 0),
    ],
)
def test_a_picture_is_drawn_from_one_block_until_a_circle(content, linear, status, black):
    brick = SimBrick()
    store(brick, "a.ric", content, linear=linear)
    variables = Variables()
    variables.table.append((Type.CLUSTER, 0, 5))
    picture = len(variables.table) - 1
    result = variables.number()
    variables.call(0, 0)
    variables.text(b"a.ric\0")
    variables.array([0], Type.SLONG)
    variables.number(0)
    run = Run(variables, [instruction(CALL, 18, picture), FOREVER], brick=brick)
    assert (run[result] & 0xFF, sum(byte.bit_count() for byte in brick.display.pixels)) == (status, black)


def test_a_program_that_draws_hides_the_status_bar():
    variables = Variables()
    variables.table.append((Type.CLUSTER, 0, 3))
    point = len(variables.table) - 1
    variables.number(0)
    variables.call(3, 4)
    variables.number(0)
    pause = variables.number(100, Type.UWORD)
    code = [instruction(CALL, 14, point), instruction(WAIT, NONE, pause), END]
    brick = Run(variables, code, ms=10).brick
    assert look(brick, UI, "Flags") == 0x66
    brick.tick(60)
    assert look(brick, UI, "Flags") in (0x66, 0x67)
    brick.tick(60)
    assert look(brick, UI, "Flags") == 0xE0


@pytest.mark.parametrize(
    ("mask", "from_ms", "to_ms", "skipped"), [(8, 100, 110, True), (2, 20, 200, True), (4, 20, 50, False)]
)
def test_a_button_that_is_held_ends_the_message_after_a_program(mask, from_ms, to_ms, skipped):
    variables = Variables()
    pause = variables.number(60, Type.UWORD)
    brick = Run(variables, [instruction(WAIT, NONE, pause), END], ms=from_ms).brick
    brick.button.hold(mask)
    brick.tick(to_ms - from_ms)
    brick.button.hold(0)
    brick.tick(20)
    assert look(brick, COMMAND, "ProgStatus") == (ProgramStatus.IDLE if skipped else ProgramStatus.OK)


def test_the_sound_stops_in_the_pass_after_the_end_of_a_program():
    variables = Variables()
    pause = variables.number(20, Type.UWORD)
    cluster, _ = variables.call(0, 500, 400, 0, 2)
    code = [instruction(CALL, 10, cluster), instruction(WAIT, NONE, pause), END]
    brick = Run(variables, code, ms=8).brick
    states = []
    for _ in range(40):
        brick.tick()
        state = look(brick, SOUND, "State"), look(brick, SOUND, "Volume"), look(brick, COMMAND, "ProgStatus")
        if state[2] == ProgramStatus.RUNNING and not state[0]:
            continue
        if not states or state != states[-1]:
            states.append(state)
    assert states == [(3, 2, 2), (3, 2, 1), (4, 4, 1), (0, 4, 1)]


def test_the_map_tells_where_variables_and_descriptors_are():
    variables = Variables()
    variables.number(1)
    brick = Run(variables, [FOREVER]).brick
    assert look(brick, COMMAND, "OffsetDS") == POOL + CLUMP_1_29
