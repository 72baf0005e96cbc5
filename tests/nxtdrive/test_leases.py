"""How far motors and robot go when no more commands come; with real processes where processes die."""

import json
import random
import signal
import subprocess
import sys

import pytest

from firmware_protocol.direct import GetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError, LocalProtocolError
from nxtdrive import open_brick
from nxtdrive.motion.lease import LEASE_S, Lease
from nxtdrive.motion.motor import MotorSettings
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S
from nxtdrive.motion.rover import ROUND_TRIPS, DriveSettings, Rover, SafetyLimits
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.link import LinkFaults

LINKS = pytest.mark.parametrize("latency_ms", [2, 45])
SLOW = pytest.mark.parametrize("latency_ms", [80, 100, 150, 300])
UNGUARDED = SafetyLimits(enabled=False)
FOR_EVER_MS = 10**9
COAST_S = 0.2
"""A motor that is let go covers less than its speed times this: 100 ms until PWM is off, then 150 ms of inertia."""
ROLL_OUT_S = 0.9
"""And it stands after this time."""
MOTIONS = pytest.mark.parametrize("motion", ["drive", "straight"])
MM_PER_DEG = 0.4887
"""Of a wheel of 56 mm."""
FASTEST_DEG_S = 860
"""A free motor at 8 V."""


@pytest.fixture(params=["stepped", "threaded"])
def way(request):
    """Both ways of driving the link."""
    return request.param


def until_rest(room, where):
    """How far it goes on, and for how long."""
    begin, begun_ms = where(), room.simulation.now_ms
    place, moved_ms = begin, begun_ms
    while room.simulation.now_ms < moved_ms + 1000:
        room.simulation.advance(10)
        if where() != place:
            place, moved_ms = where(), room.simulation.now_ms
    return abs(place - begin), (moved_ms - begun_ms) / 1000


@LINKS
@pytest.mark.parametrize("power", [40, 75, 100])
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("lease_s", [LEASE_S, 0.3])
def test_a_cut_link_ends_a_motors_turn_within_its_lease(lab, latency_ms, power, seed, lease_s):
    cut_ms = random.Random(seed).randrange(1000, 2000)
    room = lab(latency_ms=latency_ms, faults=LinkFaults(unplugged_ms=((cut_ms, FOR_EVER_MS),)))
    room.brick.motor("A", settings=MotorSettings(lease_s=lease_s)).dc(power)
    with pytest.raises(LinkError):
        room.brick.sleep(5)
    distance_deg, time_s = until_rest(room, lambda: room.output("A").rotation)
    lease_deg = power / 100 * FULL_SPEED_DEG_S * lease_s
    assert 0 < distance_deg <= lease_deg + power / 100 * FASTEST_DEG_S * COAST_S
    assert time_s <= 1.3 * lease_s + ROLL_OUT_S


@LINKS
@pytest.mark.parametrize("firmware", ["1.29", "1.05"])
@pytest.mark.parametrize("move", [lambda motor: motor.run(600), lambda motor: motor.run_angle(600, 5000, wait=False)])
def test_other_motions_of_a_motor_are_leased_as_well(lab, latency_ms, firmware, move):
    room = lab(latency_ms=latency_ms, firmware=firmware)
    move(room.brick.motor("A"))
    room.brick.sleep(1.7)
    distance_deg, _ = until_rest(room, lambda: room.output("A").rotation)
    assert 100 < distance_deg <= 600 * (LEASE_S + COAST_S) + 50


@LINKS
@pytest.mark.parametrize("sign", [1, -1])
def test_a_program_that_dies_lets_a_motor_turn_to_its_goal_at_most_and_coast(lab, latency_ms, sign):
    room = lab(latency_ms=latency_ms)
    room.brick.motor("A").run_angle(600, sign * 400, wait=False)
    while abs(room.output("A").rotation) < 200:
        room.brick.sleep(0.01)
    until_rest(room, lambda: room.output("A").rotation)
    assert 200 < sign * room.output("A").rotation <= 400 + 600 * COAST_S


def test_a_motor_whose_next_command_does_not_come_stops_within_its_lease(lab):
    room = lab()
    room.brick.motor("A").run(300)
    room.brick.sleep(1)
    room.brick.link.motions.claim([OutputPort.A])
    room.brick.sleep(LEASE_S + ROLL_OUT_S)
    assert not room.output("A").actual_speed


