"""A single motor: leases, positions, stalls."""

import math

import pytest

from behaviors.ports import StopReason
from firmware_protocol.direct import GetOutputState, SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from firmware_protocol.errors import LinkTimeout, LocalProtocolError
from nxtdrive.motion.motor import MotorSettings, Then
from nxtdrive.motion.stall import STALL_S
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.link import LinkFaults

FIRMWARES = pytest.mark.parametrize("firmware", ["1.29", "1.05"])


@pytest.fixture(params=["stepped", "threaded"])
def way(request):
    """Both ways of driving the link."""
    return request.param


def rotation(brick, port=OutputPort.A):
    return brick.request(GetOutputState(port)).rotation_count


@FIRMWARES
@pytest.mark.parametrize("speed_deg_s", [500, -500, 120])
def test_renewing_the_lease_does_not_disturb_regulation(lab, firmware, speed_deg_s):
    """A leased motor turns exactly as one with a single command and no limit."""
    leased, free = lab(firmware=firmware), lab(firmware=firmware)
    leased.brick.motor("A").run(speed_deg_s)
    power = round(speed_deg_s * 0.101)
    mode = OutputMode.MOTOR_ON | OutputMode.BRAKE | OutputMode.REGULATED
    free.brick.request(SetOutputState(OutputPort.A, power, mode, RegulationMode.SPEED, 0, RunState.RUNNING, 0))
    for _ in range(10):
        leased.brick.sleep(1)
        free.simulation.advance(leased.simulation.now_ms - free.simulation.now_ms)
        assert leased.output("A").rotation == free.output("A").rotation


def test_slow_motion_continues_as_long_as_it_is_renewed(lab):
    room = lab()
    motor = room.brick.motor("A")
    motor.run(20)
    room.brick.sleep(10)
    assert motor.angle == pytest.approx(200, abs=30)


@pytest.mark.parametrize("latency_ms", [1, 2, 45, 90])
@pytest.mark.parametrize(
    ("speed_deg_s", "angle_deg"), [(360, 720), (800, 1000), (360, -90), (100, 30), (600, 5), (200, 0)]
)
def test_an_angle_is_reached_and_held(lab, latency_ms, speed_deg_s, angle_deg):
    room = lab(latency_ms=latency_ms)
    motor = room.brick.motor("A")
    assert motor.run_angle(speed_deg_s, angle_deg) is StopReason.DONE
    room.brick.sleep(1)
    assert motor.angle == pytest.approx(angle_deg, abs=3)


@pytest.mark.parametrize("latency_ms", [2, 45])
@pytest.mark.parametrize(("speed_deg_s", "angle_deg"), [(10, 90), (14, 60), (20, -90), (35, 120)])
def test_an_angle_is_reached_slowly_and_in_one_go(lab, latency_ms, speed_deg_s, angle_deg):
    room = lab(latency_ms=latency_ms)
    motor, begun_s = room.brick.motor("A"), room.brick.now()
    assert motor.run_angle(speed_deg_s, angle_deg) is StopReason.DONE
    assert room.brick.now() - begun_s == pytest.approx(abs(angle_deg) / speed_deg_s, rel=0.6, abs=1)
    assert motor.angle == pytest.approx(angle_deg, abs=3)


def test_without_a_limit_of_acceleration_an_angle_is_as_exact(lab):
    motor = lab().brick.motor("A", settings=MotorSettings(acceleration_deg_s2=math.inf))
    assert motor.run_angle(900, 360) is StopReason.DONE
    assert motor.angle == pytest.approx(360, abs=3)


def test_signs_of_speed_and_angle_multiply(lab):
    motor = lab().brick.motor("A")
    motor.run_angle(-300, 90)
    assert motor.angle == pytest.approx(-90, abs=3)
    motor.run_angle(-300, -90)
    assert motor.angle == pytest.approx(0, abs=5)


def test_targets_are_angles_since_the_reset_and_the_bricks_counter_continues(lab):
    room = lab()
    motor = room.brick.motor("A")
    motor.run_angle(400, 180)
    motor.reset_angle(1000)
    assert motor.angle == 1000
    assert rotation(room.brick) == pytest.approx(180, abs=3)
    motor.run_target(400, 1090)
    assert motor.angle == pytest.approx(1090, abs=3)
    with pytest.raises(LocalProtocolError, match="angle_deg must be"):
        motor.reset_angle(math.nan)


