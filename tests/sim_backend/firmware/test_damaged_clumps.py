"""What the firmware does with damaged programs: ends of clumps, clumps that do not exist, very many elements.

Each answer is as LEGO's firmware gave it, but for the time that elements take. Source: docs/firmware.md section 8.
"""

import struct

import pytest

from firmware_protocol.direct import StartProgram
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.rxe import Type
from tests.sim_backend.firmware.test_damaged_programs import Outcome, changed, descriptor, header, program

ADD, BUILD, FILL, SET, JUMP, BRANCH, BRANCH_TEST = 0x00, 0x18, 0x1A, 0x1C, 0x25, 0x26, 0x27
STOP, FINISH_INTO, CALL, RETURN, SET_OUTPUT = 0x29, 0x2B, 0x2E, 0x2F, 0x31
RUNNING, ENDED, FAILED = 2, 1, 3
NONE = 0xFFFF
SPIN = instruction(JUMP, 0)


@pytest.mark.parametrize(
    ("firmware", "last", "beyond", "status"),
    [
        ("1.05", instruction(CALL, 2, 2), 0, RUNNING),
        ("1.05", instruction(CALL, 2, 2), 1, FAILED),
        ("1.05", instruction(CALL, 9, 2), 1, FAILED),
        ("1.05", instruction(STOP, NONE), 1, FAILED),
        ("1.05", instruction(FINISH_INTO, 2), 1, RUNNING),
        ("1.29", instruction(CALL, 2, 2), 0, RUNNING),
        ("1.29", instruction(CALL, 2, 2), 3, FAILED),
        ("1.29", instruction(CALL, 9, 2), 3, ENDED),
        ("1.29", instruction(STOP, NONE), 2, ENDED),
        ("1.29", instruction(FINISH_INTO, 2), 2, RUNNING),
    ],
)
def test_an_instruction_that_suspends_its_clump_fails_behind_the_end_of_the_clump(firmware, last, beyond, status):
    """In 1.29 only while another clump runs; being at the end is not behind it."""
    content = program([last], [instruction(STOP, NONE)], [SPIN], fire=[0, 1, 1])
    records = len(content) - 2 * header(content, 10) - 3 * 4
    outcome = Outcome(changed(content, records + 4 + 2, "<H", len(last) - beyond), firmware, clumps=3)
    assert outcome.status == status


def array_without_memory(*code):
    """A program that repeats code; variables are 0, 1, 20000, an array (4) of elements without a size, and one (6)."""
    variables = Variables()
    for value in (0, 1, 20_000, 0x44):
        variables.number(value)
    variables.table += [(Type.ARRAY, 0, len(variables.static)), (Type.CLUSTER, 0, 0), (Type.CLUSTER, 0, 0)]
    variables.static += struct.pack("<HH", 1, 0)
    variables.arrays.append((1, b""))
    content = assemble(variables, [*code, instruction(JUMP, -sum(map(len, code)))])
    return changed(content, descriptor(content, 1, 1), "<H", 0)


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
def test_instructions_take_more_than_a_pass_if_they_use_very_many_elements(firmware):
    outcome = Outcome(array_without_memory(instruction(FILL, 4, 6, 2), instruction(ADD, 0, 0, 1)), firmware)
    assert outcome.status == RUNNING
    assert 1 <= outcome.numbers[0] <= 20


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
def test_an_instruction_that_uses_millions_of_elements_fails(firmware):
    code = instruction(FILL, 4, 6, 2), instruction(BUILD, 4, *[4] * 300)
    assert Outcome(array_without_memory(*code), firmware).status == FAILED


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
@pytest.mark.parametrize("number", [3, 7, 254, 255])
@pytest.mark.parametrize("opcode", [CALL, RETURN])
def test_the_turn_of_a_clump_that_does_not_exist_ends_the_program(firmware, number, opcode):
    """The other clumps have one turn each."""
    last = instruction(CALL, number, 3) if opcode == CALL else instruction(RETURN, 3)
    count = [instruction(ADD, 0, 0, 2), instruction(JUMP, -4)]
    content = program([instruction(SET, 3, number), last, SPIN], [instruction(SET, 2, 1), *count], [SPIN])
    outcome = Outcome(content, firmware, clumps=3)
    assert (outcome.status, outcome.numbers[0]) == (ENDED, 0x11 + 10)


