"""Play of the gears, carpets, a battery under load, a dead zone, and objects that absorb ultrasound."""

import math

import pytest

from firmware_protocol.direct import SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from sim_backend.simulation import Simulation
from sim_backend.world.motor import WheelMotor
from sim_backend.world.world_file import Box, WorldFile


def simulate(robot=(), **tables):
    return Simulation(
        WorldFile.model_validate(
            {
                "floor": {"size_mm": (4000, 3000)},
                "robot": {
                    "start_mm": (1000, 1500),
                    "slip": {"jitter_percent": 0},
                    "motor_mismatch_percent": 0,
                    **dict(robot),
                },
                "ultrasonic": {"noise_mm": 0.0},
                **tables,
            }
        )
    )


def turn(simulation, left, right, duration_ms):
    """Power the motors for a while, without the brick's firmware, which would regulate them."""
    robot = simulation.world.robot
    for _ in range(duration_ms // 10):
        for _ in range(10):
            robot.left.step(left, brake=True)
            robot.right.step(right, brake=True)
        simulation.world.step()


def driven_mm(simulation):
    return simulation.truth.pose.x_mm - 1000


def counted_mm(simulation):
    return simulation.world.robot.left.angle * 56 * math.pi / 360


@pytest.mark.parametrize("backlash_deg", [0, 4, 12])
def test_after_a_reversal_the_motor_turns_through_its_play_before_the_wheel_follows(backlash_deg):
    simulation = simulate({"backlash_deg": backlash_deg})
    turn(simulation, 40, 40, 1000)
    turn(simulation, 0, 0, 200)
    # at first the wheel is in the middle of the play
    assert counted_mm(simulation) - driven_mm(simulation) == pytest.approx(backlash_deg / 2 * 56 * math.pi / 360, abs=1)
    there, counted = driven_mm(simulation), counted_mm(simulation)
    turn(simulation, -40, -40, 1000)
    turn(simulation, 0, 0, 200)
    lost_mm = (counted - counted_mm(simulation)) - (there - driven_mm(simulation))
    assert lost_mm == pytest.approx(backlash_deg * 56 * math.pi / 360, abs=1)


def test_a_wheel_in_the_play_of_its_gears_does_not_drive_the_robot():
    simulation = simulate({"backlash_deg": 60})
    robot = simulation.world.robot
    while robot.left.angle < 25:
        turn(simulation, 20, 20, 10)
    assert driven_mm(simulation) == 0.0


def test_a_carpet_changes_slip_only_where_it_lies():
    carpet = {"at_mm": (2000, 1500), "size_mm": (1000, 1000), "slip": {"distance_percent": 30, "jitter_percent": 0}}
    simulation = simulate(carpets=[carpet])
    turn(simulation, 60, 60, 2000)
    before = driven_mm(simulation)
    assert before == pytest.approx(counted_mm(simulation), abs=4)
    while driven_mm(simulation) < 600:
        turn(simulation, 60, 60, 50)
    start, counted = driven_mm(simulation), counted_mm(simulation)
    turn(simulation, 60, 60, 1000)
    assert driven_mm(simulation) - start == pytest.approx(0.7 * (counted_mm(simulation) - counted), rel=0.02)


def test_on_a_carpet_without_grip_the_wheels_spin():
    carpet = {"at_mm": (1000, 1500), "size_mm": (500, 500), "grip": 0.005}
    simulation = simulate(carpets=[carpet])
    turn(simulation, 100, 100, 600)
    assert driven_mm(simulation) < 0.3 * counted_mm(simulation)


def test_the_pile_of_a_carpet_slows_the_motors():
    plain = simulate()
    deep = simulate(carpets=[{"at_mm": (1000, 1500), "size_mm": (1900, 1900), "drag_nm": 0.05}])
    for simulation in (plain, deep):
        turn(simulation, 50, 50, 1500)
    assert counted_mm(deep) < 0.85 * counted_mm(plain)


def test_the_upper_carpet_counts():
    lower = {"at_mm": (1000, 1500), "size_mm": (900, 900), "slip": {"distance_percent": 50}}
    upper = {"at_mm": (1000, 1500), "size_mm": (900, 900), "slip": {"distance_percent": 0, "jitter_percent": 0}}
    simulation = simulate(carpets=[lower, upper])
    turn(simulation, 40, 40, 1000)
    assert driven_mm(simulation) == pytest.approx(counted_mm(simulation), abs=4)


def test_the_current_of_the_motors_lowers_the_voltage():
    strong, weak = simulate(), simulate({"battery_ohm": 0.9})
    for simulation in (strong, weak):
        for port in (OutputPort.B, OutputPort.C):
            full = SetOutputState(port, 100, OutputMode.MOTOR_ON, RegulationMode.IDLE, 0, RunState.RUNNING, 0)
            simulation.deliver(full.encode())
        simulation.advance(100)
    assert weak.world.robot.left.free_speed < 0.9 * strong.world.robot.left.free_speed


def test_a_motor_that_begins_or_is_too_weak_for_the_carpet_draws_its_stall_current():
    beginning, weak = WheelMotor(), WheelMotor(battery_mv=3000)
    weak.drag(0.2)
    for motor in (beginning, weak):
        motor.step(100, brake=True)
    assert beginning.current_a == pytest.approx(2.06, abs=0.05)
    assert (weak.free_speed, weak.current_a) == (0.0, pytest.approx(2.06))


def test_a_battery_that_drains_slows_the_motors():
    fresh, draining = simulate(), simulate({"battery_drain_mv_per_min": 1000})
    for simulation in (fresh, draining):
        simulation.advance(60_000)
        turn(simulation, 80, -80, 1000)
    assert draining.world.robot.left.free_speed == pytest.approx(fresh.world.robot.left.free_speed * 7 / 8, rel=0.01)


@pytest.mark.parametrize(("power", "dead_zone", "moves"), [(10, 5, True), (10, 15, False), (16, 15, True)])
def test_the_dead_zone_holds_the_motor(power, dead_zone, moves):
    motor = WheelMotor(dead_zone_percent=dead_zone)
    for _ in range(300):
        motor.step(power, brake=True)
    assert (motor.angle > 0) is moves


SOFT = {
    "walls": {"from_mm": (2000, 1000), "to_mm": (2000, 2000)},
    "boxes": {"name": "cushion", "at_mm": (2000, 1500), "size_mm": (300, 900), "height_mm": 400},
}


@pytest.mark.parametrize("table", sorted(SOFT))
@pytest.mark.parametrize("absorbs", [False, True])
def test_what_absorbs_ultrasound_gives_no_echo(table, absorbs):
    simulation = simulate(**{table: [{**SOFT[table], "absorbs": absorbs}]})
    distance_cm = simulation.world.ultrasonic.distance_cm()
    assert (distance_cm is None) is absorbs
    assert simulation.truth.outlines()


def test_a_soft_thing_added_later_gives_no_echo():
    simulation = simulate()
    simulation.world.add(Box(**SOFT["boxes"], absorbs=True))
    assert simulation.world.ultrasonic.distance_cm() is None
