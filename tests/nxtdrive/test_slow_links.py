"""Radio links: waits and timeouts adapt to the latency of the link."""

import random

import pytest

from firmware_protocol.direct import GetBatteryLevel, KeepAlive, LSWrite, SetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.system import IOMapWrite
from firmware_protocol.telegram import NO_REPLY
from nxtdrive.brick import Brick
from nxtdrive.motion.lease import Lease
from nxtdrive.motion.rover import Rover
from nxtdrive.tools.monitor import watch
from nxtdrive.transports.sim import SimTransport
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.simulation import Simulation

SLOW = pytest.mark.parametrize("latency_ms", [45, 150, 300])
BOX = '[[boxes]]\nname = "crate"\nat_mm = [{x_mm}, 1500]\nsize_mm = [100, 400]\nheight_mm = 300\n'


class Listening(SimTransport):
    """A link that notes what is sent, and when."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.sent = []

    def send(self, telegram):
        self.sent.append((self.now(), telegram))
        super().send(telegram)

    def times(self, command):
        return [time_s for time_s, telegram in self.sent if telegram[1] == command.opcode]


class Bunching(Listening):
    """A radio link with gaps: telegrams without a reply arrive together with the next request."""

    held = b""

    def send(self, telegram):
        if telegram[0] & NO_REPLY:
            self.held = telegram
            return
        if self.held:
            super().send(self.held)
            self.held = b""
        super().send(telegram)


@SLOW
def test_a_sensor_is_asked_once_more_however_slow_the_link(latency_ms):
    transport = Bunching(Simulation("open"), latency_ms=latency_ms)
    with Brick(transport) as brick:
        sonar = brick.ultrasonic(4)
        sonar.set_up()
        before = len(transport.times(LSWrite))
        sonar.read(0x42, 1)
        assert len(transport.times(LSWrite)) - before == 1, "the first question came too early, the second did not"


@SLOW
def test_a_crate_right_ahead_keeps_the_robot_from_starting(lab, latency_ms):
    room = lab(BOX.format(x_mm=1330), latency_ms=latency_ms)
    assert Rover(room.brick.link).straight(500).stop == "obstacle"
    assert room.simulation.truth.pose.x_mm == pytest.approx(1000, abs=1)


@SLOW
def test_a_crate_on_the_way_ends_the_drive_by_sonar(lab, latency_ms):
    room = lab(BOX.format(x_mm=3000), latency_ms=latency_ms)
    assert Rover(room.brick.link).straight(2500).stop == "obstacle"


@SLOW
def test_a_move_ends_as_soon_as_two_looks_agree(latency_ms):
    transport = Listening(Simulation("open"), latency_ms=latency_ms)
    with Brick(transport) as brick:
        brick.motor("A").run_angle(500, 200)
        braked = transport.times(SetOutputState)[-2]  # the last one holds the motor when all is done
        assert transport.times(SetOutputState)[-1] - braked <= 3 * latency_ms / 1000 + 0.01


def test_a_brake_is_sent_at_its_time_while_a_request_waits():
    transport = Listening(Simulation("open"), latency_ms=300)
    with Brick(transport) as brick:
        brick.link.keep_alive()
        brick.link.repeat("earlier", KeepAlive(), 0.02)
        brake_s = brick.now() + 0.05
        Lease(brick.link, OutputPort.A).brake_at(brake_s)
        brick.request(GetBatteryLevel())
        assert transport.times(SetOutputState) == [pytest.approx(brake_s, abs=0.002)]


def test_an_unchanged_speed_is_sent_again_only_after_half_the_lease():
    transport = Listening(Simulation("open"))
    with Brick(transport) as brick:
        lease = Lease(brick.link, OutputPort.A, 0.6)
        begun_s = brick.now()
        for _ in range(7):
            lease.drive(300)
            brick.sleep(0.1)
        assert [time_s - begun_s for time_s in transport.times(IOMapWrite)] == pytest.approx([0, 0.3, 0.6], abs=0.002)


class Faltering(Listening):
    """A link that takes a command to a motor only after a while, the first time."""

    def send(self, telegram):
        if telegram[1] == IOMapWrite.opcode and not self.times(IOMapWrite):
            self.sleep(0.8)
        super().send(telegram)


def test_a_wheel_whose_command_came_late_is_not_stalled():
    with Brick(Faltering(Simulation("open"))) as brick:
        assert brick.motor("A").run_angle(500, 200) == "done"


def test_a_wheel_that_is_held_is_stalled_however_late_its_command_came():
    simulation = Simulation("open")
    simulation.brick.attach_motor("A", BenchMotor(locked=True))
    with Brick(Faltering(simulation)) as brick:
        begin = brick.now()
        assert brick.motor("A").run_angle(500, 200) == "stalled"
        assert brick.now() - begin < 2


@SLOW
@pytest.mark.parametrize("angle_deg", [5, 15, 30, 90, 360])
def test_an_angle_is_reached_however_slow_the_link(lab, latency_ms, angle_deg):
    room = lab(latency_ms=latency_ms)
    assert room.brick.motor("A").run_angle(500, angle_deg) == "done"
    room.brick.sleep(1)
    assert room.output("A").rotation == pytest.approx(angle_deg, abs=2)


class Starving(SimTransport):
    """A computer that now and then does something else before it sends a telegram.

    Attributes:
        share: Of telegrams that are late.
        pauses_s: By how much, from and to.
    """

    def __init__(self, simulation, seed, share, pauses_s):
        super().__init__(simulation)
        self.random, self.share, self.pauses_s = random.Random(seed), 0.0, pauses_s
        self.starves = share

    def send(self, telegram):
        if self.random.random() < self.share:
            self.simulation.advance(round(1000 * self.random.uniform(*self.pauses_s)))
        super().send(telegram)

    def move(self, speed_deg_s, angle_deg):
        """How a motor's move ends, and where the motor is, once all is at rest."""
        with Brick(self, timeout_s=5) as brick:
            self.share = self.starves
            stop = brick.motor("A").run_angle(speed_deg_s, angle_deg)
            self.share = 0.0
            brick.sleep(1)
            return stop, self.simulation.brick.output.outputs[0].control.rotation


