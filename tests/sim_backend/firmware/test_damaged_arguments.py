"""What the firmware does with arguments that are not of the type an instruction needs, each answer as LEGO's gave it.

Source: docs/firmware.md sections 8.1 to 8.4.
"""

import pytest

from firmware_protocol.direct import StartProgram
from firmware_protocol.iomap import COMMAND
from firmware_protocol.system import IOMapRead
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.rxe import Type

ADD, NEGATE, COMPARE, SIZE_OF, FILL, SET = 0x00, 0x02, 0x11, 0x17, 0x1A, 0x1C
FLATTEN, TO_TEXT, TO_NUMBER, JOIN, PART, TO_BYTES = 0x1D, 0x1F, 0x20, 0x21, 0x22, 0x23
JUMP, BRANCH, STOP, ACQUIRE, SYSTEM_CALL, WAIT, TICK = 0x25, 0x26, 0x29, 0x2C, 0x28, 0x34, 0x35
LESS, GREATER, LESS_OR_EQUAL, EQUAL = 0, 1, 2, 4
RUNNING, ENDED, FAILED = 2, 1, 3
NONE = 0xFFFF
BASE = {"1.05": 20, "1.29": 28}
SPIN = instruction(JUMP, 0)
A, B, TWO, MARK, TEXT, OTHER, EMPTY, WORDS, CLUSTER = 0, 1, 2, 3, 4, 6, 8, 10, 12
"""Variables: four numbers (11, 22, 2, 44 hex), `12345`, `678`, a text without a closing zero, numbers of 16 bits."""
MARKED = 0x77
both = pytest.mark.parametrize("firmware", ["1.05", "1.29"])


def variables():
    result = Variables()
    for value in (0x11, 0x22, 2, 0x44):
        result.number(value)
    for content in (b"12345\0", b"678\0", b""):
        result.text(content)
    result.array([1, 2, 3], Type.UWORD)
    result.call(1, 2)
    return result


class Run:
    """A program that has run for 20 ms: ProgStatus, and its variables."""

    def __init__(self, code, firmware, *, ending=SPIN, element_at=0):
        table = variables()
        kind, zero, _ = table.table[TEXT + 1]
        table.table[TEXT + 1] = kind, zero, element_at
        content = assemble(table, [*code, instruction(SET, MARK, MARKED), ending])
        brick = SimBrick(firmware=firmware)
        store(brick, "a.rxe", content)
        brick.receive(StartProgram("a.rxe").encode())
        brick.tick(20)
        reply = IOMapRead.decode_reply(brick.receive(COMMAND.field("ProgStatus").read().encode()))
        self.status, self._pool = reply.data[0], brick.command.pool[BASE[firmware] :]

    def bytes(self, size, at=0):
        return self._pool[at : at + size]

    def number(self, variable):
        return int.from_bytes(self.bytes(4, 4 * variable), "little")

    @property
    def went_on(self):
        return self.status == RUNNING and self.number(MARK) == MARKED


@both
@pytest.mark.parametrize(
    ("code", "content"),
    [
        (instruction(TO_TEXT, A, B), b"34\0"),
        (instruction(FLATTEN, A, B), b"\x22\0\0\0\0"),
        (instruction(PART, A, TEXT, TWO, TWO), b"34\0"),
        (instruction(TO_BYTES, A, TEXT), b"12345"),
        (instruction(JOIN, A, TEXT, OTHER), b"12345678\0"),
    ],
)
def test_characters_are_stored_in_the_place_of_a_number_that_is_taken_for_a_text(firmware, code, content):
    run = Run([code], firmware)
    assert run.went_on
    assert run.bytes(len(content)) == content


@both
@pytest.mark.parametrize("source", [A, WORDS, CLUSTER])
def test_only_texts_can_be_joined(firmware, source):
    assert Run([instruction(JOIN, TEXT, OTHER, source)], firmware).status == FAILED


@both
def test_a_text_without_a_closing_zero_alone_empties_the_target_of_a_join(firmware):
    run = Run([instruction(JOIN, TEXT, EMPTY), instruction(SIZE_OF, A, TEXT)], firmware)
    assert run.went_on
    assert run.number(A) == 0


