"""Rules of the low speed module, each as a short conversation with the answers of LEGO's firmware."""

import pytest

from firmware_protocol.direct import LSGetStatus, LSRead, SetInputMode
from firmware_protocol.enums import InputPort, SensorMode, SensorType
from firmware_protocol.iomap import LOW_SPEED
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import FIRMWARES

IDLE, INIT, LOAD, COMMUNICATING, ERROR, DONE = range(6)
TRANSMITTING, RECEIVING, RECEIVED = 1, 2, 3
PORT = InputPort.IN_1


class Bus:
    """A bench with a device at address 0x02 on port 1, whose registers from 0x40 on count up."""

    def __init__(self, firmware: str = "1.29", sensor_type: int = SensorType.LOW_SPEED_9V) -> None:
        self.bench = Bench(SimBrick(firmware=firmware))
        self.bench.control("!i2c 0 attach 02")
        self.bench.control("!i2c 0 set 40 " + bytes(range(0x40, 0x60)).hex())
        self.set_type(sensor_type)
        self.bench.control("!tick 30")

    def set_type(self, sensor_type: int) -> None:
        self.send(SetInputMode(PORT, SensorType(sensor_type), SensorMode.RAW))

    def send(self, command) -> str:
        return self.bench.telegram(command.encode().hex())

    def write(self, message: bytes, read: int = 0, passes: int = 40) -> str:
        reply = self.bench.telegram(bytes([0, 0x0F, 0, len(message), read, *message]).hex())
        self.bench.control(f"!tick {passes}")
        return reply

    def read(self) -> str:
        return self.send(LSRead(PORT))

    def status(self) -> str:
        return self.send(LSGetStatus(PORT))

    def log(self) -> str:
        return self.bench.control("!i2c 0 log")

    def fields(self, *names: str) -> tuple[int, ...]:
        return tuple(self.field(name) for name in names)

    def field(self, name: str) -> int:
        spot = LOW_SPEED.field(name)
        return spot.decode(bytes.fromhex(self.bench.telegram(spot.read().encode().hex()))[9:])

    def put(self, **values: int | bytes) -> None:
        for name, value in values.items():
            self.bench.telegram(LOW_SPEED.field(name).write(value).encode().hex())


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_type_is_accepted_20_passes_after_it_was_set(firmware):
    bus = Bus(firmware, SensorType.NONE)
    bus.set_type(SensorType.LOW_SPEED)
    bus.bench.control("!tick 19")
    assert [bus.write(b"\x02", passes=0) for _ in range(3)] == ["020fe0", "020f00", "020fe0"]


@pytest.mark.parametrize(("read", "seen"), [
    (0, {0: (LOAD, 0), 1: (COMMUNICATING, TRANSMITTING), 3: (DONE, RECEIVED), 4: (IDLE, RECEIVED)}),
    (4, {3: (COMMUNICATING, TRANSMITTING), 4: (COMMUNICATING, RECEIVING), 8: (DONE, RECEIVED), 9: (IDLE, RECEIVED)}),
])  # fmt: skip
def test_the_map_shows_the_states_of_a_transaction(read, seen):
    for passes, (state, mode) in seen.items():
        bus = Bus()
        bus.write(b"\x02\x40", read, passes)
        assert bus.field("ChannelState") == state
        bus = Bus()
        bus.write(b"\x02\x40", read, passes)
        assert bus.fields("Mode", "ErrorType") == (mode, 0)


@pytest.mark.parametrize(
    ("written", "read", "passes"), [(1, 1, 5), (2, 1, 5), (2, 2, 6), (9, 1, 12), (10, 1, 13), (16, 0, 16), (16, 15, 30)]
)
def test_how_long_a_transaction_takes(written, read, passes):
    def after(wait: int) -> int:
        bus = Bus()
        bus.write(bytes([2]).ljust(written, b"\x40"), read, wait)
        return bus.field("ChannelState")

    assert [after(passes - 1), after(passes)] == [COMMUNICATING, DONE]


