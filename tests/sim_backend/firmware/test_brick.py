"""What must hold for every simulated brick, whatever is sent to it and however long it waits."""

from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol import direct, system
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState, SensorMode, SensorType
from firmware_protocol.iomap import IO_MAPS
from firmware_protocol.telegram import COMMANDS
from nxtdrive.tools.dev.faults.memory import least_growth
from sim_backend.devices import AnalogInput, GenericI2CDevice, TouchSensor, UltrasonicSensor
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.comm.handler_result import DONE, handlers_of, handles
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.firmware.versions import FIRMWARES

TELEGRAMS = st.binary(max_size=70) | st.builds(
    lambda kind, opcode, rest: bytes([kind, opcode]) + rest,
    st.sampled_from([0x00, 0x01, 0x02, 0x80, 0x81]),
    st.integers(0, 0xFF),
    st.binary(max_size=62),
)


def equipped():
    brick = SimBrick()
    for port in "ABC":
        brick.attach_motor(port, BenchMotor())
    brick.attach_sensor(1, TouchSensor(lambda: True))
    brick.attach_sensor(2, AnalogInput(lambda: 500))
    brick.attach_sensor(3, GenericI2CDevice())
    brick.attach_sensor(4, UltrasonicSensor(lambda: 42))
    return brick


def ask(brick, command):
    reply = brick.receive(command.encode())
    brick.tick()
    return type(command).decode_reply(reply)


def everything(brick):
    """All that telegrams can see of a brick."""
    state = b""
    for module_id, io_map in IO_MAPS.items():
        for offset in range(0, min(io_map.size, 2000), 50):
            size = min(50, io_map.size - offset)
            state += brick.receive(system.IOMapRead(module_id, offset, size).encode())
    return state


def test_every_declared_command_is_handled():
    for firmware in FIRMWARES:
        brick = SimBrick(firmware=firmware)
        for telegram in COMMANDS:
            brick.receive(bytes(telegram))  # raises KeyError for a command without a handler


def test_a_command_has_one_handler():
    class Handler:
        @handles(direct.KeepAlive)
        def keep_alive(self, _):
            return DONE

    assert set(handlers_of(Handler())) == {direct.KeepAlive}
    with pytest.raises(TypeError, match="KeepAlive has two handlers"):
        handlers_of(Handler(), Handler())


@given(st.lists(TELEGRAMS, max_size=30))
def test_no_bytes_disturb_the_brick(telegrams):
    brick = equipped()
    for telegram in telegrams:
        reply = brick.receive(telegram)
        assert reply is None or (len(reply) <= 64 and reply[0] == 0x02)
        brick.tick()
    assert ask(brick, direct.GetBatteryLevel()).voltage_mv > 0
    assert brick.receive(direct.GetOutputState(OutputPort.B).encode())[:3] == b"\x02\x06\x00"


@pytest.mark.slow
@given(st.lists(st.binary(max_size=300), max_size=20))
def test_no_bytes_over_bluetooth_disturb_the_brick(telegrams):
    brick = equipped()
    for telegram in telegrams:
        brick.receive_bluetooth(len(telegram).to_bytes(2, "little") + telegram)
        brick.tick()
    assert brick.receive_bluetooth(b"\x02\x00\x01\x88") == b"\x07\x00\x02\x88\x00\x7c\x01\x1d\x01"


@pytest.mark.parametrize("size", [1, 122, 123, 0xFFFF])
def test_a_read_over_bluetooth_has_the_length_it_announces_while_the_file_lasts(size):
    brick = SimBrick()
    handle = brick.loader.create("big", 70_000).handle
    brick.loader.write(handle, bytes(70_000))
    brick.loader.close(handle)
    brick.loader.open_read("big")
    reply = brick.receive_bluetooth(b"\x05\x00" + system.Read(0, size).encode())
    assert int.from_bytes(reply[:2], "little") == len(reply) - 2 & 0xFFFF == size + 6 & 0xFFFF


@pytest.mark.slow
def test_no_bytes_make_the_brick_grow():
    random = Random(7)
    brick = equipped()

    def disturb(count):
        for _ in range(count):
            brick.receive(bytes([random.choice([0, 1, 2, 128, 129])]) + random.randbytes(random.randrange(64)))
            brick.tick()

    for kind, opcode in COMMANDS:  # each wire enum keeps a member for every number it has met, 256 at most
        for byte in range(256):
            brick.receive(bytes([kind, opcode]) + bytes([byte] * 62))
    left = least_growth([lambda: disturb(6000), lambda: disturb(3000), lambda: disturb(3000)])
    assert left < 3000  # less than a byte for each telegram


@pytest.mark.slow
@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(TELEGRAMS, st.integers(1, 700)), max_size=6))
def test_waiting_at_once_is_waiting_step_by_step(steps):
    hasty, patient = equipped(), equipped()
    for telegram, passes in steps:
        assert hasty.receive(telegram) == patient.receive(telegram)
        hasty.tick(passes)
        for _ in range(passes):
            patient.tick()
        assert everything(hasty) == everything(patient)


@pytest.mark.parametrize("firmware", ["1.28", "", "2.0"])
def test_an_unknown_firmware_is_refused(firmware):
    with pytest.raises(ValueError, match=r"1\.29, 1\.05"):
        SimBrick(firmware=firmware)


