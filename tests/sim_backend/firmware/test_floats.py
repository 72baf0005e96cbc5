"""Floats in programs: as texts, from texts and in integers. See docs/firmware.md 8.2 and 8.6."""

import math
import struct

import pytest

from firmware_protocol.direct import StartProgram
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.numbers import SCALARS
from sim_backend.firmware.vm.rxe import Type

MOD, NOT, MOVE, TO_TEXT, TO_NUMBER, TEST_JUMP, SQRT, SIGN, PRINT = 0x05, 0x09, 0x1B, 0x1F, 0x20, 0x27, 0x36, 0x66, 0x6A
NONE = 0xFFFF
FOREVER = [0x4025, 0]
CLUMP = {"1.29": 28, "1.32": 48}
LATER = sorted(CLUMP)
U8, U16, U32, S32, F32 = Type.UBYTE, Type.UWORD, Type.ULONG, Type.SLONG, Type.FLOAT
INFINITY = math.inf


class Program:
    """A program that runs its instructions once and then waits."""

    def __init__(self, firmware, variables, *code):
        self.brick, self.variables = SimBrick(firmware=firmware), variables
        self.start = CLUMP[firmware]
        store(self.brick, "a.rxe", assemble(variables, [*code, FOREVER]))
        self.brick.receive(StartProgram("a.rxe").encode())
        self.brick.tick(30)

    def value(self, variable):
        kind, _, at = self.variables.table[variable]
        return SCALARS[kind].unpack_from(self.brick.command.pool, self.start + at)[0]

    def text(self, variable):
        index = struct.unpack_from("<H", self.brick.command.pool, self.start + self.variables.table[variable][2])[0]
        return bytes(self.brick.command.mailboxes._memory.bytes_of(index))


def as_text(firmware, number):
    variables = Variables()
    source, target = variables.number(number, F32), variables.text()
    return Program(firmware, variables, instruction(TO_TEXT, target, source)).text(target)


@pytest.mark.parametrize(
    ("firmware", "number", "text"),
    [
        ("1.29", 8115291947008.0, b"8115291947008"),
        ("1.29", -8115291947008.0, b"-8.11529e+12"),
        ("1.29", 1.3796e13, b"1.3796e+13"),
        ("1.29", 2e20, b"2e+20"),
        ("1.32", 68432707584.0, b"68432707584"),
        ("1.32", -13928904704.0, b"-1.39289e+1"),
        ("1.32", 2e20, b"2e+2"),
        ("1.32", INFINITY, b"inf"),
        ("1.29", -INFINITY, b"-inf"),
        ("1.29", math.nan, b"nan"),
        ("1.32", -math.nan, b"-nan"),
    ],
)
def test_a_float_of_more_than_16_characters_becomes_a_text_with_an_exponent(firmware, number, text):
    assert as_text(firmware, number) == text + b"\0"


@pytest.mark.parametrize("firmware", LATER)
def test_the_root_of_a_negative_number_is_a_negative_nan_as_on_the_bench(firmware):
    variables = Variables()
    source, root, target = variables.number(-1, F32), variables.number(0, F32), variables.text()
    code = instruction(SQRT, root, source), instruction(TO_TEXT, target, root)
    assert Program(firmware, variables, *code).text(target) == b"-nan\0"


def read(firmware, content, kind, offset=None, default=None):
    variables = Variables()
    target, past, source = variables.number(5, kind), variables.number(77, U16), variables.text(content)
    options = [NONE if value is None else variables.number(*value) for value in (offset, default)]
    done = Program(firmware, variables, instruction(TO_NUMBER, target, past, source, *options))
    return done.value(target), done.value(past)


@pytest.mark.parametrize(
    ("firmware", "content", "kind", "expected"),
    [
        ("1.29", b"1.2.3x\0", F32, (pytest.approx(1.2), 3)),
        ("1.29", b"1..2\0", S32, (1, 2)),
        ("1.29", b"12+3\0", S32, (12, 2)),
        ("1.29", b"1e3\0", F32, (1000, 1)),
        ("1.32", b"1e3\0", F32, (1000, 3)),
        ("1.32", b"1e+5\0", F32, (100000, 2)),
        ("1.32", b"1e5.5\0", F32, (100000, 3)),
        ("1.32", b"1..2\0", S32, (1, 1)),
        ("1.29", b"0x\0", F32, (0, 0)),
        ("1.29", b"0x1.8\0", F32, (1.5, 1)),
        ("1.29", b"0x1p3\0", S32, (8, 1)),
        ("1.29", b"inf 77 x\0", F32, (INFINITY, 6)),
        ("1.29", b"infix\0", F32, (0, 0)),
        ("1.29", b"4294967295\0", S32, (0, 10)),
        ("1.32", b"4294967295\0", S32, (0x7FFFFFFF, 10)),
        ("1.32", b"4294967295\0", U32, (0x7FFFFFFF, 10)),
        ("1.32", b"-99999999999\0", S32, (-(1 << 31), 12)),
        ("1.32", b"999999999\0", S32, (999999999, 9)),
        ("1.29", b"0x1p5000\0", F32, (INFINITY, 1)),
        ("1.32", b"-0x1p5000\0", F32, (-INFINITY, 2)),
    ],
)
def test_a_number_in_a_text_ends_where_the_firmware_ends_it(firmware, content, kind, expected):
    assert read(firmware, content, kind) == expected


