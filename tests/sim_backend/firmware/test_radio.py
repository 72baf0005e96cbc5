"""The radio's operations, pass by pass. The replies are those of LEGO's firmware with the recordings' radio."""

import pytest

from firmware_protocol import direct, system
from firmware_protocol.iomap import COMM, UI
from firmware_protocol.status import Status
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from tests.sim_backend.firmware.asking import ask_bench as ask

RENAME = system.SetBrickName("A long name 345")
RESET = system.BluetoothFactoryReset()
OFF, ON = direct.SetProperty(0, bytes(4)), direct.SetProperty(0, b"\1\0\0\0")
IS_ON = direct.GetProperty(0)
STATE = UI.field("BluetoothState").read()


@pytest.fixture
def bench():
    return Bench(SimBrick())


def begin(bench, *operations):
    for operation in operations:
        ask(bench, operation)
        bench.brick.tick(1000)


def observe(bench, question, passes):
    """The distinct last bytes of the replies while `passes` pass, each with the number of the first pass."""
    seen = {}
    for number in range(passes):
        value = ask(bench, question)[1][-1]
        if not seen or next(reversed(seen.values())) != value:
            seen[number] = value
    return seen


def name(bench):
    return ask(bench, system.GetDeviceInfo())[1][:15].rstrip(b"\0").decode()


def stored_name(bench):
    return bytes.fromhex(bench.control("!btname")).rstrip(b"\0").decode()


@pytest.mark.parametrize(
    ("before", "operation", "passes"),
    [
        ((), RENAME, 3),
        ((), RESET, 169),
        ((), OFF, 4),
        ((OFF,), ON, 162),
        ((OFF,), OFF, 605),
        ((OFF,), RENAME, 157),
        ((OFF,), RESET, 323),
    ],
)
def test_how_long_the_radio_is_busy(bench, before, operation, passes):
    begin(bench, *before)
    ask(bench, operation)
    bench.brick.tick(passes - 1)
    assert ask(bench, system.SetBrickName("x"))[0] == Status.BLUETOOTH_BUSY
    assert ask(bench, system.SetBrickName("x"))[0] == Status.OK


@pytest.mark.parametrize(
    ("before", "operation", "shown", "state"),
    [
        ((), OFF, {0: 1, 4: 0}, {0: 1, 4: 4}),
        ((OFF,), ON, {0: 0, 160: 1}, {0: 4, 160: 0, 161: 1}),
        ((), RESET, {0: 1, 6: 0, 166: 1}, {0: 1, 6: 4, 166: 0, 167: 1}),
        ((OFF,), RESET, {0: 0, 320: 1}, {0: 4, 320: 0, 322: 1}),
    ],
)
def test_when_the_radio_is_shown_as_on(before, operation, shown, state):
    for question, expected in ((IS_ON, shown), (STATE, state)):
        bench = Bench(SimBrick())
        begin(bench, *before)
        ask(bench, operation)
        assert observe(bench, question, 400) == expected


def test_a_radio_that_is_busy_or_on_is_not_switched(bench):
    assert ask(bench, ON)[0] == Status.OK
    assert ask(bench, OFF)[0] == Status.IN_PROGRESS
    assert ask(bench, ON)[0] == Status.OK
    bench.brick.tick(1000)
    assert ask(bench, IS_ON)[1] == b"\0"


def test_a_new_name_reaches_the_radio_after_three_passes(bench):
    ask(bench, RENAME)
    bench.brick.tick(2)
    assert (name(bench), stored_name(bench)) == ("A long name 345", "A long name 345")
    other = Bench(SimBrick())
    ask(other, RENAME)
    assert stored_name(other) == "NXT"


def test_a_power_cycle_cuts_the_name_to_eight_characters(bench):
    begin(bench, RENAME)
    bench.control("!reboot")
    assert (name(bench), stored_name(bench)) == ("A long n", "A long name 345")


def test_a_power_cycle_keeps_the_radio_off(bench):
    begin(bench, OFF)
    bench.control("!reboot")
    assert ask(bench, IS_ON)[1] == b"\0"


def test_a_reset_restores_the_radio_s_name_first(bench):
    begin(bench, system.SetBrickName("Robot"))
    ask(bench, RESET)
    bench.brick.tick(5)
    assert (name(bench), stored_name(bench)) == ("Robot", "NXT")
    bench.brick.tick(160)
    assert name(bench) == "NXT"


def test_a_written_address_lasts_until_the_power_cycle(bench):
    ask(bench, COMM.field("BrickAddress").write(bytes.fromhex("aabbccddeeff")))
    assert ask(bench, system.GetDeviceInfo())[1][15:21].hex() == "aabbccddeeff"
    bench.control("!reboot")
    assert ask(bench, system.GetDeviceInfo())[1][15:21].hex() == "001653010203"


@pytest.mark.parametrize(
    ("operation", "left", "passes"),
    [
        (RENAME, 0, 101), (RENAME, 101, 102), (RENAME, 300, 301),
        (OFF, 0, 101), (OFF, 300, 301),
        (RESET, 0, 266), (RESET, 101, 266), (RESET, 102, 267), (RESET, 300, 465),
    ],
)  # fmt: skip
def test_in_stream_mode_a_command_waits_until_the_radio_has_left_it(bench, operation, left, passes):
    bench.control("!btmode 1")
    ask(bench, operation)
    bench.brick.tick(left)
    bench.control("!btmode 0")
    bench.brick.tick(passes - left - 1)
    assert ask(bench, system.SetBrickName("x"))[0] == Status.BLUETOOTH_BUSY
    assert ask(bench, system.SetBrickName("x"))[0] == Status.OK


def test_a_radio_that_is_back_in_stream_mode_before_the_command_stays_busy(bench):
    bench.control("!btmode 1")
    ask(bench, RENAME)
    for mode in (0, 1):
        bench.brick.tick(40)
        bench.control(f"!btmode {mode}")
    bench.brick.tick(1000)
    assert ask(bench, RENAME)[0] == Status.BLUETOOTH_BUSY
    assert stored_name(bench) == "NXT"
    bench.control("!btmode 0")
    bench.brick.tick(1)
    assert stored_name(bench) == "A long name 345"
