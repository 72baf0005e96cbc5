"""A mission whose motors are not connected as it says ends soon, at rest, and says what to change."""

from __future__ import annotations

import pytest

from behaviors.events import Event as ChartEvent
from behaviors.events import Reason
from behaviors.executive import Ending
from behaviors.journal import RecordKind
from behaviors.mission import Mission
from sim_backend.simulation import Simulation
from sim_backend.world.event_tables import Event

CAMERA_LOOKS_BACK = {"left": "C", "right": "B", "left_reversed": True, "right_reversed": True}


def described(mission: Mission, **robot: object) -> Mission:
    """Return the mission with another description of the robot, whose wheels are at B and C."""
    return mission.model_copy(update={"robot": mission.robot.model_copy(update=robot)})


@pytest.mark.parametrize(
    ("robot", "keys", "within_s"),
    [
        ({"left": "C", "right": "B"}, 'left = "B", right = "C"', 20.0),
        ({"left_reversed": True, "right_reversed": True}, "left_reversed = false, right_reversed = false", 20.0),
        ({"left_reversed": True}, "left_reversed = false", 120.0),
        (CAMERA_LOOKS_BACK, 'left = "B", right = "C", left_reversed = false, right_reversed = false', 120.0),
    ],
)
def test_a_wrong_wiring_ends_the_mission(perform, mission_for, robot, keys, within_s):
    mission = described(mission_for("lena", profile="adaptive"), **robot)
    done = perform("open", mission, geometric=True)
    assert done.report.ending is Ending.WRONG_WIRING
    assert done.report.duration_s < within_s
    assert keys in done.report.error.replace("right_reversed = false, left_reversed", "left_reversed")
    assert done.simulation.truth.speed_mm_s < 1.0
    trip = done.of(RecordKind.TRANSITION, event=ChartEvent.TRIP)[-1]
    assert trip.data["reason"] == Reason.WRONG_WIRING


def test_the_thesis_checks_it_too(perform, mission_for):
    mission = described(mission_for("lena"), left_reversed=True, right_reversed=True)
    assert perform("open", mission, geometric=True).report.ending is Ending.WRONG_WIRING


@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
@pytest.mark.parametrize(
    ("ports", "wheels"),
    [("B", "The left wheel's motor, on port B, has"), ("BC", "The motors of both wheels, on ports B and C, have")],
)
def test_a_motor_that_is_not_plugged_in_ends_the_mission(perform, mission_for, profile, ports, wheels):
    def unplug(simulation: Simulation) -> None:
        for port in ports:
            simulation.brick.attach_motor(port, None)

    done = perform("room", mission_for("lena", profile=profile), geometric=True, arrange=unplug)
    assert done.report.ending is Ending.WRONG_WIRING
    assert done.report.error.startswith(wheels)
    assert done.report.duration_s < 20.0
    assert done.simulation.truth.speed_mm_s < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
@pytest.mark.parametrize(
    ("wheel", "names"),
    [
        ("left", "The left wheel's motor, on port B, has stopped turning"),
        ("right", "The right wheel's motor, on port C, has stopped turning"),
        ("both", "The motors of both wheels, on ports B and C, have stopped turning"),
    ],
)
def test_a_motor_whose_cable_comes_off_on_the_way_ends_the_mission(perform, mission_for, profile, wheel, names):
    def unplug_later(simulation: Simulation) -> None:
        unplugged = Event(name="it", when={"at_s": 0}, wheel=wheel, fault="unplugged")
        simulation.at(4000, lambda: simulation.world.perform(unplugged, None))

    done = perform("room", mission_for("lena", profile=profile), geometric=True, arrange=unplug_later)
    assert done.report.ending is Ending.WRONG_WIRING
    assert done.report.error.startswith(names)
    assert "Plug the cable in" in done.report.error
    assert done.report.duration_s < (12.0 if profile == "adaptive" else 60.0)
    assert done.simulation.truth.speed_mm_s < 1.0


def test_a_motor_whose_cable_is_plugged_in_again_soon_does_not(perform, mission_for):
    def unplug_briefly(simulation: Simulation) -> None:
        unplugged = Event(name="it", when={"at_s": 0}, wheel="left", fault="unplugged")
        simulation.at(4000, lambda: simulation.world.perform(unplugged, 1000))

    done = perform("room", mission_for("lena", profile="adaptive"), geometric=True, arrange=unplug_briefly)
    assert done.report.ending is Ending.ACHIEVED


def test_a_robot_as_described_reaches_its_target(perform, mission_for):
    done = perform("open", mission_for("lena", profile="adaptive"), geometric=True)
    assert done.report.ending is Ending.ACHIEVED
