"""The brick: requests, keep-alive, and closing."""

import math
import threading

import pytest

from firmware_protocol.direct import GetBatteryLevel, GetOutputState, KeepAlive, SetProperty
from firmware_protocol.enums import OutputPort, Property
from firmware_protocol.errors import BrickError, LinkLost, LinkTimeout, LocalProtocolError
from firmware_protocol.status import Status
from nxtdrive import open_brick
from nxtdrive.brick import Brick
from nxtdrive.transports.sim import SimTransport
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation

FOR_EVER_MS = 10**9


def test_a_brick_reports_its_name_and_versions(lab):
    info = lab().brick.info()
    assert (info.name, info.firmware, info.protocol) == ("NXT", "1.29", "1.124")
    assert info.bluetooth_address == "00:16:53:01:02:03"
    assert info.free_flash > 100_000
    assert 7000 < info.battery_mv < 9000


def test_opening_checks_that_the_brick_answers():
    with open_brick("sim://open") as brick:
        assert brick.battery_v == brick.info().battery_mv / 1000
    with pytest.raises(LinkLost):
        brick.request(KeepAlive())


@pytest.mark.parametrize("timeout_s", [math.inf, math.nan, 0, -1, "1"])
def test_a_timeout_that_no_link_can_keep_is_refused(timeout_s):
    with pytest.raises(LocalProtocolError, match="timeout_s"):
        open_brick("sim://open", timeout_s=timeout_s)
    with open_brick("sim://open") as brick, pytest.raises(LocalProtocolError, match="timeout_s"):
        brick.request(GetBatteryLevel(), timeout_s=timeout_s)


def test_a_refusal_carries_its_status(lab):
    with pytest.raises(BrickError) as caught:
        lab().brick.programs.write_message(1, "hello")
    assert caught.value.status is Status.NO_ACTIVE_PROGRAM


@pytest.mark.parametrize(
    "mistake",
    [
        lambda brick: brick.tone(100, 500),
        lambda brick: brick.tone(440, 5),
        lambda brick: brick.programs.write_message(0, "hello"),
        lambda brick: brick.programs.read_message(11),
        lambda brick: brick.speaker.play("a-name-of-more-than-19.rso"),
        lambda brick: brick.motor("D"),
        lambda brick: brick.motor("A").dc(101),
        lambda brick: brick.motor("A").run(1000),
        lambda brick: brick.motor("A").run_angle(5, 90),
        lambda brick: brick.motor("A").run_angle(360, 90, "stop"),
        lambda brick: brick.motor("A").run_time(360, 1, "stop"),
        lambda brick: brick.color(1).brightness_percent("pink"),
        lambda brick: brick.touch(0),
        lambda brick: brick.ultrasonic(5),
        lambda brick: brick.touch(True),
    ],
)
def test_what_is_out_of_range_is_not_sent(direct, mistake):
    with Brick(direct) as brick, pytest.raises(LocalProtocolError):
        mistake(brick)
    assert direct.sent == []


def test_a_timeout_is_measured_on_the_links_clock(lab):
    silent = lab(faults=LinkFaults(silent_ms=((0, FOR_EVER_MS),)))
    with pytest.raises(LinkTimeout):
        silent.brick.request(KeepAlive(), timeout_s=2.5)
    assert silent.simulation.time_s == pytest.approx(2.5)


def test_a_brick_in_use_does_not_switch_itself_off(lab):
    room = lab()
    room.brick.request(SetProperty(Property.SLEEP_TIME, (120_000).to_bytes(4, "little")))
    room.brick.link.keep_alive()
    room.brick.sleep(400)
    assert not room.simulation.brick.powered_off
    room.simulation.advance(130_000)
    assert room.simulation.brick.powered_off


@pytest.mark.slow
def test_a_sleep_timer_that_is_shortened_later_does_not_switch_a_brick_in_use_off(lab):
    room = lab()
    room.brick.request(SetProperty(Property.SLEEP_TIME, (3_600_000).to_bytes(4, "little")))
    room.brick.link.keep_alive()
    room.brick.request(SetProperty(Property.SLEEP_TIME, (120_000).to_bytes(4, "little")))
    room.brick.sleep(400)
    assert not room.simulation.brick.powered_off


def test_a_program_that_only_talks_keeps_it_awake_as_well(lab):
    room = lab()
    room.brick.request(SetProperty(Property.SLEEP_TIME, (60_000).to_bytes(4, "little")))
    room.brick.link.keep_alive()
    for _ in range(20):
        room.simulation.advance(10_000)
        assert room.brick.battery_v
    assert not room.simulation.brick.powered_off


def test_a_brick_is_kept_awake_after_a_reconnection_as_well(lab):
    room = lab()
    room.brick.request(SetProperty(Property.SLEEP_TIME, (120_000).to_bytes(4, "little")))
    room.brick.link.reconnect()
    room.brick.sleep(400)
    assert not room.simulation.brick.powered_off


class Sleepless(SimTransport):
    """Reports a sleep timer of a millisecond, and counts what is sent."""

    sent = 0

    def send(self, telegram):
        self.sent += 1
        super().send(telegram)

    def receive(self, timeout_s):
        reply = super().receive(timeout_s)
        is_timer = reply is not None and reply.startswith(b"\x02\x0d\x00")
        return reply[:3] + (1).to_bytes(4, "little") if is_timer else reply


def test_a_sleep_timer_that_no_brick_can_have_does_not_fill_the_link_with_keep_alives():
    transport = Sleepless(Simulation("open"))
    with Brick(transport) as brick:
        brick.link.keep_alive()
        before = transport.sent
        brick.sleep(10)
        assert transport.sent - before <= 10


@pytest.mark.parametrize("error", [None, RuntimeError, KeyboardInterrupt])
def test_leaving_the_block_stops_the_motors_and_takes_the_power_off_them(lab, error):
    room = lab()
    expected = pytest.raises(error) if error else pytest.MonkeyPatch.context()
    with expected, room.brick as brick:
        brick.motor("A").run(700)
        brick.motor("C").dc(-60)
        brick.sleep(1)
        assert room.output("A").actual_speed
        if error:
            raise error
    room.simulation.advance(1000)
    for port in "AC":
        assert (room.output(port).actual_speed, room.output(port).brake) == (0, False)


def test_a_motor_that_was_not_used_is_left_alone(direct):
    with Brick(direct) as brick:
        brick.request(GetOutputState(OutputPort.A))
    assert len(direct.sent) == 1


def test_several_threads_get_each_its_own_answer(direct):
    wrong = []

    def ask(port):
        for _ in range(200):
            if brick.request(GetOutputState(port)).port is not port:
                wrong.append(port)

    with Brick(direct) as brick:
        threads = [threading.Thread(target=ask, args=(OutputPort(number % 3),)) for number in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert wrong == []


def test_on_the_wall_clock_a_waiting_program_still_says_what_is_due(direct):
    enough, before = threading.Event(), set(threading.enumerate())
    direct.on_send = lambda telegram: enough.set() if len(direct.sent) >= 3 else None
    with Brick(direct) as brick:
        brick.link.repeat("awake", KeepAlive(), 0.01)
        assert enough.wait(10)
        brick.link.cancel_timer("awake")
    assert set(direct.sent) == {b"\x80\x0d"}
    assert set(threading.enumerate()) <= before
