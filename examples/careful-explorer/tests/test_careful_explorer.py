"""Tests in simulated rooms: a minute of simulated time takes a fraction of a second."""

import pytest
from careful_explorer import BACK_OFF_MM, explore, main


def test_drives_straight_on_where_nothing_is_in_the_way(sim_world, sim_brick):
    trip = explore(sim_brick, duration_s=5)
    assert trip.detours == 0
    assert sim_world.truth.pose.x_mm == pytest.approx(400 + trip.driven_mm, rel=0.05)


def test_keeps_clear_of_what_it_sees(sim_world, sim_brick):
    sim_world.put_box("crate", x_mm=1500)
    trip = explore(sim_brick, duration_s=15)
    assert trip.detours > 0
    assert sim_world.truth.contacts == 0


def test_backs_off_from_a_step_that_is_too_low_to_be_seen(sim_world, sim_brick):
    sim_world.put_box("step", x_mm=1000, height_mm=40)
    trip = explore(sim_brick, duration_s=6)
    assert trip.bumps == 1
    assert sim_world.truth.distance_mm("step") > BACK_OFF_MM


def test_does_not_run_into_a_person_who_steps_in_front(sim_world, sim_brick):
    sim_world.put_person("anna", x_mm=1800, y_mm=2700).walk("anna", x_mm=1800, y_mm=1500, after_s=1)
    explore(sim_brick, duration_s=15)
    assert sim_world.truth.contacts == 0


@pytest.mark.sim_world(seed=7, latency_ms=45)
def test_is_as_careful_over_bluetooth(sim_world, sim_brick):
    sim_world.put_box("crate", x_mm=1500)
    explore(sim_brick, duration_s=15)
    assert sim_world.truth.contacts == 0


def test_the_program_stops_its_motors_and_closes_its_brick(sim_world, capsys):
    main()
    assert "detours" in capsys.readouterr().out
    sim_world.advance(2)
    assert sim_world.truth.speed_mm_s == 0


def test_the_brick_is_charged(nxt_brick):
    assert nxt_brick.battery_v > 6.5


@pytest.mark.real_brick
def test_the_real_robot_turns_away_from_a_hand_in_front_of_it(nxt_brick):
    assert explore(nxt_brick, duration_s=10).detours > 0