@pytest.mark.parametrize(
    ("firmware", "written", "passes"), [("1.29", 2, 4), ("1.29", 9, 11), ("1.05", 2, 3), ("1.05", 3, 5), ("1.05", 9, 9)]
)
def test_when_the_turn_to_reading_is_seen(firmware, written, passes):
    modes = []
    for wait in (passes - 1, passes):
        bus = Bus(firmware)
        bus.write(bytes([2]).ljust(written, b"\x40"), 8, wait)
        modes.append(bus.field("Mode"))
    assert modes == [TRANSMITTING, RECEIVING]


@pytest.mark.parametrize(
    ("size", "addresses"),
    [(1, ["ee", "40", "72", "73"]), (4, ["ee", "74", "78", "7c"]), (8, ["ee", "78", "08", "00"])],
)
def test_retries_go_on_behind_the_message(size, addresses):
    bus = Bus()
    bus.write(b"\x02\x40" + bytes(range(0x72, 0x80)))
    bus.log()
    bus.write(b"\xee".ljust(size, b"\x11"))
    assert bus.log() == " ".join(f"S [{address}]n P" for address in addresses) + "  clocks=40"


def test_a_read_that_was_not_reached_follows_the_next_message():
    bus = Bus()
    bus.write(b"\xee\x40", 2)
    bus.log()
    bus.write(b"\x02\x40\x77")
    assert bus.log() == "S [02]a 40 77 P S [03]a r41 r42  clocks=48"
    assert bus.read()[4:8] == "0000"


def test_unread_bytes_stay_whatever_the_status():
    bus = Bus()
    bus.write(b"\x02\x40", 14)
    assert bus.write(b"\x02\x50", passes=0) == "020f00"
    assert bus.status() == "020e200e"
    assert bus.read() == "0210000e" + bytes(range(0x40, 0x4E)).hex() + "0000"  # not pending, as there are bytes
    bus.bench.control("!tick 20")
    bus.write(b"\x02\x40", 14)
    bus.set_type(SensorType.NONE)
    assert [bus.status(), bus.read(), bus.status()] == ["020ee00e", "0210e00e0000", "020ee00e"]


@pytest.mark.parametrize(("first", "second", "ready"), [(14, 1, 15), (14, 2, 0), (15, 15, 14), (8, 16, 8), (16, 5, 5)])
def test_the_ring_counts_modulo_16(first, second, ready):
    bus = Bus()
    bus.write(b"\x02\x40", first)
    bus.write(b"\x02\x40", second)
    assert bus.status() == f"020e00{ready:02x}"


def test_a_port_of_another_type_fails_at_once():
    bus = Bus()
    bus.write(b"\x02\x40", 15, passes=5)
    bus.set_type(SensorType.NONE)
    assert bus.fields("ChannelState", "ErrorType", "State") == (ERROR, 1, 0)
    assert bus.log() == "S [02]a 40 P S [03]a r40 r41 r42  clocks=49"
    assert [bus.write(b"\x02", passes=1) for _ in range(2)] == ["020f00", "020f00"]  # not checked after an error


def test_an_empty_message_ends_when_the_byte_counter_wraps():
    bus = Bus()
    bus.write(b"\x02\x10\x20\x30")
    bus.write(b"", 1, passes=231)
    assert bus.fields("Mode") == (TRANSMITTING,)
    assert bus.fields("Mode", "ChannelState") == (RECEIVING, DONE)


def test_a_transaction_is_started_through_the_map():
    bus = Bus()
    bus.put(OutBuf=b"\x02\x40".ljust(16, b"\0"), OutBufInPtr=2, OutBufOutPtr=0, BytesToRx=4, ChannelState=INIT)
    assert bus.fields("ChannelState", "State") == (INIT, 0)
    bus.put(State=1)
    bus.bench.control("!tick 10")
    assert bus.read() == "02100004" + bytes(range(0x40, 0x44)).hex().ljust(32, "0")


def receive_without_a_message(bus, times):
    for _ in range(times):
        bus.put(Mode=RECEIVING, ChannelState=COMMUNICATING, State=1)


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize(("times", "error"), [(1, 0), (100, 0), (101, 3)])
def test_a_read_without_a_message_succeeds_at_once_even_after_the_timeout(firmware, times, error):
    bus = Bus(firmware)
    receive_without_a_message(bus, times)
    assert bus.fields("ChannelState", "Mode", "ErrorType") == (DONE, RECEIVED, error)


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_the_passes_of_a_read_are_counted_in_a_byte_which_an_empty_message_sends(firmware):
    bus = Bus(firmware)
    receive_without_a_message(bus, 300)
    bus.bench.control("!i2c 0 attach 00")
    bus.bench.control("!tick 3")
    bus.write(b"", passes=300)
    assert f"{300 & 0xFF:02x}" in bus.log().split()


