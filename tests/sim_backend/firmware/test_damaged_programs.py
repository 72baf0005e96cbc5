"""What the firmware does with damaged programs, each answer as LEGO's gave it.

Source: docs/firmware.md sections 8.1 to 8.4.
"""

import struct

import pytest

from firmware_protocol.direct import StartProgram
from firmware_protocol.iomap import COMMAND
from firmware_protocol.system import IOMapRead
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.rxe import Type

ADD, FILL, COMPARE, TEST, MOVE, SET, JUMP, BRANCH, BRANCH_TEST, SET_OUTPUT = (
    0,
    0x1A,
    0x11,
    0x12,
    0x1B,
    0x1C,
    0x25,
    0x26,
    0x27,
    0x31,
)
SIZE_OF, BUILD, SYSTEM_CALL, STOP, FINISH, FINISH_INTO, CALL, RETURN = 0x17, 0x18, 0x28, 0x29, 0x2A, 0x2B, 0x2E, 0x2F
RUNNING, ENDED, FAILED = 2, 1, 3
NONE = 0xFFFF
SPIN = instruction(JUMP, 0)
TABLE_AT, ENTRY = 38, 4


class Outcome:
    """A program that has run for some milliseconds: status and four numbers, which begin as 11, 22, 33 and 44 (hex)."""

    def __init__(self, content, firmware="1.29", clumps=1):
        brick = SimBrick(firmware=firmware)
        store(brick, "a.rxe", content)
        brick.receive(StartProgram("a.rxe").encode())
        brick.tick(20)
        self.status = _read(brick, "ProgStatus")[0]
        self.offsets = struct.unpack("<HH", _read(brick, "OffsetDS") + _read(brick, "OffsetDVA"))
        base = -(-{"1.29": 28, "1.05": 20, "1.32": 48}[firmware] * clumps // 4) * 4
        self.numbers = struct.unpack_from("<4I", brick.command.pool, base)


def _read(brick, name):
    return IOMapRead.decode_reply(brick.receive(COMMAND.field(name).read().encode())).data


def program(*clumps, texts=0, **options):
    """A program with four numbers."""
    variables = Variables()
    for value in (0x11, 0x22, 0x33, 0x44):
        variables.number(value)
    for _ in range(texts):
        variables.text(b"abc\0")
    return assemble(variables, *clumps, **options)


def changed(content, at, layout, *values):
    """The file with some bytes replaced."""
    return content[:at] + struct.pack(layout, *values) + content[at + struct.calcsize(layout) :]


def header(content, number):
    """A number of the header; they begin with the count of variables."""
    return struct.unpack_from("<11H", content, 16)[number]


def descriptor(content, number, field):
    """Where a field of an array's descriptor is in the file."""
    return TABLE_AT + ENTRY * header(content, 0) + header(content, 4) + 10 * number + 2 * field


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
@pytest.mark.parametrize("flags", [6, 7])
def test_the_comparisons_that_do_not_exist_never_hold(firmware, flags):
    code = [
        instruction(COMPARE, 0, 1, 1, flags=flags),
        instruction(TEST, 2, 1, flags=flags),
        instruction(BRANCH, 7, 1, 1, flags=flags),
        instruction(BRANCH_TEST, 3, 1, flags=flags),
        instruction(SET, 3, 0x77),
        SPIN,
    ]
    outcome = Outcome(program(code), firmware)
    assert (outcome.status, *outcome.numbers) == (RUNNING, 0, 0x22, 0, 0x77)


@pytest.mark.parametrize(
    ("port", "field", "status"),
    [(0, 44, RUNNING), (0, 45, FAILED), (0, 0xFFFF, FAILED), (2, 14, RUNNING), (2, 15, FAILED), (3, 45, RUNNING)],
)
def test_a_field_beyond_those_of_the_last_port_is_an_error_of_setting_an_output(port, field, status):
    code = [instruction(SET, 0, port), instruction(SET_OUTPUT, 0, field, 1), SPIN]
    assert Outcome(program(code)).status == status


@pytest.mark.parametrize(
    ("firmware", "size", "numbers"), [("1.29", 6, (0x11, 0x22, 0x22, 0x77)), ("1.05", 6, (0x11, 0x22, 0x33, 0x44))]
)
def test_the_short_form_of_a_move_has_two_words_whatever_its_size_says(firmware, size, numbers):
    outcome = Outcome(program([[size << 12 | 0x801, 1], instruction(SET, 3, 0x77), SPIN]), firmware)
    assert outcome.numbers == numbers
    assert outcome.status == (RUNNING if firmware == "1.29" else FAILED)


@pytest.mark.parametrize(
    ("firmware", "start", "numbers"),
    [
        ("1.29", 0, (0x71, 0x22)),
        ("1.29", 3, (0x71, 0x22)),
        ("1.29", 6, (0x71, 0x72)),
        ("1.05", 0, (0x71, 0x22)),
        ("1.05", 3, (0x71, 0x72)),
    ],
)
def test_the_end_of_a_clump_is_checked_after_each_instruction(firmware, start, numbers):
    """1.05 also runs the instruction directly behind the end."""
    code = [instruction(SET, 0, 0x71), instruction(SET, 1, 0x72), instruction(SET, 2, 0x73), SPIN]
    content = program(code, [SPIN], fire=[0, 1])
    records = len(content) - 2 * header(content, 10) - 2 * 4
    outcome = Outcome(changed(content, records + 6, "<H", start), firmware, clumps=2)
    assert outcome.numbers[:2] == numbers
    assert outcome.status == FAILED


@pytest.mark.parametrize("number", [10, 11, 20, 255])
@pytest.mark.parametrize(("firmware", "status"), [("1.05", RUNNING), ("1.29", FAILED)])
def test_firmware_1_05_does_not_check_types(firmware, status, number):
    """What it does not know has no value, and reads as 0; later firmwares know floats and refuse the rest."""
    content = program([instruction(MOVE, 1, 0), instruction(SET, 0, 5), SPIN])
    first_zero = changed(content, TABLE_AT, "<BB", number, 1)
    shorter = changed(first_zero, 16 + 2 * 3, "<2H", header(content, 3) - 4, header(content, 4) - 4)
    at = TABLE_AT + ENTRY * header(content, 0)
    outcome = Outcome(shorter[:at] + shorter[at + 4 :], firmware)
    if number == Type.FLOAT and firmware == "1.29":
        assert outcome.status == RUNNING
    else:
        assert outcome.status == status
        assert outcome.numbers[:2] == ((0xDEADBEEF, 0) if firmware == "1.05" else (0xDEADBEEF, 0xDEADBEEF))


def test_a_variable_without_a_type_is_a_byte_without_a_first_value():
    content = program([instruction(MOVE, 1, 0), instruction(SET, 0, 0x1234), SPIN])
    void = changed(content, TABLE_AT, "<BB", 0, 1)
    shorter = changed(void, 16 + 2 * 3, "<2H", header(content, 3) - 4, header(content, 4) - 4)
    at = TABLE_AT + ENTRY * header(content, 0)
    assert Outcome(shorter[:at] + shorter[at + 4 :]).numbers[:2] == (0xDEADBE34, 0xEF)


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
def test_a_mutex_is_not_a_number(firmware):
    variables = Variables()
    for value in (0x11, 0x22):
        variables.number(value)
    variables.number(0x33, Type.MUTEX)
    variables.number(0x44)
    code = [instruction(ADD, 1, 2, 0), instruction(SET, 2, 5), SPIN]
    if firmware == "1.05":  # 1.29 crashes
        assert Outcome(assemble(variables, code), firmware).numbers == (0x11, 0x11, 0x33, 0x44)


@pytest.mark.parametrize(
    ("damage", "variables", "descriptors"),
    [
        ("nothing", 80, 124),
        ("too short", 65535, 65535),
        ("no memory", 80, 100),
        ("no clump starts", 80, 100),
        ("unknown type", 80, 100),
        ("wrong tail", 80, 124),
    ],
)
def test_the_map_shows_the_offsets_in_itself_of_what_was_loaded_before_the_damage_was_found(
    damage, variables, descriptors
):
    content = program([SPIN], texts=1)
    records = len(content) - 2 * header(content, 10) - 4
    content = {
        "nothing": content,
        "too short": content[:-1],
        "no memory": changed(content, 16 + 2, "<H", 0),
        "no clump starts": changed(content, records, "<B", 1),
        "unknown type": changed(content, TABLE_AT, "<B", 11),
        "wrong tail": changed(content, 16 + 2 * 7, "<H", 0),
    }[damage]
    outcome = Outcome(content)
    assert outcome.offsets == (variables, descriptors)
    assert outcome.status == (RUNNING if damage == "nothing" else FAILED)


@pytest.mark.parametrize(
    ("arrays", "element", "status"),
    [(1, 8, RUNNING), (1, 11, RUNNING), (4, 9, FAILED), (8, 9, FAILED), (8, 11, RUNNING)],
)
def test_the_descriptors_grow_by_the_element_size_that_the_program_gives_them(arrays, element, status):
    """If it is too small, the last one is not copied as a whole, and no longer linked backwards."""
    content = program([SPIN], texts=arrays)
    assert Outcome(changed(content, descriptor(content, 0, 1), "<H", element)).status == status


def test_an_array_whose_element_is_beyond_the_file_is_an_error():
    content = program([SPIN])
    arrays = changed(content, TABLE_AT, "<BB", Type.ARRAY, 1)
    assert Outcome(changed(arrays, TABLE_AT + ENTRY, "<BBH", Type.CLUSTER, 1, 0xFFFF)).status == FAILED


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
@pytest.mark.parametrize(("opcode", "size"), [(SET, 7), (COMPARE, 9), (RETURN, 5), (BRANCH, 9)])
def test_an_instruction_of_half_a_word_is_an_error(firmware, opcode, size):
    assert Outcome(program([[size << 12 | opcode, 1, 2, 0], SPIN]), firmware).status == FAILED


def test_the_short_forms_that_do_not_exist_add_in_firmware_1_05():
    code = [[0x6C01, 1, 2], instruction(SET, 3, 0x77), SPIN]
    assert Outcome(program(code), "1.05").numbers == (0x11, 0x22, 0x55, 0x77)
    assert Outcome(program(code), "1.29").status == FAILED


@pytest.mark.parametrize(
    ("firmware", "numbers"), [("1.05", (0x71, 0x72, 0x73, 0x77)), ("1.29", (0x71, 0x22, 0x33, 0x44))]
)
def test_a_clump_that_ends_before_it_begins_has_no_end_in_firmware_1_05(firmware, numbers):
    code = [instruction(SET, number, value) for number, value in enumerate((0x71, 0x72, 0x73, 0x77))]
    content = program([instruction(FINISH_INTO, 1)], [*code, SPIN], [SPIN], fire=[0, 1, 1])
    records = len(content) - 2 * header(content, 10) - 3 * 4
    assert Outcome(changed(content, records + 8 + 2, "<H", 0), firmware, clumps=3).numbers == numbers


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
def test_a_call_without_a_variable_uses_the_first_byte_of_the_variables(firmware):
    """The caller's number, 0, is written there, and read by a return without a variable."""
    code = [instruction(CALL, 1, NONE), instruction(SET, 1, 0x72), SPIN]
    outcome = Outcome(program(code, [instruction(RETURN, NONE)], fire=[0, 1]), firmware, clumps=2)
    assert (outcome.status, *outcome.numbers[:2]) == (RUNNING, 0, 0x72)


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
def test_a_return_to_a_variable_beyond_the_table_continues_nothing(firmware):
    code = [instruction(CALL, 1, 0), SPIN]
    outcome = Outcome(program(code, [instruction(RETURN, 0x2763)], fire=[0, 1]), firmware, clumps=2)
    assert outcome.status == ENDED


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
@pytest.mark.parametrize(
    ("first", "last", "ran"), [(0, 2, (1, 1, 1)), (2, 3, (1, 0, 1)), (0xFFFF, 0, (0, 1, 0)), (0, 0xFFFF, (0, 0, 0))]
)
def test_dependents_in_front_of_or_behind_those_of_a_clump_are_fired(firmware, first, last, ran):
    """The lists follow each other: 2, 1; 3; 1; 2."""
    variables = Variables()
    counts, one = [variables.number() for _ in range(3)], variables.number(1)
    clumps = [[instruction(ADD, count, count, one), SPIN] for count in counts]
    finish = [instruction(FINISH, first, last)]
    content = assemble(variables, finish, *clumps, fire=[0, 1, 1, 1], dependents=[[2, 1], [3], [1], [2]])
    assert Outcome(content, firmware, clumps=4).numbers[:3] == ran


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
def test_a_clump_that_calls_itself_goes_on(firmware):
    code = [instruction(CALL, 0, 2), instruction(SET, 1, 0x72), SPIN]
    outcome = Outcome(program(code), firmware)
    assert (outcome.status, outcome.numbers[1]) == (RUNNING, 0x72)


@pytest.mark.parametrize(("kind", "firmware"), [(Type.MUTEX, "1.05"), (Type.MUTEX, "1.29"), (Type.SLONG, "1.29")])
def test_a_return_reads_the_first_byte_of_a_variable(kind, firmware):
    variables = Variables()
    for value in (0x11, 0x22, 0x33, 0x44):
        variables.number(value)
    number = variables.number(0x100, kind)
    code = [instruction(CALL, 1, 2), instruction(SET, 1, 0x72), SPIN]
    content = assemble(variables, code, [instruction(RETURN, number)], fire=[0, 1])
    outcome = Outcome(content, firmware, clumps=2)
    assert (outcome.status, outcome.numbers[1]) == (RUNNING, 0x72)


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
def test_sixteen_bits_of_the_size_of_an_array_count(firmware):
    variables = Variables()
    for value in (0x11, 0x22, 0x33, 20):
        variables.number(value)
    array = variables.array([1, 2], Type.SLONG)
    code = [instruction(FILL, array, 2, 3), instruction(SIZE_OF, 1, array), instruction(SET, 3, 0x77), SPIN]
    content = assemble(variables, code)
    outcome = Outcome(changed(content, descriptor(content, 1, 1), "<H", 0x4000), firmware)
    assert (outcome.status, *outcome.numbers[1:]) == (RUNNING, 20, 0x33, 0x77)


@pytest.mark.parametrize("firmware", ["1.05", "1.29"])
def test_a_system_call_without_its_arguments_goes_on(firmware):
    variables = Variables()
    for value in (0x11, 0x22, 0x33, 0x44):
        variables.number(value)
    variables.call()
    code = [instruction(SYSTEM_CALL, 24, 4), instruction(SET, 3, 0x77), SPIN]
    outcome = Outcome(assemble(variables, code), firmware)
    assert (outcome.status, outcome.numbers[3]) == (RUNNING, 0x77)


@pytest.mark.parametrize("count", [3, 0x6000, 0xC000, 0xFFFF])
def test_more_descriptors_than_there_are_make_a_program_fail(count):
    content = program([SPIN], texts=1)
    assert Outcome(changed(content, descriptor(content, 0, 2), "<H", count)).status == FAILED
