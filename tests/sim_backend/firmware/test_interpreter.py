"""Values, clumps and the memory pool of programs, each answer as LEGO's firmware gave it.

Source: docs/firmware.md sections 8.1 to 8.4.
"""

import struct

import pytest

from firmware_protocol import direct
from firmware_protocol.iomap import COMMAND, ProgramStatus
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.firmware.vm.numbers import SCALARS
from sim_backend.firmware.vm.rxe import Type

ADD, SUB, NEG, MUL, DIV, MOD, AND, OR, XOR, NOT = range(10)
COMPARE, TEST, INDEX, REPLACE, SIZE, BUILD, SUBSET, FILL = 0x11, 0x12, 0x15, 0x16, 0x17, 0x18, 0x19, 0x1A
MOVE, SET, FLATTEN, UNFLATTEN, TO_TEXT, TO_NUMBER, JOIN, PART = 0x1B, 0x1C, 0x1D, 0x1E, 0x1F, 0x20, 0x21, 0x22
JUMP, CALL, STOP, FINISH, ACQUIRE, RELEASE, SUBCALL, RETURN, SETOUT, WAIT = (
    *(0x25, 0x28, 0x29, 0x2A, 0x2C, 0x2D, 0x2E, 0x2F, 0x31, 0x34),
)
SQRT, ABS = 0x36, 0x37
NONE = 0xFFFF
U8, S8, U16, S16, U32, S32, F32 = Type.UBYTE, Type.SBYTE, Type.UWORD, Type.SWORD, Type.ULONG, Type.SLONG, Type.FLOAT
LT, EQ = 0, 4
END = instruction(STOP, NONE)


class Run:
    """A program that was started, and what its variables contain some milliseconds later."""

    def __init__(self, variables, *clumps, firmware="1.29", ms=20, **options):
        self.table, self.brick = variables.table, SimBrick(firmware=firmware)
        content = assemble(variables, *clumps, **options)
        store(self.brick, "a.rxe", content)
        self.brick.receive(direct.StartProgram("a.rxe").encode())
        clump = {"1.29": 28, "1.05": 20}[firmware]
        self.base = -(-clump * len(clumps) // 4) * 4
        self.brick.tick(ms)

    @property
    def status(self):
        return ProgramStatus(self.brick.receive(COMMAND.field("ProgStatus").read().encode())[-1])

    def __getitem__(self, variable):
        kind, _, data = self.table[variable]
        pool = self.brick.command.pool
        if kind != Type.ARRAY:
            return SCALARS[kind].unpack_from(pool, self.base + data)[0]
        at = next(
            i
            for i in range(len(pool) - 10, 0, -1)
            if struct.unpack_from("<HH", pool, i) == (i - self.base, 10) and i % 4 == self.base % 4
        )
        number = struct.unpack_from("<H", pool, self.base + data)[0]
        offset, _, length = struct.unpack_from("<HHH", pool, at + 10 * number)
        kind = self.table[variable + 1][0]
        values = [
            SCALARS[kind].unpack_from(pool, self.base + offset + i * SCALARS[kind].size)[0] for i in range(length)
        ]
        return bytes(values) if kind == U8 else values


def result(opcode, target, *operands, flags=0, firmware="1.29"):
    """The target after one instruction; numbers and arrays are given with their types, texts as bytes."""
    variables = Variables()

    def add(value):
        if isinstance(value, bytes):
            return variables.text(value)
        kind, content = value
        return variables.array(content, kind) if isinstance(content, list) else variables.number(content, kind)

    arguments = [add(value) if not isinstance(value, int) else value for value in (target, *operands)]
    run = Run(variables, [instruction(opcode, *arguments, flags=flags), END], firmware=firmware)
    return run[arguments[0]] if run.status == ProgramStatus.OK else run.status


@pytest.mark.parametrize(
    ("opcode", "left", "right", "expected"),
    [
        (DIV, (S32, -7), (S8, 2), -3),
        (DIV, (S32, -7), (U32, 2), 2147483644),
        (DIV, (U8, 250), (S8, -2), 0),
        (DIV, (S32, 7), (S32, 0), 0),
        (MOD, (S16, -7), (S32, 2), -1),
        (MOD, (S16, -7), (S32, 0), -7),
        (MOD, (U32, 4294967289), (S32, -2), -7),
        (XOR, (U8, 0x5A), (S8, -1), -91),
        (DIV, (F32, 7.5), (F32, 2.0), 3),
        (MUL, (F32, -7.5), (F32, -2.5), 18),
        (MOD, (F32, -7.5), (F32, 2.0), -1),
        (AND, (F32, 7.5), (F32, -2.5), 6),
        (DIV, (F32, 7.5), (S32, 0), 0),
    ],
)
def test_signs_and_types_decide_how_is_calculated(opcode, left, right, expected):
    assert result(opcode, (S32, 99), left, right) == expected


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        (S32, -2.5, -2),
        (U8, -1.0, 255),
        (S32, 3e9, -1294967296),
        (U32, 3e9, 3000000000),
        (U32, 5e9, 0),
        (S32, -3e9, -(1 << 31)),
        (S16, float("nan"), 0),
        (F32, 0.1, struct.unpack("<f", struct.pack("<f", 0.1))[0]),
    ],
)
def test_floats_are_truncated(kind, value, expected):
    assert result(MOVE, (kind, 1), (F32, value)) == expected


