"""Instructions for arrays and texts do the same each time they are carried out, wherever their arrays are by then."""

import pytest

from firmware_protocol.direct import StartProgram
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.numbers import SCALARS
from sim_backend.firmware.vm.rxe import Type

ADD, SUB, MUL, INDEX, REPLACE, SIZE, BUILD, SUBSET, FILL = 0x00, 0x01, 0x03, 0x15, 0x16, 0x17, 0x18, 0x19, 0x1A
MOVE, TO_TEXT, TO_NUMBER, JOIN, PART, BRANCH_IF, STOP = 0x1B, 0x1F, 0x20, 0x21, 0x22, 0x26, 0x29
NONE, LESS = 0xFFFF, 0
U8, S8, U16, S16, U32, S32, F32 = Type.UBYTE, Type.SBYTE, Type.UWORD, Type.SWORD, Type.ULONG, Type.SLONG, Type.FLOAT
BASE = 28
REPEATS = 110


class Loop:
    """A program that repeats some instructions, and then copies elements of arrays to numbers."""

    def __init__(self):
        self.variables = Variables()
        self.count, self.one, self.limit = (self.variables.number(value) for value in (0, 1, REPEATS))

    def run(self, *lines):
        body = [*lines, instruction(ADD, self.count, self.count, self.one)]
        again = instruction(BRANCH_IF, -sum(map(len, body)), self.count, self.limit, flags=LESS)
        self.brick = SimBrick()
        store(self.brick, "a.rxe", assemble(self.variables, [*body, again, instruction(STOP, NONE)]))
        self.brick.receive(StartProgram("a.rxe").encode())
        self.brick.tick(50)
        assert not self.brick.command.active

    def __getitem__(self, number):
        kind, _, data = self.variables.table[number]
        return SCALARS[kind].unpack_from(self.brick.command.pool, BASE + data)[0]


def wrapped(value, kind):
    bits = 8 * SCALARS[kind].size
    value &= (1 << bits) - 1
    return value - (1 << bits) if kind in (S8, S16, S32) and value >> bits - 1 else value


@pytest.mark.parametrize(
    ("target", "source"),
    [(S32, S32), (U32, S32), (S16, U16), (U8, U8), (S8, S32), (U8, S16), (S32, S8), (U32, U16), (U16, S8)],
)
@pytest.mark.parametrize("opcode", [ADD, SUB, MUL])
def test_an_array_is_calculated_again_and_again(opcode, target, source):
    loop = Loop()
    first = 3 if opcode == MUL else 0
    numbers, others = loop.variables.array([first] * 5, target), loop.variables.array([wrapped(-7, source)] * 6, source)
    result, index = loop.variables.number(0, target), loop.variables.number(4)
    loop.run(instruction(opcode, numbers, numbers, others), instruction(INDEX, result, numbers, index))
    operand = wrapped(-7, source)
    expected = {ADD: operand * REPEATS, SUB: -operand * REPEATS, MUL: 3 * operand**REPEATS}[opcode]
    assert loop[result] == wrapped(expected, target)


def test_floats_are_added_in_single_precision():
    loop = Loop()
    numbers, result = loop.variables.array([3e38, 1.0], F32), [loop.variables.number(0, F32) for _ in range(2)]
    loop.run(
        instruction(ADD, numbers, numbers, numbers),
        instruction(INDEX, result[0], numbers, NONE),
        instruction(INDEX, result[1], numbers, loop.one),
    )
    assert [loop[number] for number in result] == [float("inf"), 2.0**REPEATS]


def test_an_array_may_grow_and_move_between_repeats():
    loop = Loop()
    number, behind = loop.variables.array([5], S32), loop.variables.array([1, 2, 3], S16)
    size, last, old = loop.variables.number(), loop.variables.number(), loop.variables.number(0, S16)
    loop.run(
        instruction(BUILD, number, number, loop.count),
        instruction(REPLACE, number, number, loop.count, loop.one),
        instruction(SIZE, size, number),
        instruction(INDEX, last, number, loop.count),
        instruction(BUILD, behind, behind, loop.one),
        instruction(INDEX, old, behind, NONE),
        instruction(MUL, behind, behind, loop.one),
    )
    assert (loop[size], loop[last], loop[old]) == (REPEATS + 1, 1, 1)


def test_a_part_of_an_array_follows_its_index():
    loop = Loop()
    whole, part = loop.variables.array(range(200), U8), loop.variables.array([0, 0], U8)
    two, result = loop.variables.number(2), loop.variables.number()
    loop.run(instruction(SUBSET, part, whole, loop.count, two), instruction(INDEX, result, part, loop.one))
    assert loop[result] == REPEATS


def test_an_array_is_filled_with_what_a_variable_contains_now():
    loop = Loop()
    filled, result = loop.variables.array([0], U8), loop.variables.number()
    loop.run(
        instruction(FILL, filled, loop.count, loop.limit),
        instruction(INDEX, result, filled, loop.count),
    )
    assert loop[result] == REPEATS - 1


def test_a_number_becomes_a_text_and_a_number_again():
    loop = Loop()
    text, joined, part = loop.variables.text(), loop.variables.text(), loop.variables.text()
    comma, two = loop.variables.text(b"0,\0"), loop.variables.number(2)
    result, total, past = loop.variables.number(), loop.variables.number(), loop.variables.number()
    loop.run(
        instruction(TO_TEXT, text, loop.count),
        instruction(JOIN, joined, comma, text),
        instruction(PART, part, joined, two, NONE),
        instruction(TO_NUMBER, result, past, part, NONE, NONE),
        instruction(ADD, total, total, result),
    )
    assert (loop[total], loop[result], loop[past]) == (sum(range(REPEATS)), REPEATS - 1, 3)