def test_texts_without_closing_zeros_may_have_a_length_of_65535_when_they_are_joined():
    assert Run([instruction(JOIN, TEXT, EMPTY, EMPTY)], "1.29").status == FAILED


@both
def test_a_part_of_a_text_without_a_closing_zero_empties_the_target(firmware):
    run = Run([instruction(PART, TEXT, EMPTY, NONE, NONE), instruction(SIZE_OF, A, TEXT)], firmware)
    assert run.went_on
    assert run.number(A) == 0


@both
def test_as_many_elements_as_characters_are_needed_for_a_text_in_an_array_of_wider_ones(firmware):
    run = Run([instruction(TO_TEXT, WORDS, B), instruction(SIZE_OF, A, WORDS)], firmware)
    assert run.number(A) == 3


@pytest.mark.parametrize(("firmware", "first"), [("1.05", ord("1")), ("1.29", 0x22)])
def test_the_offset_that_the_table_gives_an_element_counts_in_1_05_when_an_array_is_filled(firmware, first):
    code = [instruction(FILL, TEXT, B, TWO)]
    at = int.from_bytes(Run([], firmware).bytes(2, 4 * 4 + 4 * 4 + 2 * 4 + 10), "little")
    assert Run(code, firmware, element_at=4).bytes(1, at)[0] == first


@both
@pytest.mark.parametrize("element_at", [0, 4, 200])
def test_the_offset_that_the_table_gives_an_element_does_not_count_when_an_array_is_flattened(firmware, element_at):
    code = [instruction(FLATTEN, OTHER, TEXT), instruction(TO_NUMBER, A, TWO, OTHER, NONE, NONE)]
    assert Run(code, firmware, element_at=element_at).number(A) == 12345


@both
@pytest.mark.parametrize("right", [TEXT, CLUSTER])
@pytest.mark.parametrize(("flags", "holds"), [(LESS, False), (GREATER, True), (LESS_OR_EQUAL, False), (EQUAL, False)])
def test_an_array_or_cluster_on_the_right_of_a_number_is_compared_as_0(firmware, right, flags, holds):
    run = Run([instruction(BRANCH, 7, A, right, flags=flags), instruction(SET, A, 0x99)], firmware)
    assert run.number(A) == (0x11 if holds else 0x99)


@pytest.mark.parametrize(
    ("firmware", "flags", "status"),
    [("1.05", EQUAL, RUNNING), ("1.05", LESS_OR_EQUAL, RUNNING), ("1.05", LESS, FAILED), ("1.29", EQUAL, FAILED)],
)
@pytest.mark.parametrize(("left", "right"), [(TEXT, A), (TEXT, CLUSTER), (CLUSTER, TEXT), (CLUSTER, A)])
def test_firmware_1_05_takes_what_cannot_be_compared_for_equal_where_it_jumps(firmware, flags, status, left, right):
    assert Run([instruction(BRANCH, 4, left, right, flags=flags)], firmware).status == status


@both
def test_a_comparison_that_fails_has_stored_that_both_are_equal(firmware):
    run = Run([instruction(COMPARE, A, TEXT, CLUSTER, flags=EQUAL)], firmware)
    assert (run.status, run.number(A)) == (FAILED, 1)


@both
@pytest.mark.parametrize(
    ("argument", "status"), [(A, RUNNING), (TEXT + 1, RUNNING), (TEXT, RUNNING), (OTHER, FAILED), (0x1BA4, FAILED)]
)
@pytest.mark.parametrize("call", [13, 17, 24, 26, 32])
def test_a_system_call_fails_if_the_table_tells_more_than_16_arguments(firmware, argument, status, call):
    """The offset of a number counts as a number of arguments: those of `TEXT` and `OTHER` are 16 and 20."""
    assert Run([instruction(SYSTEM_CALL, call, argument)], firmware).status == status


