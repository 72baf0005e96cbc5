"""The events of the bundled worlds happen as described, for a robot driven by the ground truth."""

import math

import pytest

from firmware_protocol.direct import SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from sim_backend.simulation import Simulation

REGULATED = OutputMode.MOTOR_ON | OutputMode.BRAKE | OutputMode.REGULATED


class Driver:
    """Drives by ground truth, which only a test may do."""

    def __init__(self, world):
        self.simulation = Simulation(world)
        self.truth = self.simulation.truth

    def power(self, left, right, duration_ms):
        for port, power in ((OutputPort.B, left), (OutputPort.C, right)):
            command = SetOutputState(port, round(power), REGULATED, RegulationMode.SPEED, 0, RunState.RUNNING, 0)
            self.simulation.deliver(command.encode())
        self.simulation.advance(duration_ms)

    def rest(self, duration_s=0.5):
        self.power(0, 0, round(duration_s * 1000))

    def turn(self, angle_deg):
        goal_deg = self.truth.pose.heading_deg + angle_deg
        while abs(left_deg := goal_deg - self.truth.pose.heading_deg) > 2:
            power = math.copysign(min(25, 5 + abs(left_deg) / 3), left_deg)
            self.power(power, -power, 20)
        self.rest()

    def straight(self, distance_mm):
        start = self.truth.pose[:2]
        while math.dist(start, self.truth.pose[:2]) < distance_mm:
            self.power(40, 40, 20)
        self.rest()

    def search(self, picture):
        """Stop and look every 30 degrees; the number of looks until the picture was in view, or None."""
        for look in range(1, 13):
            if self.truth.in_view(picture):
                return look
            self.turn(30)
        return None

    def approach(self, picture):
        """Drive on what is in view; whether it was reached before it was out of view for 2 s."""
        unseen_ms = 0
        while self.truth.distance_mm(picture) > 450 and unseen_ms < 2000:
            if self.truth.in_view(picture):
                unseen_ms = 0
                x_mm, y_mm, heading_deg = self.truth.pose
                there = self.truth.pictures[picture]
                bearing_deg = math.degrees(math.atan2(there.y_mm - y_mm, there.x_mm - x_mm)) - heading_deg
                steer = ((bearing_deg + 180) % 360 - 180) * 0.5
                self.power(40 + steer, 40 - steer, 100)
            else:
                unseen_ms += 100
                self.rest(0.1)
        self.rest()
        return self.truth.distance_mm(picture) <= 450


def test_open_shows_lena_at_once():
    driver = Driver("open")
    assert driver.search("lena") == 1
    assert driver.approach("lena")


def test_figure_1_takes_lena_away_during_the_approach():
    driver = Driver("figure1")
    assert driver.search("lena") == 1
    assert not driver.approach("lena")
    assert "lena" not in driver.truth.pictures


@pytest.mark.slow
@pytest.mark.parametrize("world", ["figure5", "arena"])
def test_lena_is_in_view_only_after_moving_off(world):
    driver = Driver(world)
    assert driver.search("lena") is None
    driver.turn(90)
    driver.straight(1500)
    assert driver.search("lena")


def test_in_figure_6_waiting_helps():
    driver = Driver("figure6")
    assert driver.search("lena") == 1
    assert not driver.approach("lena")
    driver.rest(15)
    assert driver.search("lena")
    assert driver.approach("lena")


@pytest.mark.slow
def test_figure_7_leads_from_no_lena_to_rilakkuma():
    driver = Driver("figure7")
    for _ in range(2):
        assert driver.search("lena") is None
        driver.turn(90)
        driver.straight(1500)
    assert driver.search("lena") is None
    assert driver.search("rilakkuma")
    assert driver.approach("rilakkuma")


@pytest.mark.slow
def test_the_story_of_the_arena():
    driver = Driver("arena")
    driver.turn(90)
    driver.straight(1500)
    assert driver.search("lena")
    assert not driver.approach("lena")
    driver.rest(15)
    assert driver.search("lena") is None
    assert driver.search("rilakkuma")
    assert not driver.approach("rilakkuma")
    driver.rest(15)
    assert driver.search("rilakkuma")
    assert driver.approach("rilakkuma")
    assert driver.search("lena")
    assert driver.approach("lena")
    assert driver.truth.contacts == 0
    assert [name for _, name in driver.truth.events] == [event.name for event in driver.simulation.world.file.events]