@pytest.mark.parametrize(
    ("sign", "digit", "value"), [(b"", b"9", (1 << 31) - 1), (b"-", b"9", -1 << 31), (b"", b"0", 7)]
)
def test_a_text_may_have_any_number_of_digits(sign, digit, value):
    assert read("1.32", sign + digit * 5000 + b"7\0", S32) == (value, len(sign) + 5001)


@pytest.mark.parametrize("firmware", LATER)
def test_a_text_is_read_beyond_its_end(firmware):
    assert read(firmware, b"nan\0er 998\0", F32)[1] == 10
    assert read(firmware, b"7\0 12\0", S32, offset=(2, U8)) == (12, 5)


@pytest.mark.parametrize(
    ("firmware", "kind", "default", "value"),
    [
        ("1.29", F32, (-2.5, F32), 4294967296.0),
        ("1.32", F32, (-1, S32), 4294967296.0),
        ("1.29", S32, (-1, S32), 0),
        ("1.32", S32, (-2.5, F32), -3),
        ("1.32", U16, (-2.5, F32), 65533),
        ("1.29", S32, (99, S32), 99),
    ],
)
def test_the_default_of_a_conversion_is_an_unsigned_integer(firmware, kind, default, value):
    assert read(firmware, b"abc\0", kind, default=default) == (value, 0)


def calculated(firmware, opcode, kind, *numbers):
    variables = Variables()
    target = variables.number(5, kind)
    arguments = [variables.number(number, of) for number, of in numbers]
    return Program(firmware, variables, instruction(opcode, target, *arguments)).value(target)


@pytest.mark.parametrize(
    ("firmware", "kind", "number", "stored"),
    [
        ("1.29", U16, 2147483904.0, 0),
        ("1.29", S32, 2147483904.0, -2147483392),
        ("1.32", S32, 2147483904.0, -(1 << 31)),
        ("1.32", S32, 4294967296.0, -(1 << 31)),
        ("1.32", U32, 2147483904.0, 2147483904),
        ("1.32", U32, 4294967296.0, 0),
        ("1.32", S32, INFINITY, -(1 << 31)),
    ],
)
def test_only_wide_integers_take_floats_from_2_to_the_31(firmware, kind, number, stored):
    assert calculated(firmware, MOVE, kind, (number, F32)) == stored


@pytest.mark.parametrize(
    ("firmware", "left", "right", "rest"),
    [("1.29", -77.75, 2.5, -1), ("1.32", -77.75, 2.5, -0.25), ("1.32", 1.5, 0.0, 1.5), ("1.32", -2.5, INFINITY, -2.5)],
)
def test_the_remainder_of_floats_is_one_of_integers_in_lego_s_firmware(firmware, left, right, rest):
    assert calculated(firmware, MOD, F32, (left, F32), (right, F32)) == rest


@pytest.mark.parametrize("firmware", LATER)
@pytest.mark.parametrize(("number", "negated"), [(0.2, 1), (0.5, 0), (-0.2, 1), (-0.6, 0), (4294967296.0, 1)])
def test_a_float_is_rounded_before_it_is_negated(firmware, number, negated):
    assert calculated(firmware, NOT, U8, (number, F32)) == negated


@pytest.mark.parametrize("firmware", LATER)
@pytest.mark.parametrize(("number", "jumps"), [(2147483648.0, True), (1e9, False), (-0.4, False), (-0.5, True)])
def test_a_float_is_tested_as_a_signed_integer(firmware, number, jumps):
    variables = Variables()
    tested, target = variables.number(number, F32), variables.number(0)
    code = instruction(TEST_JUMP, 7, tested, flags=0), instruction(MOVE, target, tested)
    jump = [*code[0][:-2], len(code[0]) + len(code[1]), tested]
    assert Program(firmware, variables, jump, code[1]).value(target) == (0 if jumps else round(number))


def test_the_sign_of_no_number_is_1():
    assert calculated("1.32", SIGN, S32, (math.nan, F32)) == 1


@pytest.mark.parametrize(
    ("pattern", "number", "kind", "text"),
    [
        (b"%05.3d|\0", 7, S32, b"  007|"),
        (b"%-+6d|\0", 9, S32, b"+9    |"),
        (b"%+x\0", 10, S32, b"a"),
        (b"%#o\0", 9, S32, b"011"),
        (b"%#o\0", 0, S32, b"0"),
        (b"%.0d\0", 0, S32, b""),
        (b"%hd\0", 99999, S32, b"-31073"),
        (b"a%cb\0", 0x141, S32, b"aAb"),
        (b"a%cb\0", 0, S32, b"a\0b"),
        (b"%05f\0", INFINITY, F32, b"  inf"),
        (b"%E\0", -math.nan, F32, b"-NAN"),
        (b"%012.3E\0", -123.456, F32, b"-001.235E+02"),
        (b"%+f%%\0", 0.5, F32, b"+0.500000%"),
    ],
)
def test_patterns_have_the_flags_of_c(pattern, number, kind, text):
    variables = Variables()
    target, shape, source = variables.text(), variables.text(pattern), variables.number(number, kind)
    assert Program("1.32", variables, instruction(PRINT, target, shape, source)).text(target) == text + b"\0"