@pytest.mark.parametrize("field", [0x4002, 0x8002, 0xC002])
def test_only_firmware_1_05_has_arguments_that_are_fields_of_ports(field):
    """Field 2 of input 1 is the raw value. In 1.29 it is an entry of the table, which is behind the flash memory."""
    assert Run([instruction(ADD, A, B, field)], "1.05").number(A) == 0x22 + 1023
    if field >= 0x8000:
        assert Run([instruction(ADD, A, B, field)], "1.29").number(A) == 0x22 + 0x11


@pytest.mark.parametrize("field", [0x4202, 0x8202, 0xC202])
def test_firmware_1_05_stores_the_size_of_an_array_in_a_field_of_a_port(field):
    """Field 2 of output A is the power. By the rule of section 8.1; not compared with the answer of LEGO's."""
    assert Run([instruction(SIZE_OF, field, TEXT), instruction(ADD, A, B, field)], "1.05").number(A) == 0x22 + 6


@both
def test_a_mutex_that_is_not_in_the_table_is_in_the_first_bytes_of_the_variables(firmware):
    assert Run([instruction(ACQUIRE, 0x1000)], firmware).status == ENDED


def test_a_condition_beyond_the_table_does_not_end_a_program_of_firmware_1_05():
    assert Run([instruction(STOP, 0x1000)], "1.05").went_on
    assert Run([instruction(STOP, NONE)], "1.05").status == ENDED


@pytest.mark.parametrize("opcode", [0x16, 0x18, 0x19, 0x1E, 0x20, 0x21, 0x22, 0x31])
def test_an_instruction_of_no_size_goes_on_forever_in_firmware_1_05(opcode):
    """Those with a fixed number of arguments are errors."""
    run = Run([[opcode, 6, B, TWO, TEXT]], "1.05")
    assert (run.status, run.number(MARK)) == (RUNNING, 0x44)
    assert Run([[ADD, 6, B, TWO, TEXT]], "1.05").status == FAILED


def test_firmware_1_05_reads_the_arguments_that_a_conversion_lacks_from_what_follows():
    assert Run([[0xA000 | TO_NUMBER, A, B, TEXT, TWO]], "1.05").went_on


def test_the_short_form_of_an_instruction_may_have_half_a_word_in_firmware_1_29():
    assert Run([[0x5801, B]], "1.29").number(TWO) == 0x22
    assert Run([[0x5801, B]], "1.05").status == FAILED


def test_waiting_stores_when_it_began():
    run = Run([instruction(TICK, A), instruction(WAIT, B, TWO)], "1.29")
    assert run.number(B) == run.number(A)


def test_a_clump_that_waits_at_its_end_runs_one_more_instruction():
    """The first clump continues where the second one begins."""
    table = Variables()
    for value in (0x11, 0x22, 2, 0x44):
        table.number(value)
    content = assemble(table, [instruction(WAIT, NONE, TWO)], [instruction(SET, B, 0x33), SPIN], fire=[0, 1])
    brick = SimBrick(firmware="1.29")
    store(brick, "a.rxe", content)
    brick.receive(StartProgram("a.rxe").encode())
    brick.tick(20)
    assert brick.command.pool[56 + 4] == 0x33


def test_a_negation_of_two_values_gives_0_in_firmware_1_29():
    run = Run([instruction(NEGATE, A, B, TWO)], "1.29")
    assert run.went_on
    assert run.number(A) == 0
    assert Run([instruction(NEGATE, A, B, TWO)], "1.05").status == FAILED


@pytest.mark.parametrize(("asked", "later"), [(46, 0), (47, 1)])
def test_the_time_may_change_within_a_pass_of_firmware_1_05(asked, later):
    """A pass takes 49 turns; asking for the time counts as one, and so do twenty instructions."""
    table = Variables()
    first, last = table.number(), table.number()
    content = assemble(table, [instruction(TICK, first), *[instruction(TICK, last)] * (asked - 1), SPIN], fire=[0])
    brick = SimBrick(firmware="1.05")
    store(brick, "a.rxe", content)
    brick.receive(StartProgram("a.rxe").encode())
    brick.tick(20)
    begun, ended = (int.from_bytes(brick.command.pool[20 + at : 24 + at], "little") for at in (0, 4))
    assert ended - begun == later
