"""Instructions of firmware 1.32's interpreter, each answer as that firmware gave it. See docs/firmware.md 8.6."""

import math
import struct

import pytest

from firmware_protocol import direct
from firmware_protocol.iomap import COMMAND
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.numbers import SCALARS
from sim_backend.firmware.vm.rxe import Type

ADD, SET, TO_TEXT, WAIT, START, HALT, PRIORITY, PRINT, SUMMARY, MULDIV, ADDRESS, TICK = (
    *(0x00, 0x1C, 0x1F, 0x64, 0x68, 0x67, 0x69, 0x6A, 0x6B, 0x7E, 0x89, 0x35),
)
CEIL, SINH, ACOS, ASIN, LOG, ATAN2 = 0x6F, 0x79, 0x6C, 0x6D, 0x76, 0x7C
LSL, LSR, ASR, ROTL, ROTR, COMPLEMENT, SIGN, SIND, ACOSD, POW = (
    0x0B,
    0x0C,
    0x0E,
    0x0F,
    0x10,
    0x0A,
    0x66,
    0x86,
    0x7F,
    0x7D,
)
NONE = 0xFFFF
FOREVER = [0x4025, 0]
CLUMP = 48
U8, S8, U16, S16, U32, S32, F32 = Type.UBYTE, Type.SBYTE, Type.UWORD, Type.SWORD, Type.ULONG, Type.SLONG, Type.FLOAT


def started(variables, *clumps, firmware="1.32", ms=40, **options):
    brick, content = SimBrick(firmware=firmware), assemble(variables, *clumps, **options)
    store(brick, "a.rxe", content)
    brick.receive(direct.StartProgram("a.rxe").encode())
    brick.tick(ms)
    return brick


def value(brick, variables, variable, clumps=1):
    kind, _, data = variables.table[variable]
    return SCALARS[kind].unpack_from(brick.command.pool, clumps * CLUMP + data)[0]


def status(brick):
    return brick.receive(COMMAND.field("ProgStatus").read().encode())[-1]


def result(opcode, kind, *operands):
    variables = Variables()
    target = variables.number(5, kind)
    arguments = [variables.number(number, of) for number, of in operands]
    return value(started(variables, [instruction(opcode, target, *arguments), FOREVER]), variables, target)


def text_of(brick, variables, variable):
    index = struct.unpack_from("<H", brick.command.pool, CLUMP + variables.table[variable][2])[0]
    return bytes(brick.command.mailboxes._memory.bytes_of(index))


@pytest.mark.parametrize(
    ("opcode", "kind", "operands", "expected"),
    [
        (LSL, S32, [(-1000, S32), (3, S32)], -8000),
        (LSL, S32, [(5, S32), (-1, S32)], 5),
        (LSR, S32, [(-1000, S32), (3, S32)], 536870787),
        (ASR, S32, [(-2147483647, S32), (1, S32)], -1073741823),
        (ASR, U32, [(0x80000001, U32), (1, U32)], 1073741824),
        (ROTL, U8, [(200, U8), (3, U8)], 70),
        (ROTL, S32, [(200, U8), (3, U8)], 1606),
        (ROTR, S32, [(200, U8), (3, U8)], 6425),
        (ROTR, S32, [(-1000, S32), (31, S32)], -1999),
        (LSL, F32, [(100.5, F32), (2, U8)], 0),
        (COMPLEMENT, S32, [(77, S32)], -78),
        (COMPLEMENT, U8, [(7, U8)], 248),
        (SIGN, S32, [(-0.3, F32)], -1),
        (SIGN, S32, [(4000000000, U32)], -1),
        (SIND, F32, [(30.0, F32)], 0.49999237060546875),
        (ACOSD, F32, [(0.5, F32)], 60.000003814697266),
        (POW, F32, [(2.5, F32), (3.0, F32)], 15.625),
        (POW, F32, [(-2.0, F32), (0.5, F32)], 0.0),
        (POW, F32, [(-math.inf, F32), (0.5, F32)], 0.0),
        (POW, F32, [(-2.0, F32), (math.nan, F32)], 0.0),
        (CEIL, F32, [(-math.inf, F32)], -math.inf),
        (SINH, F32, [(-1000.0, F32)], -math.inf),
        (POW, S32, [(2, S32), (10, S32)], 0),
        (MULDIV, S32, [(100000, S32), (100000, S32), (7, S32)], 1428571428),
        (MULDIV, S32, [(-7, S32), (3, S32), (2, S32)], 2147483637),
        (MULDIV, F32, [(2.5, F32), (3.5, F32), (2.0, F32)], 6.0),
        (MULDIV, S32, [(5, S32), (5, S32), (0, S32)], 0),
    ],
)
def test_numbers_are_calculated_as_by_firmware_1_32(opcode, kind, operands, expected):
    assert result(opcode, kind, *operands) == expected


