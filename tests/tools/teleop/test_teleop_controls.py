"""Controls, map and the control loop, without a terminal."""

from contextlib import closing

import pytest

from behaviors.mission.robot import CameraTable
from behaviors.ports import Pose, Sighting
from firmware_protocol.direct import GetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import CameraError
from nxtdrive.tools.teleop.controls import DEAD_MAN_S, Controls, Direction
from nxtdrive.tools.teleop.floor_map import FARTHEST_ECHO_MM, FloorMap
from nxtdrive.tools.teleop.pilot import Pilot
from nxtdrive.tools.teleop.spotter import Spotter, ThreadedSpotter
from sim_backend.firmware.motors.bench_motor import BenchMotor
from tests.waiting import until

STOP = (0.0, 0.0)


@pytest.fixture
def controls():
    return Controls(300.0, 120.0)


def test_no_key_pressed_is_a_stop(controls):
    assert controls.wanted(0.0) == STOP


@pytest.mark.parametrize("direction", Direction)
def test_a_key_counts_for_a_moment_only(controls, direction):
    controls.press(direction, 10.0)
    assert controls.wanted(10.0) != STOP
    assert controls.wanted(10.0 + DEAD_MAN_S) != STOP
    assert controls.wanted(10.01 + DEAD_MAN_S) == STOP


def test_right_is_positive_and_the_last_key_counts(controls):
    controls.press(Direction.RIGHT, 0.0)
    assert controls.wanted(0.1)[1] > 0
    controls.press(Direction.LEFT, 0.2)
    assert controls.wanted(0.3)[1] < 0
    controls.set_neutral()
    assert controls.wanted(0.3) == STOP


def test_the_speed_has_limits_at_both_ends(controls):
    for _ in range(20):
        controls.faster(10)
    controls.press(Direction.FORWARD, 0.0)
    assert controls.wanted(0.0) == (300.0, 0.0)
    for _ in range(20):
        controls.faster(-10)
    assert 0 < controls.wanted(0.0)[0] < 100


def test_after_an_emergency_stop_no_key_drives_until_it_is_released(controls):
    controls.press(Direction.FORWARD, 0.0)
    controls.emergency_stop()
    controls.press(Direction.FORWARD, 0.1)
    assert controls.wanted(0.1) == STOP
    controls.release()
    assert controls.wanted(0.1) == STOP
    controls.press(Direction.FORWARD, 0.2)
    assert controls.wanted(0.2) != STOP


def test_the_map_shows_path_echo_target_and_robot():
    floor = FloorMap()
    for x_mm in range(0, 600, 50):
        floor.drive_over(Pose(x_mm, 0.0, 0.0))
    here = Pose(500.0, 0.0, 90.0)
    floor.add_echo(Pose(500.0, 0.0, 0.0), 400.0)
    floor.add_target(here, 0.0, 250.0)
    lines = floor.draw(here, 21, 11)
    assert len(lines) == 11
    assert {len(line) for line in lines} == {21}
    assert lines[5][10] == "→"
    assert lines[1][10] == "#"
    assert lines[5][15] == "T"
    assert [lines[row][10] for row in range(6, 11)] == ["·"] * 5


def test_the_map_accounts_for_the_mounting_of_sonar_and_lens():
    floor = FloorMap(sonar_forward_mm=100.0, camera=CameraTable(forward_mm=200.0, right_mm=100.0))
    floor.add_echo(Pose(), 400.0)
    floor.add_target(Pose(0.0, 0.0, 90.0), 0.0, 300.0)
    lines = floor.draw(Pose(), 21, 21)
    assert lines[5][10] == "#"
    assert lines[11][20] == "T"


def test_missing_and_far_echoes_are_not_walls():
    floor = FloorMap()
    floor.add_echo(Pose(), None)
    floor.add_echo(Pose(), FARTHEST_ECHO_MM + 10)
    assert "#" not in "".join(floor.draw(Pose(), 99, 99))


def test_where_the_robot_has_been_nothing_stands():
    floor = FloorMap()
    floor.add_echo(Pose(), 500.0)
    floor.drive_over(Pose(500.0, 0.0, 0.0))
    assert "#" not in "".join(floor.draw(Pose(), 99, 99))


def _pilot(brick, controls, spotter=None):
    return Pilot(brick, brick.rover(), controls, spotter)


def _hold(brick, pilot, controls, direction, steps):
    """What each step shows while a key is held."""
    views = []
    for _ in range(steps):
        controls.press(direction, brick.now())
        views.append(pilot.step())
    return views


