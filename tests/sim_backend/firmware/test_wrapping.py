"""Values that do not fit their fields wrap as in C; the replies were recorded from LEGO's firmware 1.29."""

import pytest

from firmware_protocol.direct import GetCurrentProgramName, GetInputValues, GetOutputState, StartProgram
from firmware_protocol.enums import InputPort, OutputPort
from firmware_protocol.iomap import COMM, COMMAND, INPUT, OUTPUT
from firmware_protocol.system import GetDeviceInfo, IOMapRead, IOMapWrite
from nxtdrive.tools.dev.faults.assembler import sample_program, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.simulation import Simulation

READ_OUTPUT = IOMapRead(OUTPUT.module_id, 0, 55).encode()
BACKWARD_IN_STEP = bytes.fromhex("8004ff9c030338205d000000")
RAMP_DOWN_FORWARD = bytes.fromhex("8004ff64eb004e4000000000")


@pytest.fixture
def brick():
    """A brick with motors."""
    made = SimBrick()
    for port in "ABC":
        made.attach_motor(port, BenchMotor())
    made.tick(10)
    return made


def write(brick, io_map, name, value, index=0):
    assert brick.receive(io_map.field(name, index).write(value).encode())[2] == 0


def read(brick, io_map, name, index=0):
    field = io_map.field(name, index)
    return field.decode(IOMapRead.decode_reply(brick.receive(field.read().encode())).data)


def test_a_raw_value_beyond_a_signed_word_is_sent_as_its_bits(brick):
    write(brick, INPUT, "SensorRaw", 0xFFFF)
    reply = brick.receive(GetInputValues(InputPort(0)).encode())
    assert reply.hex() == "02070000010000000000ffff0000ffff"


def test_a_speed_that_a_ramp_carries_beyond_a_byte_wraps(brick):
    brick.receive(BACKWARD_IN_STEP)
    brick.tick(10)
    brick.receive(RAMP_DOWN_FORWARD)
    brick.tick(101)
    assert brick.receive(READ_OUTPUT).hex() == (
        "029400010002003700fefffffffefffffffeffffff00000000000000eb64366020200000004e000000"
        "fefffffffefffffffeffffff00000000000000eb643660"
    )


@pytest.mark.parametrize("power", [-128, -101, 101, 127])
def test_any_speed_reaches_the_motors_of_a_world(power):
    simulation = Simulation("open")
    command = bytes.fromhex("8004ff") + power.to_bytes(1, "little", signed=True) + bytes.fromhex("030338205d000000")
    simulation.brick.receive(command)
    simulation.advance(10)
    simulation.brick.receive(RAMP_DOWN_FORWARD)
    for _ in range(100):
        simulation.advance(101)
        speeds = [output.control.actual_speed for output in simulation.brick.output.outputs]
        assert all(-128 <= speed <= 127 for speed in speeds)


def test_counts_beyond_a_long_wrap(brick):
    brick.output.outputs[0].control.rotation = 0x8000_0001
    reply = GetOutputState.decode_reply(brick.receive(GetOutputState(OutputPort.A).encode()))
    assert reply.rotation_count == -0x7FFF_FFFF
    assert read(brick, OUTPUT, "RotationCount") == -0x7FFF_FFFF


def test_a_name_without_a_closing_zero_is_cut(brick):
    field = COMM.field("BrickName")
    brick.receive(IOMapWrite.put(field.module_id, field.offset, b"ABCDEFGHIJKLMNOP").encode())
    assert GetDeviceInfo.decode_reply(brick.receive(GetDeviceInfo().encode())).name == "ABCDEFGHIJKLMNO"


def test_the_program_name_is_that_of_the_start_whatever_the_map_says(brick):
    content = sample_program()
    store(brick, "loop.rxe", content)
    brick.receive(StartProgram("loop.rxe").encode())
    brick.tick(50)
    field = COMMAND.field("FileName")
    brick.receive(IOMapWrite.put(field.module_id, field.offset, b"T" * 20).encode())
    reply = brick.receive(GetCurrentProgramName().encode())
    assert GetCurrentProgramName.decode_reply(reply).name == "loop.rxe"


def test_a_pending_flag_stays_and_keeps_the_run_state_as_written(brick):
    write(brick, OUTPUT, "Flags", 0xFF, 1)
    brick.tick(50)
    brick.receive(bytes.fromhex("8004010a60000010eff26b50"))
    brick.tick(10)
    values = [read(brick, OUTPUT, name, 1) for name in ("Flags", "RunState")]
    assert values == [0x80, 0x10]