@pytest.mark.parametrize(
    ("opcode", "operands", "sign"),
    [
        (ACOS, [(2.0, F32)], 1),
        (ACOS, [(-math.nan, F32)], 1),
        (ASIN, [(2.0, F32)], -1),
        (LOG, [(-1.0, F32)], -1),
        (ATAN2, [(1.0, F32), (-math.nan, F32)], -1),
    ],
)
def test_where_there_is_no_result_its_sign_is_that_of_the_bench(opcode, operands, sign):
    number = result(opcode, F32, *operands)
    assert math.isnan(number)
    assert math.copysign(1, number) == sign


@pytest.mark.parametrize(("kind", "expected"), [(S32, -16), (U32, 65520), (S16, -16)])
def test_constants_have_a_sign_if_their_variable_has_one(kind, expected):
    variables = Variables()
    target = variables.number(0, kind)
    assert value(started(variables, [instruction(SET, target, 0xFFF0), FOREVER]), variables, target) == expected


@pytest.mark.parametrize(
    ("number", "text"), [(0.12345678, b"0.1235\0"), (1.5, b"1.5\0"), (-2.0, b"-2\0"), (0.0, b"0\0")]
)
def test_floats_have_four_decimals(number, text):
    variables = Variables()
    source, target = variables.number(number, F32), variables.text()
    assert text_of(started(variables, [instruction(TO_TEXT, target, source), FOREVER]), variables, target) == text


@pytest.mark.parametrize(
    ("pattern", "number", "kind", "text"),
    [
        (b"%5d|\0", 42, S32, b"   42|\0"),
        (b"a%05db%%\0", 5, U8, b"a00005b%\0"),
        (b"%x\0", 0xDEADBEEF, U32, b"deadbeef\0"),
        (b"%.2f\0", -2.555, F32, b"-2.56\0"),
        (b"%u\0", -1, S32, b"4294967295\0"),
        (b"%d\0", 2.7, F32, b"-1610612736\0"),
        (b"%f\0", 2, S32, b"0.000000\0"),
        (b"plain\0", 1, S32, b"plain\0"),
    ],
)
def test_numbers_are_printed_by_patterns_of_c(pattern, number, kind, text):
    variables = Variables()
    target, shape, source = variables.text(), variables.text(pattern), variables.number(number, kind)
    assert text_of(started(variables, [instruction(PRINT, target, shape, source), FOREVER]), variables, target) == text


@pytest.mark.parametrize(("operation", "expected"), [(0, 13), (1, 3), (2, 119), (3, 5), (4, -3), (5, 9)])
def test_arrays_are_summarized(operation, expected):
    variables = Variables()
    target, array = variables.number(), variables.array([5, -3, 9, 2], S32)
    code = [0xE000 | SUMMARY, 14, operation, target, array, NONE, NONE]
    assert value(started(variables, [code, FOREVER]), variables, target) == expected