def test_a_device_that_is_unplugged_reads_as_ones():
    bus = Bus()
    bus.write(b"\x02\x40", 8, passes=7)
    bus.bench.control("!i2c 0 detach")
    bus.bench.control("!tick 20")
    assert bus.read() == "021000084041424347ffffff".ljust(40, "0")


def test_the_bench_keeps_registers_and_log_of_a_port():
    bus = Bus()
    bus.write(b"\x02\x41", 2)
    bus.bench.control("!i2c 0 detach")
    bus.bench.control("!i2c 0 attach 10")
    bus.write(b"\x10\x41", 1)
    assert bus.log() == "S [02]a 41 P S [03]a r41 r42 N S [10]a 41 P S [11]a r41 N  clocks=87"
    bus.bench.control("!i2c 0 ack 0")
    bus.write(b"\x10\x41", 1)
    assert bus.status() == "020edd03"


def test_a_device_that_is_unplugged_before_the_second_address_is_an_error():
    bus = Bus()
    bus.write(b"\x02\x40", 8, passes=2)
    bus.bench.control("!i2c 0 detach")
    bus.bench.control("!tick 30")
    assert bus.status() == "020edd00"


@pytest.mark.parametrize(("firmware", "passes", "seen"), [("1.29", 99, 3), ("1.29", 100, 4), ("1.05", 13, 0)])
def test_a_clock_line_that_is_held_low_stops_a_read(firmware, passes, seen):
    bus = Bus(firmware)
    bus.write(b"\x02\x40", 13, passes=4)
    bus.bench.control("!i2c 0 stuckscl 1")
    bus.bench.control(f"!tick {passes}")
    assert bus.field("ChannelState") == seen


def test_the_rest_of_a_read_shifts_its_lowest_bit_into_the_next_one():
    bus = Bus()
    bus.write(b"\xee\x40", 2)
    bus.write(b"\x02\x40\x77")  # reads 0x41, which stays in the buffer
    bus.write(b"\x02\x42", 2)
    assert bus.read()[:12] == "02100002c243"


MIDWAY = [
    # firmware, message of how many bytes, bytes read and passes after it, what is done then, log, state and error
    ("1.29", (8, 0, 1), ["clock low", 4, "clock free"], "S [02]a P  clocks=10", (IDLE, 0)),
    ("1.29", (3, 2, 1), ["clock low", 2, "clock free"], "S [02]a P" + " S [00]n P" * 3 + "  clocks=40", (ERROR, 2)),
    ("1.29", (8, 2, 6), ["clock low", 2, "clock free"], "S [02]a 40 41 42 43 44  clocks=61", (ERROR, 3)),
    ("1.29", (2, 8, 5), ["clock low", 2, "clock free"], "S [02]a 40 P S [03]a r40 r41 r42  clocks=49", (ERROR, 3)),
    ("1.05", (3, 2, 1), ["clock low", 2, "clock free"], "S [02]a 01 P" + " S [00]n P" * 3 + "  clocks=50", (ERROR, 2)),
    ("1.05", (8, 2, 6), ["clock low", 2, "clock free"], "S [02]a 40 41 42 43 44 45 ff ff  clocks=82", (IDLE, 0)),
    ("1.05", (2, 8, 5), ["clock low", 2, "clock free"], "S [02]a 40 P S [03]a r40 r41 r42 N  clocks=81", (IDLE, 0)),
    ("1.29", (5, 0, 3), ["data low", 1, "data free"], "S [02]a 40 41 40 03 P  clocks=46", (IDLE, 0)),
    ("1.29", (8, 0, 2), ["type 10"], "S [02]a 40 P  clocks=21", (IDLE, 0)),
    ("1.05", (8, 0, 2), ["type 10"], "S [02]a 40 P P  clocks=73", (IDLE, 0)),
    ("1.29", (8, 4, 7), ["type 10"], "S [02]a 40 41 42 43 44 45 46  clocks=72", (ERROR, 1)),
    ("1.29", (3, 0, 2), ["detach", 1, "attach 02"], "S [02]a 40 P  clocks=28", (IDLE, 0)),
    ("1.29", (2, 8, 6), ["detach"], "S [02]a 40 P S [03]a r40 r41 r42 r43 P  clocks=102", (IDLE, 0)),
]
LINES = {"clock low": "stuckscl 1", "clock free": "stuckscl 0", "data low": "stucksda 1", "data free": "stucksda 0"}


