"""Motions in the background: several at once, cancelled, lost; and what limits them."""

import contextlib
import gc
import itertools
import threading
import traceback
import weakref
from pathlib import Path

import pytest

from behaviors.ports import StopReason
from firmware_protocol.direct import SetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import BrickError, LinkError, LinkTimeout, LocalProtocolError
from nxtdrive.brick import Brick
from nxtdrive.link.interrupting import interruptible
from nxtdrive.motion.motor import MotorSettings, Then
from nxtdrive.motion.outputs import coasting
from nxtdrive.motion.rover import Rover, SafetyLimits
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.link import LinkFaults

LINKS = pytest.mark.parametrize("latency_ms", [2, 45])
UNGUARDED = SafetyLimits(enabled=False)
FOR_EVER_MS = 10**9
BOX_AHEAD = '[[boxes]]\nname = "box"\nat_mm = [2500, 1500]\nsize_mm = [200, 1000]\nheight_mm = 300\n'


@pytest.fixture(params=["stepped", "threaded"])
def way(request):
    """Both ways of driving the link."""
    return request.param


@LINKS
def test_a_motion_continues_while_the_program_sleeps_or_asks(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    motor = room.brick.motor("A")
    move = motor.run_angle(500, 360, wait=False)
    assert not move.done
    assert not motor.done
    while not move.done:
        assert room.brick.battery_v
        room.brick.sleep(0.005)
        assert room.simulation.time_s < 5
    assert (move.join(), motor.join()) == (StopReason.DONE, StopReason.DONE)
    room.brick.sleep(0.5)
    assert room.output("A").rotation == pytest.approx(360, abs=3)


def test_a_motion_to_an_angle_and_a_curve_continue_in_the_background(lab):
    room = lab()
    motor = room.brick.motor("A")
    target = motor.run_target(-500, 200, wait=False)
    assert not target.done
    assert target.join() is StopReason.DONE
    assert motor.angle == pytest.approx(200, abs=3)
    curve = Rover(room.brick.link, safety=UNGUARDED).curve(200, 90, wait=False)
    assert not curve.done
    result = curve.join()
    assert (result.stop, result.turned_deg) == (StopReason.DONE, pytest.approx(90, abs=3))


@LINKS
@pytest.mark.parametrize("busy", [False, True])
def test_three_motors_at_once_come_each_to_its_goal(lab, latency_ms, busy):
    room = lab(latency_ms=latency_ms)
    goals = {"A": 540, "B": -360, "C": 123}
    moves = [room.brick.motor(port).run_angle(600, goal, wait=False) for port, goal in goals.items()]
    while busy and not all(move.done for move in moves):
        assert room.brick.battery_v
    assert {move.join() for move in moves} == {StopReason.DONE}
    assert room.simulation.time_s < 8
    room.simulation.advance(1000)
    for port, goal in goals.items():
        assert room.output(port).rotation == pytest.approx(goal, abs=5)


def test_a_new_command_cancels_the_old_motion(lab):
    room = lab()
    motor = room.brick.motor("A")
    first = motor.run_angle(500, 3000, wait=False)
    room.brick.sleep(1)
    assert motor.run_target(500, 100) is StopReason.DONE
    assert first.join() is StopReason.CANCELLED
    assert room.output("A").rotation == pytest.approx(100, abs=3)


@pytest.mark.parametrize("end", ["stop", "brake", "hold"])
def test_stopping_cancels_a_motion(lab, end):
    room = lab()
    motor = room.brick.motor("A")
    move = motor.run_angle(500, 3000, wait=False)
    room.brick.sleep(1)
    getattr(motor, end)()
    assert move.join() is StopReason.CANCELLED
    room.brick.sleep(1)
    assert motor.speed() == 0
    assert room.output("A").rotation < 1000


@pytest.mark.parametrize("way", ["threaded"])
@pytest.mark.parametrize("latency_ms", [45, 150])
@pytest.mark.parametrize(
    "begin", [lambda motor: motor.run(300), lambda motor: motor.run_angle(300, 9000, wait=False)], ids=["run", "angle"]
)
def test_a_stop_goes_before_the_next_step_of_motions_that_keep_the_link_busy(lab, latency_ms, begin):
    room = lab(latency_ms=latency_ms)
    motors = [room.brick.motor(port) for port in "ABC"]
    for motor in motors:
        begin(motor)
    room.brick.sleep(1)
    for motor in motors:
        begun_s = room.brick.now()
        motor.stop()
        assert room.brick.now() - begun_s < 2.5 * latency_ms / 1000, "one request in progress, and its own"


@pytest.mark.parametrize(
    "begin",
    [lambda motor: motor.run_angle(500, 3000, wait=False), lambda motor: motor.run_time(500, 6, wait=False)],
    ids=["angle", "time"],
)
def test_a_cancelled_motion_brakes(lab, begin):
    room = lab()
    move = begin(room.brick.motor("A"))
    room.brick.sleep(1)
    move.cancel()
    move.cancel()
    before = room.output("A").rotation
    room.brick.sleep(0.5)
    assert room.output("A").rotation - before < 15


@pytest.mark.parametrize("end", [lambda rover: rover.stop(), lambda rover: rover.drive(0, 0)])
def test_a_drive_without_waiting_can_be_ended(lab, end):
    room = lab()
    rover = Rover(room.brick.link, safety=UNGUARDED)
    move = rover.straight(3000, wait=False)
    room.brick.sleep(1)
    assert not rover.done
    end(rover)
    motion = move.join()
    assert (rover.done, motion.stop) == (True, StopReason.CANCELLED)
    assert 50 < motion.distance_mm < 300
    room.brick.sleep(0.5)
    assert room.simulation.truth.speed_mm_s < 1


@LINKS
def test_a_drive_without_waiting_ends_by_itself_and_can_be_asked_meanwhile(lab, latency_ms):
    room = lab(BOX_AHEAD, latency_ms=latency_ms)
    rover = Rover(room.brick.link)
    move = rover.straight(500, wait=False)
    seen = []
    while not move.done:
        seen.append(rover.pose().x_mm)
        assert rover.range_mm() > 500
        assert not rover.touching()
    # a wheel that is braked swings back by a few degrees, and then the goal is approached again
    assert all(after - before > -3 for before, after in itertools.pairwise(seen))
    assert move.join().distance_mm == pytest.approx(500, abs=10)


def test_one_wheel_taken_away_ends_the_rovers_motion_and_brakes_the_other(lab):
    room = lab()
    move = Rover(room.brick.link, safety=UNGUARDED).straight(3000, wait=False)
    room.brick.sleep(1)
    room.brick.motor("B").run(-200)
    assert move.join().stop is StopReason.CANCELLED
    assert room.output("C").actual_speed == 0


def test_joining_a_motion_that_has_failed_again_raises_its_error_with_the_same_traceback(lab):
    room = lab(faults=LinkFaults(silent_ms=((1000, FOR_EVER_MS),)), timeout_s=0.3)
    move = room.brick.motor("A").run_angle(500, 3000, wait=False)
    room.brick.sleep(3)
    assert move.done
    frames = []
    for _ in range(3):
        with pytest.raises(LinkError) as raised:
            move.join()
        frames.append([(frame.f_code, line) for frame, line in traceback.walk_tb(raised.tb)])
    assert frames[0] == frames[1] == frames[2]
    assert "position_move.py" in {Path(code.co_filename).name for code, _ in frames[0]}, "where it failed"


def test_a_new_speed_replaces_the_old_one_without_a_brake(direct):
    with Brick(direct) as brick:
        motor = brick.motor("A")
        motor.run(300)
        motor.run(400)
        assert not [telegram for telegram in direct.sent if telegram[1] == SetOutputState.opcode]


@pytest.mark.parametrize("way", ["stepped"])  # the simulation raises it, in the thread that lets time pass
@pytest.mark.parametrize(
    "move", [lambda motor: motor.run_angle(500, 3000), lambda motor: motor.run_time(500, 6)], ids=["angle", "time"]
)
def test_an_interrupt_while_waiting_brakes(lab, move):
    room = lab()

    def interrupt():
        raise KeyboardInterrupt

    room.simulation.at(1000, interrupt)
    motor = room.brick.motor("A")
    with pytest.raises(KeyboardInterrupt):
        move(motor)
    assert motor.done
    room.simulation.advance(300)
    assert room.output("A").rotation < 600
    assert room.output("A").actual_speed == 0


@pytest.mark.parametrize("way", ["stepped"])  # as above
def test_an_interrupt_in_a_step_ends_the_motion_at_once(lab):
    room = lab(latency_ms=45)

    def interrupt():
        raise KeyboardInterrupt

    room.simulation.at(1000, interrupt)
    move = room.brick.motor("A").run_angle(500, 3000, wait=False)
    with pytest.raises(KeyboardInterrupt):
        room.brick.sleep(5)
    assert move.done
    with pytest.raises(KeyboardInterrupt):
        move.join()
    room.simulation.advance(300)
    assert room.output("A").actual_speed == 0


def test_a_motion_that_is_over_takes_no_memory(lab):
    motor = lab().brick.motor("A")
    motion = weakref.ref(motor.run_angle(500, 20, wait=False))
    motor.join()
    motor.run_angle(500, 20)
    gc.collect()
    assert motion() is None


@LINKS
@pytest.mark.parametrize("start", [lambda motor: motor.run(300), lambda motor: motor.dc(-50)])
def test_a_stall_is_an_outcome(lab, latency_ms, start):
    room = lab(latency_ms=latency_ms)
    room.attach("A", BenchMotor(locked=True))
    motor = room.brick.motor("A")
    start(motor)
    assert motor.join() is StopReason.STALLED
    assert room.simulation.time_s < 1.5
    assert motor.stalled()


def test_a_stall_on_the_way_is_seen_as_well(lab):
    room = lab()
    plant = room.attach("A", BenchMotor())
    room.simulation.at(1500, lambda: plant.configure(590, 60, 12, 150, 5, True))
    move = room.brick.motor("A").run_angle(500, 2000, wait=False)
    assert move.join() is StopReason.STALLED
    assert 2 < room.simulation.time_s < 3
    assert room.output("A").actual_speed == 0


def test_stall_detection_of_run_can_be_switched_off(lab):
    room = lab()
    room.attach("A", BenchMotor(locked=True))
    motor = room.brick.motor("A", settings=MotorSettings(stall_s=None))
    motor.run(300)
    room.brick.sleep(5)
    assert room.output("A").actual_speed
    assert motor.stalled()


def test_a_motor_that_is_told_to_stand_is_not_stalled(lab):
    room = lab()
    motor = room.brick.motor("A")
    motor.run(300)
    room.brick.sleep(1)
    motor.run(0)
    room.brick.sleep(2)
    assert not room.output("A").actual_speed
    assert not motor.done
    assert not motor.stalled()


def test_speed_is_limited(lab):
    room = lab()
    motor = room.brick.motor("A", settings=MotorSettings(speed_deg_s=200))
    motor.run(800)
    room.brick.sleep(2)
    assert motor.speed() == pytest.approx(200, abs=25)
    begun_s = room.simulation.time_s
    motor.run_angle(-800, 400)
    assert room.simulation.time_s - begun_s > 2


@pytest.mark.parametrize("sign", [1, -1])
def test_acceleration_is_limited(lab, sign):
    room = lab()
    motor = room.brick.motor("A", settings=MotorSettings(acceleration_deg_s2=200))
    motor.run(sign * 600)
    speeds = []
    for _ in range(8):
        room.brick.sleep(0.4)
        speeds.append(sign * motor.speed())
    assert all(after - before < 200 * 0.5 * 1.5 for before, after in itertools.pairwise(speeds))
    assert speeds[1] < 300
    assert speeds[-1] == pytest.approx(600, abs=50)


def test_a_motor_that_has_come_to_rest_accelerates_from_rest(lab):
    room = lab()
    motor = room.brick.motor("A", settings=MotorSettings(acceleration_deg_s2=300))
    motor.run_time(600, 3, Then.BRAKE)
    room.brick.sleep(0.5)
    motor.run(600)
    room.brick.sleep(0.5)
    assert motor.speed() < 300


@pytest.mark.parametrize(
    "edge",
    [
        {"speed_deg_s": 10},
        {"speed_deg_s": 900},
        {"acceleration_deg_s2": 1},
        {"stall_s": 0.3},
        {"lease_s": 0.3},
        {"lease_s": 10},
    ],
)
def test_the_ends_of_the_ranges_of_settings_are_accepted(edge):
    assert MotorSettings(**edge)


@pytest.mark.parametrize("wrong", [{"speed_deg_s": 1200}, {"acceleration_deg_s2": 0}, {"stall_s": 0}])
def test_limits_beyond_reason_are_refused(wrong):
    with pytest.raises(LocalProtocolError, match=next(iter(wrong))):
        MotorSettings(**wrong)


def test_a_time_can_be_left_to_itself(lab):
    room = lab()
    move = room.brick.motor("A").run_time(400, 1.5, Then.COAST, wait=False)
    room.brick.motor("B").run_time(-400, 0.5, wait=False)
    assert move.join() is StopReason.DONE
    assert room.simulation.time_s == pytest.approx(1.5, abs=0.05)
    assert room.output("B").rotation == pytest.approx(-180, abs=60)


# --- leases that would be renewed forever ---


@LINKS
def test_a_motor_whose_supervision_fails_is_not_kept_turning(lab, latency_ms):
    """Nothing would see a stall any more."""
    room = lab(latency_ms=latency_ms, faults=LinkFaults(silent_ms=((1000, 1800),)), timeout_s=0.3)
    motor = room.brick.motor("A")
    motor.run(300)
    with contextlib.suppress(LinkError):
        room.brick.sleep(4)
    assert motor.done
    assert not room.output("A").actual_speed
    with pytest.raises(LinkError):
        motor.join()


def test_a_motion_that_fails_to_begin_does_not_leave_its_motors_turning_as_before(lab):
    room = lab()
    motor = room.brick.motor("B")
    motor.run(300)
    room.brick.sleep(0.5)
    rover = Rover(room.brick.link, ultrasonic=2, touch=None)
    with pytest.raises(BrickError):
        rover.straight(300)
    room.brick.sleep(2)
    assert motor.done
    assert not room.output("B").actual_speed


def test_a_wheel_that_cannot_be_braked_does_not_keep_the_other_from_braking(direct):
    def refuse(telegram):
        if telegram[1:3] == bytes((SetOutputState.opcode, OutputPort.B)):
            direct.on_send = lambda _: None
            raise LinkTimeout("accepts no more telegrams.")

    with Brick(direct) as brick:
        rover = Rover(brick.link, ultrasonic=None, touch=None)
        rover.drive(100, 0)
        direct.on_send = refuse
        with pytest.raises(LinkTimeout):
            rover.stop()
        assert direct.sent[-1][1:4] == bytes((SetOutputState.opcode, OutputPort.C, 0))


def test_what_breaks_a_program_off_is_called_in_its_own_thread_and_brakes(lab):
    room = lab()
    threads = set()

    def break_off():
        threads.add(threading.get_ident())
        if room.simulation.time_s > 1:
            raise InterruptedError

    with pytest.raises(InterruptedError), interruptible(room.brick.link, break_off):
        room.brick.motor("A").run_angle(300, 3000)
    assert room.simulation.time_s < 1.3
    assert threads == {threading.get_ident()}
    room.brick.sleep(0.5)
    assert not room.output("A").actual_speed


def test_leaving_stops_each_motor_whatever_happens_with_the_others(direct):
    def refuse(telegram):
        if telegram[1:3] == bytes((SetOutputState.opcode, OutputPort.A)):
            raise LinkTimeout("accepts no more telegrams.")

    with Brick(direct) as brick:
        for port in "AB":
            brick.motor(port).hold()
        direct.on_send = refuse
    assert direct.sent[-1] == coasting(OutputPort.B).encode(want_reply=False)


@pytest.mark.parametrize("latency_ms", [20, 100, 150])
@pytest.mark.parametrize("pause_s", [0.0, 0.02, 0.1])
def test_a_program_that_polls_the_sonar_does_not_disable_the_safety_stop(lab, latency_ms, pause_s):
    room = lab(BOX_AHEAD, latency_ms=latency_ms)
    rover, sonar = room.brick.rover(), room.brick.ultrasonic(4)
    values, motion = [], rover.straight(3000, 150, wait=False)
    while not motion.done:
        values.append(sonar.distance_mm)
        room.brick.sleep(pause_s)
    assert motion.join().stop is StopReason.OBSTACLE
    room.brick.sleep(0.5)
    assert 330 < room.simulation.truth.distance_mm("box") < 600
    assert None not in values
    assert max(after - before for before, after in itertools.pairwise(values)) < 60, "the robot comes nearer"
