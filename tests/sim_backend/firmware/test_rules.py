"""Rules of the firmware fact sheet that the recorded conversations touch once or not at all."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol import direct, system
from firmware_protocol.enums import OutputPort, RunState, SensorMode, SensorType
from firmware_protocol.iomap import BUTTON, COMM, OUTPUT, SOUND, UI, OutputFlag, SoundState, UiFlag
from firmware_protocol.status import Status
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.devices import AnalogInput, Compass, GenericI2CDevice
from sim_backend.devices.failing import FailingI2C
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.button import LONG_PRESS_MS
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.firmware.sensors.analog import NORMALIZE
from sim_backend.firmware.ui.battery import RECHARGEABLE
from sim_backend.firmware.ui.sleep_timer import MINUTE_MS
from sim_backend.firmware.versions import FIRMWARES
from tests.sim_backend.firmware.asking import ask, status_of


def ask_by_radio(brick, command):
    telegram = command.encode()
    framed = brick.receive_bluetooth(len(telegram).to_bytes(2, "little") + telegram)
    brick.tick()
    assert int.from_bytes(framed[:2], "little") == len(framed) - 2
    return Status(framed[4]), type(command).reply_type.unpack(framed[2:])


def field(brick, io_map, name, index=0):
    spot = io_map.field(name, index)
    return spot.decode(ask(brick, spot.read())[1].data)


def put(brick, io_map, name, value, index=0):
    assert status_of(brick, io_map.field(name, index).write(value)) == Status.OK


@pytest.mark.parametrize(("firmware", "files"), [("1.29", 126), ("1.05", 62), ("1.32", 126)])
def test_the_directory_is_full(firmware, files):
    brick = SimBrick(firmware=firmware)
    for number in range(files):
        assert status_of(brick, system.OpenWrite(f"{number}.t", 1)) == Status.OK
        brick.receive(system.Write(0, b"x").encode())
        assert status_of(brick, system.Close(0)) == Status.OK
    assert status_of(brick, system.OpenWrite("one too many.t", 1)) == Status.NO_MORE_FILES
    assert status_of(brick, system.Delete("0.t")) == Status.OK
    assert status_of(brick, system.OpenWrite("one more.t", 1)) == Status.OK


def test_four_files_can_be_written_at_once():
    brick = SimBrick()
    for number in range(4):
        assert ask(brick, system.OpenWrite(f"{number}.t", 9))[1].handle == number
    assert status_of(brick, system.OpenWrite("4.t", 9)) == Status.NO_WRITE_BUFFERS
    assert status_of(brick, system.OpenWriteData("4.t", 9)) == Status.NO_WRITE_BUFFERS
    brick.receive(system.Close(2).encode())
    assert ask(brick, system.OpenWrite("4.t", 9))[1].handle == 2


def test_sixteen_handles_are_shared_by_files_searches_and_sounds():
    brick = SimBrick()
    brick.loader.create("a.rso", 16)
    brick.loader.write(0, bytes([1, 0, 0, 8, 0x1F, 0x40, 0, 0]) + bytes(8))
    brick.loader.close(0)
    assert status_of(brick, direct.PlaySoundFile(True, "a.rso")) == Status.OK
    handles = [ask(brick, system.OpenRead("a.rso"))[1].handle for _ in range(8)]
    handles += [ask(brick, system.FindFirst("*.*"))[1].handle for _ in range(7)]
    assert handles == list(range(1, 16))
    assert status_of(brick, system.FindFirst("*.*")) == Status.NO_MORE_HANDLES
    assert status_of(brick, direct.PlaySoundFile(False, "a.rso")) == Status.OUT_OF_RANGE
    brick.receive(direct.StopSoundPlayback().encode())
    brick.tick(2)
    assert ask(brick, system.FindFirst("*.*"))[1].handle == 0


def test_deleting_a_file_frees_the_sectors_of_a_download_that_is_open():
    brick = SimBrick()
    brick.loader.create("old", 1)
    brick.loader.write(0, b"x")
    brick.loader.close(0)
    empty = SimBrick().loader.free_flash
    assert status_of(brick, system.OpenWrite("new", 5000)) == Status.OK
    assert brick.loader.free_flash < empty - 5000
    assert status_of(brick, system.Delete("old")) == Status.OK
    assert ask(brick, system.GetDeviceInfo())[1].free_flash == empty


def test_what_was_opened_over_bluetooth_outlives_the_cable():
    brick = SimBrick()
    brick.loader.create("a.t", 3)
    brick.loader.write(0, b"abc")
    brick.loader.close(0)
    assert ask_by_radio(brick, system.OpenRead("a.t"))[1].handle == 0
    assert ask(brick, system.OpenRead("a.t"))[1].handle == 1
    brick.unplug_usb()
    assert ask_by_radio(brick, system.Read(0, 3)) == (Status.OK, system.FileData(0, 3, b"abc"))
    assert status_of(brick, system.Read(1, 3)) == Status.ILLEGAL_HANDLE


def test_how_much_fits_over_each_link():
    brick = SimBrick()
    read = system.IOMapRead(0x0001_0001, 60, 200)
    assert ask(brick, read)[1].size == 55
    assert ask_by_radio(brick, read)[1].size == 119
    for buffer in (0, 1):
        assert status_of(brick, system.Poll(buffer, 60)) == Status.UNDEFINED_ERROR
        assert ask_by_radio(brick, system.Poll(buffer, 121))[0] == Status.OK
        assert ask_by_radio(brick, system.Poll(buffer, 122))[0] == Status.UNDEFINED_ERROR


@pytest.mark.parametrize("size", [1, 125, 126, 129, 300, 2000])
def test_a_write_of_any_length_goes_over_bluetooth(size):
    brick = SimBrick()
    handle = ask_by_radio(brick, system.OpenWrite("a.t", size))[1].handle
    content = bytes(number % 251 for number in range(size))
    telegram = bytes([1, 0x83, handle]) + content
    reply = brick.receive_bluetooth(len(telegram).to_bytes(2, "little") + telegram)
    assert reply == b"\x06\x00\x02\x83\x00" + bytes([handle]) + size.to_bytes(2, "little")
    brick.loader.close(handle)
    brick.loader.open_read("a.t")
    assert brick.loader.read(handle, size) == (Status.OK, content)


def test_a_telegram_in_pieces_on_the_stream_waits_for_its_end():
    bench = Bench(SimBrick())
    bench.control("!btmode 1")
    assert bench.control("!bt 02") == ""
    assert bench.control("!bt 00000b0200") == "0500020b004a1e"
    assert bench.control("!bt 000b") == "0500020b004a1e"


def test_bytes_on_port_4_wait_to_be_fetched():
    brick = SimBrick()
    brick.high_speed.arrive(b"lost")
    put(brick, COMM, "HsState", 1)
    put(brick, COMM, "HsFlags", 1)
    brick.tick(2)
    brick.high_speed.arrive(bytes(range(50)))
    assert ask(brick, system.PollLength(1))[1].size == 50
    assert ask(brick, system.Poll(1, 59))[1] == system.PollData(1, 50, bytes(range(50)) + bytes(9))
    assert ask(brick, system.PollLength(1))[1].size == 0


def test_a_motor_is_started_by_one_write_to_the_map():
    brick = SimBrick()
    brick.attach_motor("B", BenchMotor())
    span = OUTPUT.between("Flags", "RunState", 1)
    order = bytes([OutputFlag.MODE | OutputFlag.SPEED, 1, 70, 0, 96, 32, 32, RunState.RUNNING])
    assert status_of(brick, system.IOMapWrite(span.module_id, span.offset, span.size, order)) == Status.OK
    brick.tick(100)
    assert field(brick, OUTPUT, "ActualSpeed", 1) == 70
    assert field(brick, OUTPUT, "TachoCount", 1) > 20
    assert field(brick, OUTPUT, "Flags", 1) == 0


def test_a_tone_is_started_through_the_map():
    brick = SimBrick()
    put(brick, SOUND, "Freq", 523)
    put(brick, SOUND, "Duration", 200)
    put(brick, SOUND, "Mode", 2)
    assert brick.sound.tone is None
    put(brick, SOUND, "Flags", 1)
    assert field(brick, SOUND, "State") == SoundState.TONE
    assert brick.sound.tone == (523, 200, 4)
    brick.tick(200)
    assert field(brick, SOUND, "State") == SoundState.IDLE


def test_the_sleep_timer_is_reset_through_the_map():
    brick = SimBrick()
    brick.tick(5 * MINUTE_MS)
    assert field(brick, UI, "SleepTimer") == 5
    put(brick, UI, "Flags", UiFlag.ENABLE_STATUS | UiFlag.RESET_SLEEP_TIMER)
    assert field(brick, UI, "SleepTimer") == 0
    assert field(brick, UI, "Flags") == UiFlag.ENABLE_STATUS


def test_the_brick_is_switched_off_through_the_map():
    brick = SimBrick()
    put(brick, UI, "ForceOff", 1)
    brick.tick(3)
    assert not brick.display_on
    assert not brick.powered_off
    brick.tick(4)
    assert brick.powered_off


def test_the_exit_button_switches_the_brick_off_after_two_seconds():
    brick = SimBrick()
    brick.button.hold(1)
    brick.tick(2008)
    assert not brick.powered_off
    brick.tick(1)
    assert brick.powered_off


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_types_take_their_time_to_become_valid(firmware):
    brick = SimBrick(firmware=firmware)
    brick.attach_sensor(1, AnalogInput(lambda: 500))

    def valid_after(sensor_type, mode=SensorMode.RAW):
        ask(brick, direct.SetInputMode(0, sensor_type, mode))
        passes = 1
        while not ask(brick, direct.GetInputValues(0))[1].valid:
            passes += 1
        return passes

    delay = valid_after(SensorType.LIGHT_ACTIVE)
    assert 20 <= delay <= 22
    assert valid_after(SensorType.LIGHT_ACTIVE, SensorMode.PERCENT) == 1
    assert valid_after(SensorType.LOW_SPEED) == delay
    if firmware != "1.05":
        assert valid_after(SensorType.SOUND_DB) == delay + 280
        assert valid_after(SensorType.SWITCH) == delay
    else:
        valid_after(SensorType.SWITCH)
        assert valid_after(SensorType.TEMPERATURE) == 2  # the pass that sees the change is the only invalid one


@given(st.integers(0, 1022), st.sampled_from(sorted(NORMALIZE)))
def test_more_voltage_never_means_more_of_what_is_measured(raw, sensor_type):
    rising = sensor_type in (SensorType.SWITCH, SensorType.ANGLE, SensorType.CUSTOM)
    here, there = NORMALIZE[sensor_type](raw), NORMALIZE[sensor_type](raw + 1)
    assert 0 <= here <= 1023
    assert (there >= here) if rising else (there <= here)


def test_a_long_press_is_counted_as_one():
    brick = SimBrick()
    brick.button.hold(8)
    brick.tick(LONG_PRESS_MS + 10)
    assert [field(brick, BUTTON, name, 3) for name in ("PressedCnt", "LongPressCnt", "LongRelCnt")] == [1, 1, 0]
    brick.button.hold(0)
    brick.tick(10)
    assert [field(brick, BUTTON, name, 3) for name in ("ShortRelCnt", "LongRelCnt", "RelCnt")] == [0, 1, 1]


@pytest.mark.slow
def test_a_key_keeps_the_brick_awake():
    brick = SimBrick()
    brick.tick(9 * MINUTE_MS)
    brick.button.hold(2)
    brick.tick(2 * MINUTE_MS)
    assert not brick.powered_off


@pytest.mark.parametrize(
    ("raw", "low"), [(440, True), (441, False), (512 | RECHARGEABLE, True), (513 | RECHARGEABLE, False)]
)
def test_the_battery_is_low_below_its_threshold_for_six_samples(raw, low):
    brick = SimBrick()
    brick.set_battery(raw)
    brick.tick(5 * 167)
    assert not field(brick, UI, "Flags") & UiFlag.BUSY
    brick.tick(2 * 167)
    assert bool(field(brick, UI, "Flags") & UiFlag.BUSY) is low


def test_the_battery_popup_comes_once():
    brick = SimBrick()

    def busy_with(raw):
        brick.set_battery(raw)
        brick.tick(2000)
        return bool(field(brick, UI, "Flags") & UiFlag.BUSY)

    assert busy_with(400)
    put(brick, UI, "Button", 2)
    assert not busy_with(400)
    assert not busy_with(560)
    assert not busy_with(400)


@pytest.mark.parametrize(
    ("sent", "name"),
    [(b"Rover\0", b"Rover"), (b"123456789012345\0", b"123456789012345"), (b"1234567890123456", b"123456789012345")],
)
def test_names_have_fifteen_characters(sent, name):
    brick = SimBrick()
    assert brick.receive(b"\x01\x98" + sent.ljust(16, b"\0")) == b"\x02\x98\x00"
    assert brick.radio.name.rstrip(b"\0") == name
    assert status_of(brick, system.SetBrickName("again")) == Status.BLUETOOTH_BUSY


def test_a_message_of_no_bytes_sends_what_lies_behind_it():
    brick = SimBrick()
    device = GenericI2CDevice()
    brick.attach_sensor(1, device)
    bus = brick.low_speed.channels[0].bus.sensor
    bus.trace = []
    ask(brick, direct.SetInputMode(0, SensorType.LOW_SPEED, SensorMode.RAW))
    brick.tick(25)
    ask(brick, direct.LSWrite.transaction(0, b"\x02\x10\x20\x30", 0))
    brick.tick(20)
    before = len(bus.trace)
    brick.receive(bytes([0, 0x0F, 0, 0, 0]))
    brick.tick(10)
    assert bus.trace[before : before + 5] == ["S", "[02]a", "10", "20", "30"]
    assert len(bus.trace) - before < 20
    brick.tick(218)
    assert status_of(brick, direct.LSGetStatus(0)) == Status.PENDING
    brick.tick(5)
    assert status_of(brick, direct.LSGetStatus(0)) == Status.OK
    assert len(bus.trace) - before == 1 + 256 + 1  # the byte counter has eight bits


def numbered():
    device = GenericI2CDevice()
    device.registers[:] = range(256)
    return device


@pytest.mark.parametrize(
    ("device", "sent"),
    [
        (numbered(), b"\0\1"),
        (Compass(lambda: 0.0), b"\xfdV"),
        (FailingI2C(numbered(), lambda: None, Random(0)), b"\0\1"),
    ],
    ids=["registers", "compass", "failing"],
)
def test_bytes_that_a_cut_read_has_not_sent_are_read_next(device, sent):
    device.write(b"\0")
    assert device.read(4)[:1] == sent[:1]
    device.give_back(3)
    assert device.read(1) == sent[1:]


def test_a_stuck_sensor_takes_back_only_what_it_was_asked_for():
    device = numbered()
    stuck = FailingI2C(device, lambda: "stuck", Random(0))
    stuck.write(b"\0")
    assert stuck.read(4) == stuck.read(4) == bytes(range(4))
    stuck.give_back(3)
    assert device.read(1) == b"\4"


def test_an_empty_message_without_a_receiver_is_an_error():
    brick = SimBrick()
    ask(brick, direct.SetInputMode(0, SensorType.LOW_SPEED, SensorMode.RAW))
    brick.tick(25)
    brick.receive(bytes([0, 0x0F, 0, 0, 1]))
    brick.tick(20)
    assert status_of(brick, direct.LSGetStatus(0)) == Status.BUS_ERROR


def test_a_second_search_for_modules_waits_for_the_first():
    brick = SimBrick()
    assert ask(brick, system.FindFirstModule("*.mod"))[1].name == "Comm.mod"
    assert status_of(brick, system.FindFirstModule("Ui.mod")) == Status.NO_MORE_HANDLES
    assert ask(brick, system.FindNextModule(99))[1].name == "Input.mod"
    assert status_of(brick, system.CloseModuleHandle(7)) == Status.OK
    assert ask(brick, system.FindFirstModule("Ui.*"))[1].name == "Ui.mod"
    assert status_of(brick, system.FindNextModule(0)) == Status.MODULE_NOT_FOUND


def test_every_status_byte_that_a_telegram_can_provoke_is_declared():
    for value in (0x00, 0x01, 0x20, 0x40, *range(0x81, 0x86), *range(0x87, 0x95), 0xBE, 0xC0, 0xDD, 0xE0, 0xEC):
        assert Status(value).known
    for value in (0xED, 0xEE, 0xFB):
        assert Status(value).known


def test_motor_ports_beyond_c_are_refused():
    brick = SimBrick()
    assert status_of(brick, direct.GetOutputState(OutputPort(3))) == Status.OUT_OF_RANGE
    assert status_of(brick, direct.ResetMotorPosition(OutputPort.ALL, False)) == Status.OUT_OF_RANGE
    assert status_of(brick, direct.UpdateResetCount(OutputPort(3))) == Status.OUT_OF_RANGE