@pytest.mark.slow
@pytest.mark.parametrize("angle_deg", [90, pytest.param(720, marks=pytest.mark.nightly)])
def test_a_computer_that_falters_does_not_end_a_move_short_or_long(angle_deg):
    errors_deg = []
    for seed in range(40):
        stop, angle = Starving(Simulation("open"), seed, 0.02, (0.1, 0.5)).move(900, angle_deg)
        assert stop == "done"
        errors_deg.append(abs(angle - angle_deg))
    errors_deg.sort()
    assert errors_deg[38] <= 2
    assert errors_deg[-1] <= 15


@pytest.mark.parametrize("seed", range(10))
def test_a_move_that_did_not_come_there_does_not_say_so(seed):
    stop, angle = Starving(Simulation("open"), seed, 0.1, (0.5, 3.0)).move(900, 360)
    assert stop == ("done" if abs(angle - 360) <= 15 else "timeout")


@pytest.mark.parametrize(("latency_ms", "period_s"), [(2, 0.25), (45, 8 * 0.045)])
def test_the_monitor_reads_at_the_given_interval_or_as_fast_as_the_link_allows(lab, latency_ms, period_s):
    brick = lab(latency_ms=latency_ms).brick
    snapshots = watch(brick, {}, 0.25)
    first, *_, last = [next(snapshots) for _ in range(5)]
    assert (last.time_s - first.time_s) / 4 == pytest.approx(period_s, abs=0.005)


@pytest.mark.parametrize(("max_telegram", "limit_s"), [(64, 1.0), (128, 2.0)])
def test_radio_links_get_more_time_unless_it_is_specified(max_telegram, limit_s):
    transport = SimTransport(Simulation("open"))
    transport.max_telegram = max_telegram
    with Brick(transport) as brick:
        assert brick.link.timeout_s == limit_s
    with Brick(SimTransport(Simulation("open")), timeout_s=0.3) as brick:
        assert brick.link.timeout_s == 0.3


@SLOW
def test_the_range_takes_one_round_trip_even_when_the_safety_stop_has_just_asked(latency_ms):
    with Brick(SimTransport(Simulation("open"), latency_ms=latency_ms)) as brick:
        rover = Rover(brick.link)
        rover.range_mm()
        took_s = []
        for _ in range(6):
            rover.drive(50, 0)
            brick.sleep(0.05)
            begun_s = brick.now()
            rover.range_mm()
            took_s.append(brick.now() - begun_s)
    assert max(took_s) < 1.5 * latency_ms / 1000