@pytest.mark.parametrize(("firmware", "at"), [("1.05", 7), ("1.29", 13)])
def test_to_fire_a_clump_that_does_not_exist_counts_down_where_its_record_would_be(firmware, at):
    outcome = Outcome(program([instruction(FINISH_INTO, 2)], [SPIN]), firmware, clumps=2)
    variables = bytearray(struct.pack("<4I", 0x11, 0x22, 0x33, 0x44))
    variables[at] = 0xFF
    assert outcome.numbers == struct.unpack("<4I", variables)


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
def test_a_call_writes_one_byte_of_its_variable(firmware):
    content = program([instruction(SET, 0, 0x1234), instruction(CALL, 1, 0)], [SPIN], fire=[0, 1])
    assert Outcome(content, firmware, clumps=2).numbers[0] == 0x1200


@pytest.mark.parametrize("relation", range(6))
def test_a_jump_that_compares_texts_is_always_made_in_firmware_1_32(relation):
    code = [instruction(BRANCH, 8, 4, 6, flags=relation), *[instruction(ADD, 0, 0, 1)] * 10, SPIN]
    assert Outcome(program(code, texts=2), "1.32").numbers[0] == 0x11 + 9 * 0x22


@pytest.mark.parametrize("firmware", ["1.05", "1.29", "1.32"])
@pytest.mark.parametrize("size", [0, 1])
def test_an_instruction_without_a_size_in_the_code_of_a_clump_does_not_hang_its_start(firmware, size):
    """LEGO's firmware does, but for 1.05."""
    assert Outcome(program([SPIN, [0xE000 | BUILD, size]]), firmware).status == RUNNING


@pytest.mark.parametrize(("firmware", "status"), [("1.05", FAILED), ("1.29", RUNNING)])
def test_a_setting_of_outputs_in_eight_bytes_fails_in_firmware_1_05(firmware, status):
    code = [[0x8000 | SET_OUTPUT, 8, 0, 1], SPIN]
    assert Outcome(program(code), firmware).status == status


def test_the_last_array_grows_in_place_up_to_the_end_of_the_memory_that_was_used():
    variables = Variables()
    for value in (6, 2, 5, 0x44):
        variables.number(value)
    text = variables.text(b"abc\0")
    code = [instruction(FILL, text, 3, length) for length in range(3)]
    offsets = []
    for count in (1, 3):
        brick = SimBrick()
        store(brick, "a.rxe", assemble(variables, [*code[:count], SPIN]))
        brick.receive(StartProgram("a.rxe").encode())
        brick.tick(20)
        offsets.append(brick.command.pool.find(b"\x44" * 5))
    assert offsets[0] == offsets[1] > 0


@pytest.mark.parametrize("opcode", [0x00, 0x18, 0x19, 0x1C, 0x22, 0x31])
def test_a_jump_to_an_instruction_without_a_size_fails_in_firmware_1_29(opcode):
    code = [instruction(JUMP, 4), instruction(SET, 3, opcode), instruction(SET, 1, 0x72), SPIN]
    outcome = Outcome(program(code), "1.29")
    assert (outcome.status, outcome.numbers) == (FAILED, (0x11, 0x22, 0x33, 0x44))


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
@pytest.mark.parametrize(
    ("value", "relation", "jumps"), [(0x8000_0000, 0, True), (0xFFFF_FFFF, 1, False), (1, 1, True)]
)
def test_a_jump_that_tests_an_unsigned_number_takes_it_as_signed(firmware, value, relation, jumps):
    variables = Variables()
    for number in (0x11, 0x22, 0x33, 0x44):
        variables.number(number)
    tested = variables.number(value, Type.ULONG)
    code = [instruction(BRANCH_TEST, 6, tested, flags=relation), instruction(SET, 0, 0x77), SPIN]
    assert Outcome(assemble(variables, code), firmware).numbers[0] == (0x11 if jumps else 0x77)