@pytest.mark.parametrize("latency_ms", [2, 45])
@pytest.mark.parametrize("target_deg", [1500, -500])
def test_a_target_is_reached_from_a_turning_motor(lab, latency_ms, target_deg):
    room = lab(latency_ms=latency_ms)
    motor = room.brick.motor("A")
    motor.run(600)
    room.brick.sleep(1)
    assert motor.run_target(600, target_deg) is StopReason.DONE
    room.brick.sleep(1)
    assert motor.angle == pytest.approx(target_deg, abs=3)


def test_a_reversed_motor_turns_the_other_way(lab):
    room = lab()
    motor = room.brick.motor("A", reversed=True)
    motor.run_angle(400, 90)
    assert motor.angle == pytest.approx(90, abs=3)
    assert rotation(room.brick) == pytest.approx(-90, abs=3)
    motor.run(300)
    room.brick.sleep(1)
    assert motor.speed() == pytest.approx(300, abs=40)


@pytest.mark.parametrize("acceleration_deg_s2", [None, 100])
@pytest.mark.parametrize("duration_s", [0.06, 1.36])
def test_a_time_is_kept(lab, duration_s, acceleration_deg_s2):
    room = lab()
    motor = room.brick.motor("A", settings=MotorSettings(acceleration_deg_s2=acceleration_deg_s2))
    began = room.simulation.time_s
    motor.run_time(500, duration_s, Then.COAST)
    assert room.simulation.time_s - began == pytest.approx(duration_s, abs=0.02)
    room.brick.sleep(1.5)
    assert motor.speed() == 0


def test_coasting_braking_and_holding_differ(lab):
    angles = {}
    for then in Then:
        room = lab()
        motor = room.brick.motor("A")
        motor.run(800)
        room.brick.sleep(1)
        before = motor.angle
        {Then.COAST: motor.stop, Then.BRAKE: motor.brake, Then.HOLD: motor.hold}[then]()
        room.brick.sleep(2)
        angles[then] = motor.angle - before
        assert motor.speed() == 0
    assert angles[Then.COAST] > 3 * angles[Then.BRAKE]
    assert angles[Then.HOLD] <= angles[Then.BRAKE]


def test_a_held_motor_comes_back(lab):
    room = lab()
    plant = room.attach("A", BenchMotor())
    motor = room.brick.motor("A")
    motor.hold()
    room.brick.sleep(0.5)
    plant.turn(60)
    room.brick.sleep(2)
    assert abs(motor.angle) <= 5


@pytest.mark.parametrize("stall_s", [STALL_S, None])
def test_a_motor_that_runs_takes_few_requests(lab, mocker, stall_s):
    room = lab()
    link = room.brick.link
    sent = mocker.spy(type(link.transport), "send")
    link.use(link.transport)
    room.brick.motor("A", settings=MotorSettings(stall_s=stall_s)).run(300)
    room.brick.sleep(4)
    assert 4 < sent.call_count <= 4 * 10


def test_a_motor_of_a_silent_brick_is_an_error_at_once(lab):
    motor = lab(faults=LinkFaults(silent_ms=((0, 10**9),))).brick.motor("A", settings=MotorSettings(stall_s=None))
    with pytest.raises(LinkTimeout):
        motor.run(300)
    assert motor.done


def test_a_blocked_motor_is_a_stall_and_not_a_hang(lab):
    room = lab()
    room.attach("A", BenchMotor(locked=True))
    motor = room.brick.motor("A")
    assert motor.run_angle(300, 360) is StopReason.STALLED
    assert room.simulation.time_s < 3
    assert not motor.stalled(), "it is not meant to turn"
    motor.run(300)
    room.brick.sleep(0.5)
    assert motor.stalled()


def test_a_motor_that_is_too_weak_times_out(lab):
    room = lab()
    room.attach("A", BenchMotor(gain=20))
    assert room.brick.motor("A").run_angle(500, 360) is StopReason.TIMEOUT


def test_a_motor_that_is_turned_from_outside_when_it_should_rest_times_out(lab):
    room = lab()
    plant = room.attach("A", BenchMotor())
    for time_ms in range(0, 30_000, 5):
        room.simulation.at(time_ms, lambda: plant.turn(1))
    assert room.brick.motor("A").run_angle(500, 90) is StopReason.TIMEOUT
    assert room.simulation.time_s < 10