@pytest.mark.parametrize(("firmware", "message", "actions", "log", "state"), MIDWAY)
def test_what_happens_in_the_middle_of_a_transfer_shows_on_the_bus(firmware, message, actions, log, state):
    bus = Bus(firmware)
    size, read, passes = message
    bus.write(b"\x02" + bytes(range(0x40, 0x3F + size)), read, passes)
    for action in actions:
        if isinstance(action, int):
            bus.bench.control(f"!tick {action}")
        elif action.startswith("type"):
            bus.set_type(int(action.split()[1]))
        else:
            bus.bench.control("!i2c 0 " + LINES.get(action, action))
    bus.bench.control("!tick 20")
    assert bus.log() == log
    assert bus.fields("ChannelState", "ErrorType") == state


def test_a_sensor_whose_byte_was_cut_short_blocks_the_bus():
    bus = Bus()
    bus.write(b"\x02\x40", 8, passes=6)
    bus.set_type(SensorType.NONE)
    bus.set_type(SensorType.LOW_SPEED_9V)
    bus.bench.control("!tick 20")
    bus.write(b"\x02\x40", 2)
    assert bus.fields("ChannelState", "ErrorType") == (ERROR, 1)
    assert bus.log() == "S [02]a 40 P S [03]a r40 r41 r42 r43  clocks=60"


def test_a_read_whose_end_is_not_awaited_goes_on_while_another_port_is_busy():
    bus = Bus()
    bus.write(b"\xee\x40", 4)
    bus.write(b"\x02\x40\x77")
    assert bus.log().endswith("S [02]a 40 77 P S [03]a r41 r42  clocks=88")
    bus.bench.control("!i2c 1 attach 02")
    bus.bench.telegram("0005010b00")
    bus.bench.control("!tick 30")
    bus.bench.telegram("000f0102000240")
    bus.bench.control("!tick 20")
    assert bus.log() == "r43 r44 N  clocks=27"


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_reset_of_the_ports_drops_transfers_errors_and_bytes_waiting(firmware):
    bus = Bus(firmware)
    bus.write(b"\x02\x42", read=2)
    assert bus.status() == "020e0002"
    bus.bench.brick.low_speed.reset()
    assert (bus.status(), bus.fields("InPtr", "State")) == ("020e0000", (0, 0))
    bus.bench.control("!i2c 0 detach")
    bus.write(b"\x02\x42", read=2)
    assert bus.status() == "020edd00"
    bus.bench.brick.low_speed.reset()
    assert [bus.status(), bus.status()] == ["020e2000", "020e0000"]


@pytest.mark.parametrize("sensor_type", [SensorType.LOW_SPEED_9V, SensorType.SWITCH])
@pytest.mark.parametrize(("put", "taken", "count"), [(27, 222, 77), (200, 3, 197), (0, 255, 17), (3, 9, 10)])
def test_pointers_outside_the_ring_are_counted_in_a_byte(put, taken, count, sensor_type):
    bus = Bus(sensor_type=sensor_type)
    bus.put(InPtr=put, OutPtr=taken)
    assert bytes.fromhex(bus.status())[3] == count
    assert bytes.fromhex(bus.read())[3] == count


def test_a_sensor_that_stops_to_acknowledge_completes_the_message_that_it_takes():
    bus = Bus()
    bus.write(b"\x02\x35", 14, passes=1)
    bus.bench.control("!i2c 0 ack 0")
    bus.bench.control("!tick 2")
    assert bus.log() == "S [02]a 35 P S [03]n P  clocks=30"