@pytest.mark.parametrize("latency_ms", [2, 45, 150])
@pytest.mark.parametrize("lease_s", [LEASE_S, 0.3])
@pytest.mark.parametrize("speed_mm_s", [100, 300])
def test_a_robot_whose_program_has_died_stands_within_its_lease(lab, latency_ms, lease_s, speed_mm_s):
    room = lab(latency_ms=latency_ms)
    rover = Rover(room.brick.link, safety=UNGUARDED, settings=DriveSettings(lease_s=lease_s))
    for _ in range(20):
        rover.drive(speed_mm_s, 0)
        room.brick.sleep(0.07)
    distance_mm, time_s = until_rest(room, lambda: round(room.simulation.truth.pose.x_mm, 1))
    under_way_s = latency_ms / 2000
    assert 0 < distance_mm <= speed_mm_s * (lease_s + COAST_S + under_way_s) * 1.05
    assert time_s <= 1.3 * lease_s + ROLL_OUT_S + under_way_s


def drive_and_look(room, rover, speed_mm_s, duration_s):
    """What a mission does: look ahead, feel, reckon, drive on."""
    end = room.brick.now() + duration_s
    while room.brick.now() < end:
        rover.range_mm()
        rover.touching()
        rover.pose()
        room.brick.sleep(0.05)
        assert rover.drive(speed_mm_s, 0) is None


@SLOW
@pytest.mark.parametrize("lease_s", [LEASE_S, 0.3])
def test_a_robot_does_not_falter_between_two_calls_over_a_slow_link(lab, latency_ms, lease_s):
    room = lab(latency_ms=latency_ms)
    rover = Rover(room.brick.link, settings=DriveSettings(lease_s=lease_s))
    drive_and_look(room, rover, 100, 2)
    begin, begun_ms = room.simulation.truth.pose.x_mm, room.simulation.now_ms
    drive_and_look(room, rover, 100, 8)
    speed_mm_s = (room.simulation.truth.pose.x_mm - begin) / (room.simulation.now_ms - begun_ms) * 1000
    assert speed_mm_s == pytest.approx(100, rel=0.05)


@SLOW
def test_a_slow_link_does_not_keep_a_robot_going_without_new_calls(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    rover = Rover(room.brick.link)
    drive_and_look(room, rover, 100, 3)
    begin = room.simulation.truth.pose.x_mm
    for _ in range(100):  # the program lives, and asks
        rover.pose()
    distance_mm = room.simulation.truth.pose.x_mm - begin
    assert distance_mm <= 100 * (ROUND_TRIPS * latency_ms / 1000 + LEASE_S + COAST_S) * 1.05


def test_a_computer_that_slept_does_not_start_the_robot_again(lab):
    room = lab(latency_ms=150)
    drive_and_look(room, Rover(room.brick.link), 100, 3)
    room.simulation.advance(5000)
    begin = room.simulation.truth.pose.x_mm
    room.brick.sleep(2)
    assert room.simulation.truth.pose.x_mm == pytest.approx(begin, abs=1)


@pytest.mark.parametrize("lease_s", [0.1, 60])
def test_leases_beyond_reason_are_refused(lab, lease_s):
    with pytest.raises(LocalProtocolError, match="lease_s"):
        MotorSettings(lease_s=lease_s)
    with pytest.raises(LocalProtocolError, match="lease_s"):
        Rover(lab().brick.link, settings=DriveSettings(lease_s=lease_s))


@LINKS
@pytest.mark.parametrize("start", [lambda motor: motor.run(300), lambda motor: motor.dc(40)])
def test_a_motor_that_is_held_is_braked_while_the_program_lives(lab, latency_ms, start):
    """It never uses its lease up."""
    room = lab(latency_ms=latency_ms)
    room.attach("A", BenchMotor(locked=True))
    start(room.brick.motor("A"))
    room.brick.sleep(2)
    assert (room.output("A").actual_speed, room.output("A").brake) == (0, True)


# --- real processes ---

PROGRAM = """
import signal
import sys
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # the parent process may ignore it
from nxtdrive import DriveSettings, SafetyLimits, open_brick
from firmware_protocol.direct import GetOutputState
from firmware_protocol.enums import OutputPort
with open_brick(sys.argv[1], timeout_s=5) as brick:
    rover = brick.rover(safety=SafetyLimits(enabled=False))
    move = rover.straight(8000, wait=False) if sys.argv[2] == "straight" else None
    for number in range(1000):
        if move is None:
            rover.drive(150, 0)
        elif number == 20:
            move.join()
        brick.sleep(0.05)
        print(brick.request(GetOutputState(OutputPort.B)).rotation_count, flush=True)
"""


@pytest.fixture
def served(started, tmp_path):
    """The address of a simulated brick in a process of its own, in real time."""
    server = started("sim", "serve", "--pty", tmp_path / "nxt", "--world", "open", "--json")
    assert json.loads(server.stdout.readline())["event"] == "serving"
    return f"serial://{tmp_path / 'nxt'}"


def die_driving(address, motion, number):
    """A program drives until it gets that signal; returns its exit code."""
    program = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, address, motion],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    for _ in range(20):
        last = int(program.stdout.readline())
    assert last > 50
    program.send_signal(number)
    program.communicate(timeout=30)
    return program.returncode