@pytest.mark.parametrize(
    ("operation", "values", "of", "kind", "expected"),
    [
        (0, [-1.5, 3.25, 77.125, 1000000.5, -0.001, 3.25], F32, S32, 1000082),
        (2, [-1.5, 3.25, 77.125, 1000000.5, -0.001, 3.25], F32, S32, -725374016),
        (0, [4000000000, 3, 77, 4294967295], U32, S32, -294967217),
        (1, [-2000000000, 3, 77, 2147483647, -2147483648, 3], S32, S32, -333333312),
        (3, [-2000000000, 3, 77, 2147483647, -2147483648, 3], S32, S32, 1584721152),
        (4, [4000000000, 3, 77], U32, S32, -294967296),
        (4, [-5, 3, 77], S32, U32, 3),
        (1, [2.5, 2.5, 3.5], F32, F32, 2.8333332538604736),
        (3, [7], S16, S32, -(1 << 31)),
        (4, [], S16, S32, 2147483647),
        (5, [], S16, S32, -(1 << 31)),
        (5, [], S16, U32, 0),
        (1, [], S16, S32, 0),
        (1, [], S16, U32, 1 << 31),
    ],
)
def test_summaries_are_calculated_as_the_type_of_the_result(operation, values, of, kind, expected):
    variables = Variables()
    target, array = variables.number(9, kind), variables.array(values, of)
    code = [0xE000 | SUMMARY, 14, operation, target, array, NONE, NONE]
    assert value(started(variables, [code, FOREVER]), variables, target) == expected


def test_a_part_behind_an_array_has_the_summary_0():
    variables = Variables()
    target, array, start = variables.number(9), variables.array([5, 7], S32), variables.number(3)
    code = [0xE000 | SUMMARY, 14, 4, target, array, start, NONE]
    assert value(started(variables, [code, FOREVER]), variables, target) == 0


def test_a_clump_is_started_once_halted_and_gets_longer_turns():
    variables = Variables()
    count, one = variables.number(), variables.number(1)
    other = [instruction(ADD, count, count, one), [0x4025, -4 & 0xFFFF]]
    main = [instruction(START, 1), instruction(START, 1), instruction(WAIT, 20), instruction(HALT, 1), FOREVER]
    brick = started(variables, main, other, fire=[0, 1], ms=10)
    first = value(brick, variables, count, 2)
    brick.tick(9)
    assert (first, value(brick, variables, count, 2)) == (27, 270)
    brick.tick(40)
    assert value(brick, variables, count, 2) == 550


@pytest.mark.parametrize(("code", "expected"), [(instruction(0x13, 0, 0), 0xFE), (instruction(0x28, 100, 0), 0xFE)])
def test_the_status_gives_the_error_of_a_program(code, expected):
    variables = Variables()
    variables.number()
    assert status(started(variables, [code, FOREVER])) == expected


@pytest.mark.parametrize("opcode", [LSL, SIND, WAIT, MULDIV])
def test_firmware_1_29_does_not_know_these_instructions(opcode):
    variables = Variables()
    variables.number()
    assert status(started(variables, [instruction(opcode, 0, 0, 0), FOREVER], firmware="1.29")) == 3


COMPARE, BRANCH_IF, EQ, STOP = 0x11, 0x26, 4, 0x29


@pytest.mark.parametrize(
    ("firmware", "kind", "waits", "where", "additions"),
    [
        ("1.29", S16, 2, "before", 50),
        ("1.32", S16, 2, "before", 32),
        ("1.32", S16, 0, "before", 30),
        ("1.32", S8, 2, "before", 32),
        ("1.32", U8, 2, "before", 50),
        ("1.32", S16, 2, "behind", 31),
        ("1.32", S16, 2, "nowhere", 50),
    ],
)
def test_a_jump_that_is_not_made_leads_astray_in_a_clump_that_compares_arrays(firmware, kind, waits, where, additions):
    variables = Variables()
    left, right = variables.array([1, 2], kind), variables.array([1, 3], kind)
    flag, count, one, two = (variables.number(number) for number in (0, 0, 1, 2))
    add, compare = instruction(ADD, count, count, one), instruction(COMPARE, flag, left, right, flags=EQ)
    jump = instruction(BRANCH_IF, 4 * 21, one, two, flags=EQ)
    pause = instruction(0x34, NONE, NONE) if firmware == "1.29" else instruction(WAIT, 3)
    code = [*[pause] * waits, jump, *[add] * 50, instruction(0x25, 0)]
    code = {"before": [compare, *code], "behind": [*code, compare], "nowhere": code}[where]
    clump = CLUMP if firmware == "1.32" else 28
    brick = started(variables, code, firmware=firmware)
    kind, _, data = variables.table[count]
    assert SCALARS[kind].unpack_from(brick.command.pool, clump + data)[0] == additions
