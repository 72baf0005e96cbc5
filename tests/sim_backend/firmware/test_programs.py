"""Programs on the simulated brick: beyond the recorded conversations with their two instructions."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol import direct, system
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState, SensorMode, SensorType
from firmware_protocol.iomap import COMMAND, SOUND, UI, ProgramStatus, SoundState, UiFlag
from firmware_protocol.status import Status
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.devices import AnalogInput
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.firmware.vm.data import NONE
from sim_backend.firmware.vm.rxe import BadProgram, Type, parse
from tests.sim_backend.firmware.asking import ask, status_of

ADD, SUB, MUL, DIV, MOV, SET, INDEX, REPLACE, SIZE = 0x00, 0x01, 0x03, 0x04, 0x1B, 0x1C, 0x15, 0x16, 0x17
JMP, BRCMP, SYSCALL, STOP, FINISH, ACQUIRE, RELEASE, CALL, RETURN = 0x25, 0x26, 0x28, 0x29, 0x2A, 0x2C, 0x2D, 0x2E, 0x2F
SETIN, SETOUT, GETIN, WAIT, TICK, TEXT, JOIN = 0x30, 0x31, 0x32, 0x34, 0x35, 0x1F, 0x21
LT, EQ = 0, 4
MESSAGE_WRITE, MESSAGE_READ, PLAY_TONE, DATALOG_WRITE = 26, 27, 10, 44
FOREVER = [0x4025, 0]
READY_MS = 8


def started(content, name="test.rxe", brick=None):
    brick = brick or SimBrick()
    store(brick, name, content)
    assert status_of(brick, direct.StartProgram(name)) == Status.OK
    brick.tick(READY_MS)
    return brick


def field(brick, io_map, name):
    spot = io_map.field(name)
    return spot.decode(ask(brick, spot.read())[1].data)


def program_status(brick):
    return ProgramStatus(field(brick, COMMAND, "ProgStatus"))


def message(brick, box):
    status, found = ask(brick, direct.MessageRead(box, 0, True))
    return found.data[: found.size] if status == Status.OK else status


def send_number(variables, box, source):
    """Instructions that put a number into a mailbox as text."""
    cluster, (_, _, content) = variables.call(0, box, b"\0")
    return [instruction(TEXT, content, source), instruction(SYSCALL, MESSAGE_WRITE, cluster)]


def test_a_program_calculates_branches_and_sends_messages():
    variables = Variables()
    total, count, one, limit = (variables.number(value) for value in (0, 0, 1, 10))
    brick = started(
        assemble(
            variables,
            [
                instruction(ADD, count, count, one),
                instruction(ADD, total, total, count),
                instruction(BRCMP, -8, count, limit, flags=LT),
                *send_number(variables, 12, total),
                FOREVER,
            ],
        )
    )
    brick.tick(20)
    assert message(brick, 12) == b"55\0"
    assert program_status(brick) == ProgramStatus.RUNNING


@pytest.mark.parametrize(
    ("opcode", "left", "right", "result"),
    [(ADD, 7, -9, b"-2"), (SUB, 7, 9, b"-2"), (MUL, -3, 4, b"-12"), (DIV, -7, 2, b"-3"), (DIV, 7, 0, b"0")],
)
def test_arithmetic_is_that_of_c(opcode, left, right, result):
    variables = Variables()
    a, b, c = variables.number(left), variables.number(right), variables.number()
    brick = started(assemble(variables, [instruction(opcode, c, a, b), *send_number(variables, 10, c), FOREVER]))
    brick.tick(5)
    assert message(brick, 10) == result + b"\0"


def test_numbers_keep_to_their_types():
    variables = Variables()
    byte, number = variables.number(kind=Type.UBYTE), variables.number()
    variables.table[byte] = (Type.UBYTE, 1, variables.table[byte][2])
    lines = [
        instruction(SET, byte, 0x1FF),
        instruction(MOV, number, byte),
        *send_number(variables, 10, number),
        FOREVER,
    ]
    brick = started(assemble(variables, lines))
    brick.tick(5)
    assert message(brick, 10) == b"255\0"


def test_texts_are_joined_and_read_from_mailboxes():
    variables = Variables()
    answer, (_, _, content) = variables.call(0, 11, b"\0")
    question, (read_status, _, _, heard) = variables.call(0, 1, 1, b"\0")
    empty, greeting = variables.number(0), variables.text(b"hello \0")
    lines = [
        instruction(SYSCALL, MESSAGE_READ, question),
        instruction(BRCMP, -3, read_status, empty, flags=5),
        instruction(JOIN, content, greeting, heard),
        instruction(SYSCALL, MESSAGE_WRITE, answer),
        FOREVER,
    ]
    brick = started(assemble(variables, lines))
    assert status_of(brick, direct.MessageWrite(1, 6, b"world\0")) == Status.OK
    brick.tick(5)
    assert message(brick, 11) == b"hello world\0"


def test_clumps_wait_for_each_other_and_take_turns_with_a_mutex():
    variables = Variables()
    mutex, nap, value = variables.number(-1, Type.MUTEX), variables.number(50), variables.number(3)
    first = [
        instruction(ACQUIRE, mutex),
        instruction(WAIT, NONE, nap),
        instruction(ADD, value, value, value),
        instruction(RELEASE, mutex),
        instruction(FINISH, 0, 0),
    ]
    second = [
        instruction(ACQUIRE, mutex),
        instruction(MUL, value, value, value),
        instruction(RELEASE, mutex),
        instruction(FINISH, 0, 0),
    ]
    last = [*send_number(variables, 10, value), FOREVER]
    brick = started(assemble(variables, first, second, last, fire=(0, 0, 2), dependents=([2], [2], [])))
    brick.tick(40)
    assert message(brick, 10) == Status.MAILBOX_EMPTY
    brick.tick(30)
    assert message(brick, 10) == b"36\0"


def test_a_subroutine_returns_to_its_caller():
    variables = Variables()
    caller, value, two = variables.number(), variables.number(5), variables.number(2)
    main = [instruction(CALL, 1, caller), instruction(CALL, 1, caller), *send_number(variables, 10, value), FOREVER]
    double = [instruction(MUL, value, value, two), instruction(RETURN, caller)]
    brick = started(assemble(variables, main, double, fire=(0, 9)))
    brick.tick(20)
    assert message(brick, 10) == b"20\0"


def test_a_program_drives_motors_and_reads_sensors():
    variables = Variables()
    port, power, mode, run, flags = (variables.number(value) for value in (1, 60, 1, 0x20, 0x07))
    kind, reading = variables.number(1), variables.number()
    lines = [
        instruction(SETOUT, port, 2, power, 1, mode, 6, run, 0, flags),
        instruction(SETIN, kind, port, 0),
        instruction(WAIT, NONE, power),
        instruction(GETIN, reading, port, 2),
        *send_number(variables, 10, reading),
        FOREVER,
    ]
    brick = SimBrick()
    brick.attach_motor("B", BenchMotor())
    brick.attach_sensor(2, AnalogInput(lambda: 321))
    started(assemble(variables, lines), brick=brick)
    brick.tick(100)
    assert ask(brick, direct.GetOutputState(OutputPort.B))[1].tacho_count > 10
    assert message(brick, 10) == b"321\0"


def test_short_instructions_are_understood():
    variables = Variables()
    source, target = variables.number(77), variables.number()
    short_move = [0x4800 | target - source & 0xFF, source]  # target relative to source
    brick = started(assemble(variables, [short_move, *send_number(variables, 10, target), FOREVER]))
    brick.tick(5)
    assert message(brick, 10) == b"77\0"


@pytest.mark.parametrize(
    "lines", [[[0x20F0]], [instruction(SYSCALL, 999, 0)], [[0x4025, 500]], [instruction(ADD, 0, 1, 200)]]
)
def test_a_program_that_does_the_impossible_ends_with_an_error(lines):
    variables = Variables()
    variables.number(), variables.number(), variables.call(0)
    brick = started(assemble(variables, lines))
    brick.tick(5)
    assert program_status(brick) == ProgramStatus.ERROR
    brick.tick(800)
    assert program_status(brick) == ProgramStatus.IDLE


def test_the_end_of_the_last_clump_is_the_end_of_the_program():
    brick = started(assemble(Variables(), [instruction(FINISH, 0, NONE)]))
    brick.tick(3)
    assert program_status(brick) == ProgramStatus.OK
    assert status_of(brick, direct.GetCurrentProgramName()) == Status.NO_ACTIVE_PROGRAM


def test_variables_can_be_watched_and_changed_through_the_map():
    variables = Variables()
    variables.number(0x11223344)
    brick = started(assemble(variables, [FOREVER]))
    at = field(brick, COMMAND, "OffsetDS")
    _, found = ask(brick, system.IOMapRead(COMMAND.module_id, at, 4))
    assert found.data == bytes.fromhex("44332211")
    assert status_of(brick, system.IOMapWrite(COMMAND.module_id, at, 2, b"\xaa\xbb")) == Status.OK
    assert ask(brick, system.IOMapRead(COMMAND.module_id, at, 4))[1].data == bytes.fromhex("aabb2211")
    brick.receive(direct.StopProgram().encode())
    brick.tick(3)
    assert field(brick, COMMAND, "OffsetDS") == at


LOOP = assemble(Variables(), [FOREVER])


@pytest.mark.slow
@settings(deadline=None, max_examples=300)
@given(st.data())
def test_no_file_disturbs_the_brick(data):
    """Damaged programs end or run; the brick goes on in any case."""
    variables = Variables()
    a, b = variables.number(1), variables.number(2)
    content = bytearray(assemble(variables, [instruction(ADD, a, a, b), *send_number(variables, 3, a), FOREVER]))
    for _ in range(data.draw(st.integers(1, 6))):
        content[data.draw(st.integers(14, len(content) - 1))] = data.draw(st.integers(0, 255))
    brick = started(bytes(content[: data.draw(st.integers(1, len(content)))]))
    brick.tick(50)
    brick.receive(direct.MessageWrite(3, 2, b"x\0").encode())
    brick.receive(direct.MessageRead(3, 0, True).encode())
    brick.receive(direct.StopProgram().encode())
    brick.tick(2000)
    assert status_of(brick, direct.GetCurrentProgramName()) == Status.NO_ACTIVE_PROGRAM
    assert brick.loader.delete("test.rxe") == Status.OK


@given(st.binary(max_size=200))
def test_no_bytes_are_taken_for_a_program(content):
    with pytest.raises(BadProgram):
        parse(content)


@pytest.mark.parametrize("steps", [(1, 2000), (7, 300, 3)])
def test_waiting_at_once_is_waiting_step_by_step_while_a_program_runs(steps):
    variables = Variables()
    now, nap, count, one = variables.number(), variables.number(30), variables.number(), variables.number(1)
    lines = [
        instruction(TICK, now),
        instruction(ADD, count, count, one),
        instruction(WAIT, NONE, nap),
        *send_number(variables, 10, count),
        instruction(JMP, -15),
    ]
    content = assemble(variables, lines)
    hasty, patient = started(content), started(content)
    for passes in steps:
        hasty.tick(passes)
        for _ in range(passes):
            patient.tick()
        assert hasty.command.pool == patient.command.pool
        assert hasty.command.status == patient.command.status


def test_a_program_that_only_waits_costs_no_passes():
    variables = Variables()
    nap = variables.number(10_000)
    for content in (LOOP, assemble(variables, [instruction(WAIT, NONE, nap), FOREVER])):
        brick = started(content)
        brick.tick(5)
        assert brick.command.due_ms - brick.now_ms > 9_000


def test_a_program_keeps_its_file_open_when_the_cable_goes():
    brick = started(LOOP)
    brick.unplug_usb()
    assert status_of(brick, system.Delete("test.rxe")) == Status.FILE_IS_BUSY


def test_a_program_needs_a_free_handle():
    brick = SimBrick()
    store(brick, "test.rxe", LOOP)
    for _ in range(15):
        assert brick.loader.open_read("test.rxe").status == Status.OK
    assert status_of(brick, direct.StartProgram("test.rxe")) == Status.OK
    brick.loader.open_read("test.rxe")
    brick.tick(READY_MS)
    assert program_status(brick) == ProgramStatus.ERROR
    brick.tick(800)  # the end of the program stops the sound, which closes handle 0
    assert status_of(brick, direct.StartProgram("test.rxe")) == Status.OK


def test_the_exit_button_stops_a_program_and_skips_the_message():
    brick = started(LOOP)
    brick.button.hold(1)
    brick.tick(2)
    assert program_status(brick) == ProgramStatus.ABORTED
    brick.tick(5)
    assert program_status(brick) == ProgramStatus.IDLE
    assert field(brick, UI, "State") == 7


def test_the_exit_button_of_the_map_does_not_stop_a_program():
    brick = started(LOOP)
    ask(brick, UI.field("Button").write(4))
    brick.tick(20)
    assert program_status(brick) == ProgramStatus.RUNNING


def test_a_request_made_while_a_program_is_being_opened_is_lost():
    brick = SimBrick()
    store(brick, "one.rxe", LOOP)
    store(brick, "two.rxe", LOOP)
    ask(brick, direct.StartProgram("one.rxe"))
    ask(brick, direct.StartProgram("two.rxe"))
    brick.tick(20)
    assert status_of(brick, direct.StopProgram()) == Status.OK
    brick.tick(3000)
    assert status_of(brick, direct.GetCurrentProgramName()) == Status.NO_ACTIVE_PROGRAM
    assert not field(brick, UI, "Flags") & (UiFlag.BUSY | UiFlag.EXECUTE_FILE)


def test_a_program_can_be_started_through_the_map_of_the_user_interface():
    brick = SimBrick()
    store(brick, "test.rxe", LOOP)
    ask(brick, UI.field("LMSfilename").write("test.rxe"))
    ask(brick, UI.field("Flags").write(UiFlag.ENABLE_STATUS | UiFlag.EXECUTE_FILE))
    brick.tick(READY_MS)
    assert ask(brick, direct.GetCurrentProgramName())[1].name == "test.rxe"


def test_a_program_starts_when_the_battery_popup_is_closed():
    brick = SimBrick()
    store(brick, "test.rxe", LOOP)
    brick.set_battery(430)
    brick.tick(1200)
    assert field(brick, UI, "Flags") & UiFlag.BUSY
    ask(brick, direct.StartProgram("test.rxe"))
    brick.tick(3000)
    assert status_of(brick, direct.GetCurrentProgramName()) == Status.NO_ACTIVE_PROGRAM
    brick.button.hold(2)
    brick.tick(12)
    assert program_status(brick) == ProgramStatus.RUNNING


def test_a_new_program_has_empty_mailboxes():
    brick = started(LOOP)
    ask(brick, direct.MessageWrite(0, 2, b"x\0"))
    ask(brick, direct.StopProgram())
    brick.tick(1000)
    ask(brick, direct.StartProgram("test.rxe"))
    brick.tick(READY_MS)
    assert message(brick, 0) == Status.MAILBOX_EMPTY


def test_the_memory_of_messages_is_given_back():
    brick = started(LOOP)
    for round_number in range(3000):
        assert status_of(brick, direct.MessageWrite(round_number % 20, 59, bytes(59))) == Status.OK
        assert message(brick, round_number % 20) == bytes(59)


@pytest.mark.parametrize("firmware", ["1.29", "1.05"])
def test_all_mailboxes_hold_five_of_the_longest_messages(firmware):
    brick = started(LOOP, brick=SimBrick(firmware=firmware))
    for box in range(20):
        for number in range(6):
            assert status_of(brick, direct.MessageWrite(box, 59, bytes([number]) * 58 + b"\0")) == Status.OK
    for box in range(20):
        assert [message(brick, box)[0] for _ in range(5)] == [1, 2, 3, 4, 5]
        assert message(brick, box) == Status.MAILBOX_EMPTY


def test_a_program_plays_a_tone():
    variables = Variables()
    cluster, _ = variables.call(0, 440, 100, 0, 2)
    brick = started(assemble(variables, [instruction(SYSCALL, PLAY_TONE, cluster), FOREVER]))
    brick.tick(3)
    assert field(brick, SOUND, "State") == SoundState.TONE
    assert brick.sound.tone == (440, 100, 2)


def test_start_and_stop_let_go_of_motors_and_sensors():
    brick = SimBrick()
    brick.attach_motor("A", BenchMotor())
    move = direct.SetOutputState(OutputPort.A, 50, OutputMode.MOTOR_ON, RegulationMode.IDLE, 0, RunState.RUNNING, 0)
    started(LOOP, brick=brick)
    ask(brick, move)
    ask(brick, direct.SetInputMode(2, SensorType.SWITCH, SensorMode.BOOLEAN))
    brick.tick(100)
    ask(brick, direct.StopProgram())
    brick.tick(100)
    _, state = ask(brick, direct.GetOutputState(OutputPort.A))
    assert (state.power, state.run_state, state.tacho_limit) == (0, RunState.IDLE, 0)
    assert brick.output.controls[0].actual_speed == 0
    assert ask(brick, direct.GetInputValues(2))[1].type == SensorType.NONE


def test_datalog_is_empty_while_a_program_runs():
    brick = started(LOOP)
    status, record = ask(brick, direct.DatalogRead(True))
    assert (status, record.size) == (Status.MAILBOX_EMPTY, 0)


def test_a_program_writes_the_data_log_which_keeps_thirty_records():
    variables = Variables()
    cluster, (_, text) = variables.call(0, b"x\0")
    count, one, most, first = (variables.number(value) for value in (0, 1, 32, 0))
    lines = [
        instruction(REPLACE, text, text, first, count),
        instruction(SYSCALL, DATALOG_WRITE, cluster),
        instruction(ADD, count, count, one),
        instruction(BRCMP, -12, count, most, flags=LT),
        FOREVER,
    ]
    brick = started(assemble(variables, lines))
    brick.tick(10)
    assert ask(brick, direct.DatalogRead(False))[1].data[:2] == b"\2\0"
    records = [ask(brick, direct.DatalogRead(True))[1].data[0] for _ in range(30)]
    assert records == list(range(2, 32))
    assert ask(brick, direct.DatalogRead(True))[0] == Status.MAILBOX_EMPTY