def count(brick):
    return brick.request(GetOutputState(OutputPort.B)).rotation_count


@pytest.mark.slow
@MOTIONS
def test_a_killed_program_leaves_a_robot_that_stops(served, motion):
    assert die_driving(served, motion, signal.SIGKILL) == -signal.SIGKILL
    with open_brick(served, timeout_s=5) as brick:
        before = count(brick)
        brick.sleep(2.5)
        stopped = count(brick)
        brick.sleep(0.5)
        assert count(brick) == stopped
        assert stopped - before <= 200 / MM_PER_DEG * (LEASE_S + COAST_S) * 1.05


@pytest.mark.slow
@MOTIONS
@pytest.mark.parametrize(
    ("number", "code"),
    [
        (signal.SIGTERM, 128 + signal.SIGTERM),
        pytest.param(signal.SIGHUP, 128 + signal.SIGHUP, marks=pytest.mark.nightly),
        (signal.SIGINT, -2),
    ],
)
def test_a_program_that_gets_a_signal_brakes_before_it_ends(served, motion, number, code):
    assert die_driving(served, motion, number) == code
    with open_brick(served, timeout_s=5) as brick:
        state = brick.request(GetOutputState(OutputPort.B))
        brick.sleep(0.5)
        assert (state.power, count(brick) - state.rotation_count) == (0, 0)


@pytest.mark.slow
def test_a_motion_continues_beside_the_program_on_a_real_clock(served):
    """How exactly it ends depends there on how busy this computer is; that is measured in virtual time."""
    with open_brick(served, timeout_s=5) as brick:
        motors = [brick.motor(port) for port in ("A", "B")]
        moves = [motor.run_angle(500, 270, wait=False) for motor in motors]
        while not all(move.done for move in moves):
            assert brick.battery_v > 5
        assert {move.join() for move in moves} <= {"done", "timeout"}
        assert all(motor.angle > 135 for motor in motors)


@pytest.mark.parametrize("brake", [Lease.brake, lambda lease: lease.brake_at(0.0)], ids=["now", "at a time"])
def test_a_motor_that_was_braked_turns_again_at_the_same_speed(lab, brake):
    room = lab()
    lease = Lease(room.brick.link, OutputPort.A, 0.6)
    lease.drive(600)
    brake(lease)
    room.brick.sleep(0.1)
    lease.drive(600)
    room.brick.sleep(0.6)
    assert room.output("A").actual_speed


@pytest.mark.parametrize("sign", [1, -1])
def test_a_speed_beyond_the_motors_is_its_full_speed(lab, sign):
    room = lab()
    lease = Lease(room.brick.link, OutputPort.A)
    lease.drive(sign * 5000)
    assert lease.power == sign * 100


def forwards(rover, brick):
    for _ in range(10):
        rover.drive(200, 0)
        brick.sleep(0.1)


def motors(rover, brick):
    for port in "BC":
        brick.motor(port).run(400)
    brick.sleep(1)


def motors_after_a_drive(rover, brick):
    rover.straight(50)
    motors(rover, brick)


@pytest.mark.parametrize("latency_ms", [2, 150])
@pytest.mark.parametrize("before", [forwards, motors, motors_after_a_drive])
def test_driving_at_speed_0_stops_the_robot_and_ends_what_was_renewed(lab, latency_ms, before):
    room = lab(latency_ms=latency_ms)
    rover = Rover(room.brick.link, safety=UNGUARDED)
    before(rover, room.brick)
    assert room.simulation.truth.speed_mm_s > 100
    rover.drive(0, 0)
    room.brick.sleep(0.4)
    stood = room.output("B").rotation
    room.brick.sleep(1.0)
    assert room.output("B").rotation == pytest.approx(stood, abs=2)