@pytest.mark.parametrize(
    ("left", "right", "expected"), [((S8, -7), (S32, 2), 1), ((S8, -7), (U8, 2), 0), ((U32, 1 << 31), (F32, 0.5), 0)]
)
def test_numbers_are_compared_with_signs_if_both_have_one(left, right, expected):
    assert result(COMPARE, (U8, 9), left, right, flags=LT) == expected


@pytest.mark.parametrize(
    ("opcode", "target", "operands", "expected"),
    [
        (ADD, [9], ((S16, [1, -2, 3]), (S16, [10, 20])), [11, 18]),
        (ADD, [9, 9, 9], ((S16, [1, -2]), (S32, 5)), [6, 3]),
        (SUB, [9], ((S32, 5), (S16, [1, 2])), [4, 3]),
        (ADD, [9, 8], ((S16, 1), (S16, 2)), [9, 8]),
        (NEG, [9], ((S16, [1, -2]),), [1, -2]),
        (NEG, [9], ((S32, [1, -2]),), [-1, 2]),
        (MOVE, [9], ((U8, 3),), [9]),
        (SUBSET, [9], ((S16, [1, 2, 3]), 0xFFFF, 0xFFFF), [1, 2, 3]),
    ],
)
def test_operations_work_on_whole_arrays(opcode, target, operands, expected):
    assert result(opcode, (S16, target), *operands) == expected


def test_only_1_29_copies_an_array_instead_of_negating_it():
    assert result(NEG, (S16, [9]), (S16, [1, -2]), firmware="1.05") == [-1, 2]


@pytest.mark.parametrize(("right", "expected"), [([1, 2], 1), ([1, 3], 1), ([1], 0), ([0, 9, 9], 0), ([1, 2, 0], 1)])
def test_arrays_are_compared_in_lexical_order(right, expected):
    assert result(COMPARE, (U8, 9), (S16, [1, 2]), (S16, right), flags=2) == expected


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ((F32, 1.5), b"1.5"),
        ((F32, 100.0), b"100"),
        ((F32, 0.125), b"0.12"),
        ((F32, -0.001), b"-0"),
        ((U32, 1 << 31), b"2147483648"),
        ((S8, -128), b"-128"),
    ],
)
def test_numbers_become_texts(value, text):
    assert result(TO_TEXT, b"\0", value) == text + b"\0"


@pytest.mark.parametrize(
    ("text", "value", "past"),
    [
        (b"-3.5\0", -3.5, 4),
        (b" 12x\0", 12, 3),
        (b"1e3\0", 1000, 1),
        (b"0x10\0", 16, 1),
        (b"abc\0", 77, 0),
        (b".5\0", 0.5, 2),
    ],
)
def test_texts_become_numbers(text, value, past):
    variables = Variables()
    target, end, default = variables.number(0, F32), variables.number(99), variables.number(77)
    source = variables.text(text)
    run = Run(variables, [instruction(TO_NUMBER, target, end, source, NONE, default), END])
    assert (run[target], run[end]) == (value, past)


def test_a_text_that_is_joined_to_itself_is_copied_with_its_new_length():
    variables = Variables()
    text, other = variables.text(b"ab\0"), variables.text(b"cd\0")
    assert Run(variables, [instruction(JOIN, text, other, text), END])[text] == b"cdcd\0"