@pytest.mark.parametrize("latency_ms", [2, 45])
def test_a_held_key_drives_and_letting_go_stops(room, controls, latency_ms):
    simulation, brick = room(latency_ms=latency_ms)
    pilot, start = _pilot(brick, controls), simulation.truth.pose
    views = _hold(brick, pilot, controls, Direction.FORWARD, 20)
    assert {view.state for view in views} == {"driving"}
    driven = simulation.truth.pose
    assert driven.x_mm - start.x_mm > 150
    assert views[-1].pose.x_mm == pytest.approx(driven.x_mm - start.x_mm, abs=40)
    released = brick.now()
    while pilot.step().state == "driving":
        assert brick.now() - released < DEAD_MAN_S + 0.5
    brick.sleep(0.3)
    rest = simulation.truth.pose
    brick.sleep(1.0)
    assert simulation.truth.pose == pytest.approx(rest, abs=1.0)


def test_an_emergency_stop_acts_in_the_next_step(room, controls):
    simulation, brick = room()
    pilot = _pilot(brick, controls)
    _hold(brick, pilot, controls, Direction.RIGHT, 10)
    controls.emergency_stop()
    assert pilot.step().state.startswith("EMERGENCY")
    brick.sleep(0.3)
    rest = simulation.truth.pose
    _hold(brick, pilot, controls, Direction.RIGHT, 1)
    assert simulation.truth.pose == pytest.approx(rest, abs=1.0)


def test_a_program_that_dies_leaves_no_robot_running(room, controls):
    simulation, brick = room()
    pilot = _pilot(brick, controls)
    _hold(brick, pilot, controls, Direction.FORWARD, 10)
    simulation.advance(1500)  # no more input comes
    rest = simulation.truth.pose
    simulation.advance(1000)
    assert simulation.truth.pose == pytest.approx(rest, abs=1.0)


def test_the_wall_ahead_stops_it_and_stands_on_the_map(room, controls):
    simulation, brick = room()
    pilot = _pilot(brick, controls)
    views = _hold(brick, pilot, controls, Direction.FORWARD, 160)
    assert "obstacle ahead" in {view.state for view in views}
    assert simulation.truth.pose.x_mm < 4000 - 115
    assert "#" in "".join(pilot.map.draw(views[-1].pose, 60, 30))
    controls.press(Direction.BACK, brick.now())
    assert pilot.step().state == "driving"


def test_blocked_wheels_are_not_driven_until_the_key_is_released(room, controls):
    simulation, brick = room()
    wheel = BenchMotor(locked=True)
    simulation.brick.attach_motor("B", wheel)
    pilot = _pilot(brick, controls)
    states = [view.state for view in _hold(brick, pilot, controls, Direction.FORWARD, 40)]
    assert list(dict.fromkeys(states)) == ["driving", "wheels are stuck", "wheels are stuck, let go"]
    assert brick.request(GetOutputState(OutputPort.B)).power == 0
    wheel.locked = False
    controls.press(Direction.BACK, brick.now())
    assert pilot.step().state == "driving"
    controls.set_neutral()
    pilot.step()
    controls.press(Direction.FORWARD, brick.now())
    assert pilot.step().state == "driving"


class Seer:
    """Vision that sees what it is given."""

    def __init__(self, *looks):
        self.looks = list(looks)

    def look(self, target):
        seen = self.looks.pop(0) if len(self.looks) > 1 else self.looks[0]
        if isinstance(seen, Exception):
            raise seen
        return seen


LENA = Sighting("lena", -12.0, 900.0, 0.9, 0.0, (0, 0, 10, 10))


def test_the_camera_line_says_where_the_target_is(room, controls):
    _, brick = room()
    spotter = Spotter(Seer(None, LENA, CameraError("The camera is gone.")), "lena")
    pilot = _pilot(brick, controls, spotter)
    lines = list(dict.fromkeys(pilot.step().target_text for _ in range(20)))
    assert lines == ["lena: not in sight", "lena: 0.90 m, 12° left", "The camera is gone."]
    assert "T" in "".join(pilot.map.draw(Pose(), 60, 30))


@pytest.mark.parametrize("make", [Spotter, ThreadedSpotter])
def test_a_detector_that_breaks_ends_driving_instead_of_leaving_its_last_sighting(room, controls, make):
    _, brick = room()
    spotter = make(Seer(LENA, ZeroDivisionError("defect")), "lena")
    pilot = _pilot(brick, controls, spotter)

    def drive():
        for _ in range(10_000):
            pilot.step()

    with closing(spotter), pytest.raises(ZeroDivisionError, match="defect"):
        drive()


def test_a_real_robot_looks_in_a_thread_that_ends():
    spotter = ThreadedSpotter(Seer(LENA), "lena")
    until(lambda: spotter.sighting)
    spotter.close()
    assert spotter.sighting is LENA