@pytest.mark.parametrize("identity", [{"name": "x" * 16}, {"address": bytes(5)}, {"address": bytes(7)}])
def test_a_name_or_address_of_another_size_is_refused(identity):
    with pytest.raises(ValueError, match="at most 15 characters and 6 bytes"):
        SimBrick(**identity)


@pytest.mark.parametrize("port", ["D", "a", "AB", ""])
def test_motors_fit_only_their_ports(port):
    with pytest.raises(ValueError, match="A, B, C"):
        SimBrick().attach_motor(port, BenchMotor())


@pytest.mark.parametrize("port", [0, 5, -1])
def test_sensors_fit_only_their_ports(port):
    with pytest.raises(ValueError, match="1 to 4"):
        SimBrick().attach_sensor(port, TouchSensor(lambda: True))


def test_name_and_address_are_those_given():
    info = ask(SimBrick(name="Rover", address=bytes.fromhex("001653aabbcc")), system.GetDeviceInfo())
    assert (info.name, info.address) == ("Rover", bytes.fromhex("001653aabbcc00"))


def test_a_telegram_takes_effect_in_the_pass_that_follows_it():
    brick = equipped()
    command = direct.SetOutputState(OutputPort.A, 75, OutputMode.MOTOR_ON, RegulationMode.IDLE, 0, RunState.RUNNING, 0)
    brick.receive(command.encode())
    assert brick.output.controls[0].actual_speed == 0
    brick.tick()
    assert brick.output.controls[0].actual_speed == 75


def test_motors_without_a_plant_do_not_turn():
    brick = SimBrick()
    command = direct.SetOutputState(
        OutputPort.ALL,
        75,
        OutputMode.MOTOR_ON | OutputMode.REGULATED,
        RegulationMode.SPEED,
        0,
        RunState.RUNNING,
        0,
    )
    brick.receive(command.encode())
    brick.tick(1000)
    assert ask(brick, direct.GetOutputState(OutputPort.C)).rotation_count == 0


@pytest.mark.parametrize(("pressed", "scaled"), [(True, 1), (False, 0)])
def test_the_touch_sensor_is_seen(pressed, scaled):
    brick = SimBrick()
    brick.attach_sensor(1, TouchSensor(lambda: pressed))
    ask(brick, direct.SetInputMode(0, SensorType.SWITCH, SensorMode.BOOLEAN))
    brick.tick(30)
    values = ask(brick, direct.GetInputValues(0))
    assert values.valid
    assert values.scaled == scaled


def transact(brick, port, tx_data, rx_size):
    ask(brick, direct.LSWrite.transaction(port, tx_data, rx_size))
    brick.tick(40)
    return ask(brick, direct.LSRead(port)).received


def test_a_question_without_an_answer_takes_nothing():
    brick = sonar(lambda: 42)
    ask(brick, direct.LSWrite.transaction(3, b"\x02\x42", 1))
    brick.tick(40)
    assert brick.receive(direct.LSRead(3).encode(want_reply=False)) is None
    assert ask(brick, direct.LSRead(3)).received == b"\x2a"


def sonar(distance_cm):
    brick = SimBrick()
    brick.attach_sensor(4, UltrasonicSensor(distance_cm))
    ask(brick, direct.SetInputMode(3, SensorType.LOW_SPEED_9V, SensorMode.RAW))
    brick.tick(30)
    return brick


@pytest.mark.parametrize(("register", "text"), [(0x00, b"V1.0"), (0x08, b"LEGO"), (0x10, b"Sonar"), (0x14, b"10E-2m")])
def test_the_ultrasonic_sensor_says_what_it_is(register, text):
    assert transact(sonar(lambda: 42), 3, bytes([0x02, register]), 8).rstrip(b"\0") == text


@pytest.mark.parametrize(("distance_cm", "byte"), [(0, 0), (42, 42), (254, 254), (300, 255), (None, 255)])
def test_the_ultrasonic_sensor_measures(distance_cm, byte):
    assert transact(sonar(lambda: distance_cm), 3, b"\x02\x42", 1) == bytes([byte])


def test_a_single_shot_keeps_its_distance_and_off_measures_no_more():
    distances = iter([10, 20, 30])
    brick = sonar(lambda: next(distances))
    assert transact(brick, 3, b"\x02\x42", 1) == b"\x0a"
    transact(brick, 3, b"\x02\x41\x01", 0)
    assert [transact(brick, 3, b"\x02\x42", 1) for _ in range(2)] == [b"\x14", b"\x14"]
    transact(brick, 3, b"\x02\x41\x00", 0)
    assert transact(brick, 3, b"\x02\x41", 1) == b"\x00"
    assert transact(brick, 3, b"\x02\x42", 1) == b"\x14"


def test_a_low_battery_is_reported_and_makes_the_user_interface_busy():
    brick = SimBrick()
    brick.set_battery(430)
    brick.tick(2000)
    assert ask(brick, direct.GetBatteryLevel()).voltage_mv == 5954
    flags = ask(brick, system.IOMapRead(0x000C0001, 26, 1)).data
    assert flags[0] & 0x40


def test_the_brick_switches_itself_off():
    brick = SimBrick()
    brick.tick(9 * 60_000)
    ask(brick, direct.KeepAlive())
    brick.tick(9 * 60_000)
    assert not brick.powered_off
    brick.tick(60_010)
    assert brick.powered_off