@pytest.mark.parametrize(("length", "fits"), [(4, True), (3, False), (5, False)])
def test_values_are_flattened_and_read_back_if_the_size_is_right(length, fits):
    variables = Variables()
    source, flat = variables.array([1, -2, 300, 4][:4], S16), variables.text()
    target, failed = variables.array([7] * length, S16), variables.number(9)
    run = Run(
        variables, [instruction(FLATTEN, flat, source), instruction(UNFLATTEN, target, failed, flat, target), END]
    )
    assert run[flat] == struct.pack("<4h", 1, -2, 300, 4) + b"\0"
    assert (run[failed], run[target]) == (int(not fits), [1, -2, 300, 4] if fits else [7] * length)


def test_an_index_beyond_the_end_is_an_error_and_a_replacement_is_not():
    variables = Variables()
    target, source, number = variables.array([], U8), variables.array([1, 2, 3], U8), variables.number(3)
    run = Run(variables, [instruction(REPLACE, target, source, number, number), END])
    assert run[target] == b"\1\2\3"
    variables = Variables()
    target, source, number = variables.number(9), variables.array([1, 2, 3], U8), variables.number(3)
    assert Run(variables, [instruction(INDEX, target, source, number), END]).status == ProgramStatus.ERROR


def counting(variables, count):
    counter, one = variables.number(), variables.number(1)
    return counter, [instruction(ADD, counter, counter, one)] * count


@pytest.mark.parametrize(("firmware", "expected"), [("1.29", (20, 20, 14)), ("1.05", (20, 20, 20))])
def test_clumps_take_turns_of_twenty_instructions_until_the_pass_ends(firmware, expected):
    variables = Variables()
    (a, first), (b, second), (c, third) = (counting(variables, count) for count in (20, 200, 200))
    run = Run(variables, [*first, END], [*second, END], [*third, END], firmware=firmware)
    assert (run[a], run[b], run[c]) == expected


def test_a_wait_of_nothing_only_ends_the_turn():
    variables = Variables()
    nothing = variables.number(0)
    (a, first), (b, second) = counting(variables, 5), counting(variables, 200)
    run = Run(variables, [instruction(WAIT, NONE, nothing), *first, END], [*second, END])
    assert (run[a], run[b]) == (5, 20)


def test_a_clump_that_runs_is_not_started_twice_and_one_with_fire_count_zero_never_again():
    variables = Variables()
    count, step = counting(variables, 1)
    first = [instruction(FINISH, 0, 0)]
    run = Run(
        variables, first, first, [*step * 30, instruction(FINISH, 0, 1)], fire=(0, 0, 1), dependents=([2], [2], [0, 1])
    )
    assert (run[count], run.status) == (30, ProgramStatus.OK)


@pytest.mark.parametrize(
    ("offset", "change"), [(14, 2), (15, -2), (16, 1), (22, 2), (24, 2), (26, -2), (32, 1), (34, 1), (36, -1)]
)
def test_a_header_that_disagrees_with_the_file_is_refused(offset, change):
    variables = Variables()
    _, step = counting(variables, 1)
    variables.text(b"some\0")
    content = bytearray(assemble(variables, [*step, END]))
    content[offset] = content[offset] + change & 0xFF
    brick = SimBrick()
    handle = brick.loader.create("a.rxe", len(content), linear=True).handle
    brick.loader.write(handle, bytes(content))
    brick.loader.close(handle)
    brick.receive(direct.StartProgram("a.rxe").encode())
    brick.tick(12)
    assert brick.command.status == ProgramStatus.ERROR
    assert brick.command.pool[28:32] != b"\1\0\0\0"


@pytest.mark.parametrize("ending", [instruction(STOP, NONE), instruction(FINISH, NONE, NONE), instruction(0x0A, 0, 0)])
def test_motors_run_on_when_a_program_ends_by_itself(ending):
    variables = Variables()
    port, mode, power, running, flags = (variables.number(value) for value in (0, 1, 50, 0x20, 7))
    run = Run(variables, [instruction(SETOUT, port, 1, mode, 2, power, 6, running, 0, flags), ending], ms=12)
    run.brick.attach_motor("A", BenchMotor())
    assert run.status in (ProgramStatus.OK, ProgramStatus.ERROR)
    run.brick.tick(500)
    assert run.brick.output.controls[0].actual_speed == 50
    run.brick.tick(400)
    assert (run.brick.output.controls[0].actual_speed, run.status) == (0, ProgramStatus.IDLE)


def test_a_message_from_an_empty_box_is_an_empty_text():
    variables = Variables()
    cluster, (status, *_, text) = variables.call(9, 1, 1, b"old\0")
    run = Run(variables, [instruction(CALL, 27, cluster), END])
    assert (run[status], run[text]) == (0x40, b"\0")


def test_files_have_the_loaders_status_in_the_upper_byte():
    variables = Variables()
    missing, (lost, *_) = variables.call(9, 9, b"no.txt\0", 99)
    create, (made, handle, _, _) = variables.call(9, 9, b"a.txt\0", 5)
    write, (full, _, _, written) = variables.call(9, 1, b"hello!\0", 6)
    close, (closed, _) = variables.call(9, 77)
    lines = [instruction(CALL, number, call) for number, call in ((0, missing), (1, create), (4, write), (5, close))]
    run = Run(variables, [*lines, END])
    assert (run[lost], run[made], run[handle]) == (0x8700, 0, 1)
    assert (run[full], run[written], run[closed]) == (0x8400, 5, 0x9300)


@pytest.mark.parametrize(("firmware", "polls", "expected"), [("1.29", 718, 567), ("1.05", 25158, 1890)])
def test_a_loop_that_waits_takes_as_many_instructions_as_on_a_real_brick(firmware, polls, expected):
    """Repeats that change nothing are skipped; what follows them and what else asks for the time shows by how much."""
    variables = Variables()
    count, one, go, duration, other = (variables.number(value) for value in (0, 1, 0, 25, 0))
    poll = [instruction(ADD, other, one, one)] * 3 + [instruction(0x26, -12, go, one, flags=5)]
    busy = [instruction(ADD, other, other, one)] * 300 if firmware == "1.05" else [instruction(WAIT, NONE, duration)]
    count_up = [instruction(ADD, count, count, one), instruction(JUMP, -4)]
    run = Run(
        variables,
        poll + count_up,
        [*busy, instruction(ADD, go, go, one), instruction(FINISH, NONE, NONE)],
        firmware=firmware,
        ms=61,
    )
    assert run[count] == polls

    variables = Variables()
    count, one, state, port, time = (variables.number(value) for value in (0, 1, 0, 1, 0))
    ask = [instruction(0x33, state, port, 4), instruction(0x35, time)]
    run = Run(
        variables,
        [instruction(ADD, count, count, one), *ask, instruction(JUMP, -10)],
        firmware=firmware,
        ms=51,
    )
    assert run[count] == expected


def test_a_loop_that_only_reads_is_skipped_as_a_whole_with_its_questions_for_the_time():
    variables = Variables()
    time, limit, count, one = (variables.number(value) for value in (0, 6046, 0, 1))
    wait = [instruction(0x35, time), instruction(ADD, one, one, count), instruction(0x26, -6, time, limit, flags=LT)]
    count_up = [instruction(ADD, count, count, one), instruction(JUMP, -4)]
    started = Run(variables, wait + count_up, firmware="1.05", ms=61)
    variables = Variables()
    time, limit, count, one, odd = (variables.number(value) for value in (0, 6046, 0, 1, 0))
    wait[1] = instruction(ADD, odd, odd, one)
    restless = Run(variables, wait + count_up, firmware="1.05", ms=61)
    assert started[count] == restless[count]


@pytest.mark.parametrize(("firmware", "expected"), [("1.29", 1134), ("1.05", 20580)])
def test_a_clump_alone_takes_as_many_instructions_as_on_a_real_brick(firmware, expected):
    variables = Variables()
    count, one = variables.number(0), variables.number(1)
    run = Run(variables, [instruction(ADD, count, count, one), instruction(JUMP, -4)], firmware=firmware, ms=51)
    assert run[count] == expected


@pytest.mark.parametrize(("firmware", "expected"), [("1.29", (745, 530)), ("1.05", (9198, 7860))])
def test_a_clump_alone_takes_turns_again_when_another_one_gets_its_mutex(firmware, expected):
    variables = Variables()
    first, one, second = (variables.number(value) for value in (0, 1, 0))
    mutex = variables.number(-1, Type.MUTEX)
    add, other = instruction(ADD, first, first, one), instruction(ADD, second, second, one)
    acquire, release = instruction(ACQUIRE, mutex), instruction(RELEASE, mutex)
    run = Run(
        variables,
        [acquire, *[add] * 7, release, *[add] * 11, instruction(JUMP, -76)],
        [acquire, other, release, *[other] * 4, instruction(JUMP, -24)],
        firmware=firmware,
        ms=40,
    )
    counted = run[first]
    run.brick.tick()
    assert (counted, run[second]) == expected
