"""Motors that are connected or mounted otherwise than the mission says are detected from sightings and echoes."""

from __future__ import annotations

import math
from random import Random

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from behaviors.mission.robot import CameraTable, RobotTable
from behaviors.ports import Pose, Sighting
from behaviors.skills import steering_deg_s
from behaviors.wiring import AS_DESCRIBED, WIRINGS, Wiring, WiringCheck, WrongWiring

STEP_S = 1 / 15
"""From one frame to the next."""
ROOM_MM = 2000.0
"""From the start to each wall."""


def on(pose, forward_mm, turned_deg):
    """Return a pose after a short motion."""
    x_mm, y_mm = pose.ahead(forward_mm, turned_deg / 2)
    return Pose(x_mm, y_mm, pose.heading_deg + turned_deg)


def echo_mm(pose):
    """Return the distance to the nearest wall in a beam of 30 degrees, in a room of 4 x 4 m, or None beyond 2.5 m."""
    ways = []
    for off_deg in range(-15, 16, 5):
        angle = math.radians(pose.heading_deg + off_deg)
        for at_mm, along in ((pose.x_mm, math.cos(angle)), (pose.y_mm, math.sin(angle))):
            if abs(along) > 0.01:
                ways.append((math.copysign(ROOM_MM, along) - at_mm) / along)
    return nearest if (nearest := max(0.0, min(ways))) < 2500.0 else None


def drive(wiring, seed=1, *, robot=None, fov=1.0, track=1.0, late_frames=0, for_s=180.0):
    """Steer a robot with this wiring towards a target until the check raises; return its message, or "" at the end.

    The robot turns until it has seen the target in three frames, then steers towards it while it is in view.
    """
    robot, camera, random = robot or RobotTable(), CameraTable(), Random(seed)
    check = WiringCheck(robot, camera)
    by_wheels = truly = Pose()
    place = random.uniform(900, 1800), random.uniform(-1500, 1500)
    poses, frames = [truly] * (late_frames + 1), 0
    for step in range(int(for_s / STEP_S)):
        bearing_deg, distance_mm = poses[-1 - late_frames].polar_to(place)
        frames = frames + 1 if abs(bearing_deg) < 29.0 and 250.0 < distance_mm < 4000.0 else 0
        sighting, speed_mm_s, turn_deg_s = None, 0.0, 40.0
        if frames >= 3:
            bearing_deg, distance_mm = fov * bearing_deg + random.gauss(0, 1), distance_mm * random.gauss(1 / fov, 0.02)
            sighting = Sighting("box", bearing_deg, distance_mm, 1.0, step * STEP_S, (0, 0, 1, 1))
            turn_deg_s = steering_deg_s(bearing_deg)
            speed_mm_s = 150.0 if abs(bearing_deg) < 20.0 and distance_mm > 500.0 else 0.0
        try:
            check.look(step * STEP_S, by_wheels, echo_mm(poses[-1 - late_frames]), sighting)
        except WrongWiring as error:
            return str(error)
        moved = speed_mm_s * STEP_S, turn_deg_s * STEP_S
        by_wheels = on(by_wheels, *moved)
        further = on(truly, *wiring.true_displacement(*moved, robot.axle_track_mm * track))
        against_a_wall = max(abs(further.x_mm), abs(further.y_mm)) > ROOM_MM - 150.0
        truly = Pose(truly.x_mm, truly.y_mm, further.heading_deg) if against_a_wall else further
        poses.append(truly)
    return ""


@pytest.mark.slow
@pytest.mark.parametrize("wiring", [each for each in WIRINGS if each != AS_DESCRIBED])
def test_every_wrong_wiring_is_noticed_and_its_keys_are_named(wiring):
    """A robot that drives backwards towards its target often only backs against a wall, where it learns nothing."""
    right, said = wiring.described(RobotTable()), list(filter(None, (drive(wiring, seed) for seed in range(12))))
    assert len(said) >= (8 if wiring == Wiring(-1, -1, exchanged=True) else 12)
    for each in said:
        assert "does not move as [robot] says" in each
        for key in ("left", "right"):
            if getattr(right, key) != getattr(RobotTable(), key):
                assert f'{key} = "{getattr(right, key)}"' in each
            if getattr(right, f"{key}_reversed"):
                assert f"{key}_reversed = true" in each


@pytest.mark.slow
@given(seed=st.integers(0, 10**6), fov=st.floats(0.85, 1.15), track=st.floats(0.9, 1.1), late=st.integers(0, 8))
@example(seed=63, fov=1.0, track=1.0, late=3).via("swings to and fro at the edge of the frame, in step with its age")
def test_a_robot_as_described_is_left_alone_though_its_numbers_are_a_little_off(seed, fov, track, late):
    assert drive(AS_DESCRIBED, seed, fov=fov, track=track, late_frames=late, for_s=40.0) == ""


@pytest.mark.slow
@given(seed=st.integers(0, 10**6), keeps=st.floats(0.2, 1.0), left=st.booleans())
def test_a_wheel_that_slips_is_not_taken_for_a_reversed_one(seed, keeps, left):
    assert drive(Wiring(keeps, 1) if left else Wiring(1, keeps), seed, for_s=60.0) == ""


def test_long_straight_drives_are_no_evidence_against_the_description():
    """Exchanged motors explain them as well as the described ones, and no better."""
    check = WiringCheck(RobotTable(), CameraTable())
    for step in range(3000):
        check.look(step * STEP_S, Pose(10.0 * step, 0.0), 2500.0 - 10.0 * (step % 200), None)


def test_the_keys_are_compared_with_the_missions_own():
    robot = RobotTable(left="A", right="B", left_reversed=True, right_reversed=True)
    said = drive(WIRINGS[0]._replace(exchanged=True), robot=robot)
    assert 'left = "B", right = "A"' in said
    assert "reversed" not in said.split(" or ")[0]


def test_a_corrected_heading_is_not_taken_for_a_turn():
    """What is seen before and after a correction would fit exchanged motors."""
    check = WiringCheck(RobotTable(), CameraTable())
    for step in range(200):
        heading_deg = bearing_deg = 20.0 * (step % 2)
        check.forget_poses()
        seen = Sighting("box", bearing_deg, 900.0, 1.0, step * STEP_S, (0, 0, 1, 1))
        check.look(step * STEP_S, Pose(0.0, 0.0, heading_deg), None, seen)


def test_a_target_that_moves_once_says_nothing():
    check = WiringCheck(RobotTable(), CameraTable())
    for step in range(200):
        bearing_deg = 20.0 if step % 2 else -20.0  # two look-alikes in turn, before a robot at rest
        check.look(step * STEP_S, Pose(), None, Sighting("box", bearing_deg, 900.0, 1.0, step * STEP_S, (0, 0, 1, 1)))


@pytest.mark.parametrize("wiring", WIRINGS)
def test_the_description_of_a_wiring_is_the_one_that_it_fits(wiring):
    """A robot whose description was corrected moves as its wheels say."""
    right = wiring.described(RobotTable())
    port = {RobotTable().left: wiring.left, RobotTable().right: wiring.right}
    assert port[right.left] == (-1 if right.left_reversed else 1)
    assert port[right.right] == (-1 if right.right_reversed else 1)
    assert (right.left, right.right) == (("C", "B") if wiring.exchanged else ("B", "C"))


@pytest.mark.slow
@given(seed=st.integers(0, 10**6), keeps=st.floats(0.2, 0.9), left=st.booleans())
@example(seed=0, keeps=0.2689283265833197, left=True).via("circles in step with its echoes, three of four rising")
@example(seed=1974, keeps=0.890625, left=False).via("passes walls that are as far apart as its ways")
def test_a_wheel_that_slips_for_long_is_not_taken_for_a_reversed_one_without_a_target(seed, keeps, left):
    """The robot believes that it drives straight, and drives in circles: its echoes come from anywhere."""
    wiring = Wiring(keeps, 1) if left else Wiring(1, keeps)
    check, random = WiringCheck(RobotTable(), CameraTable()), Random(seed)
    by_wheels = truly = Pose()
    turns = 0
    for step in range(1500):
        echo_range_mm = echo_mm(truly)
        check.look(step * STEP_S, by_wheels, echo_range_mm, None)
        turns = random.randint(5, 60) if echo_range_mm is not None and echo_range_mm < 500.0 else turns - 1
        moved = (0.0, 50.0 * STEP_S) if turns > 0 else (200.0 * STEP_S, 0.0)
        by_wheels, truly = (
            on(by_wheels, *moved),
            on(truly, *wiring.true_displacement(*moved, RobotTable().axle_track_mm)),
        )


@pytest.mark.slow
@given(seed=st.integers(0, 10**6))
def test_echoes_of_anything_say_little_against_the_description(seed):
    """Another robot's sonar, for instance, gives such echoes."""
    check, random = WiringCheck(RobotTable(), CameraTable()), Random(seed)
    for step in range(1500):
        check.look(step * STEP_S, Pose(10.0 * step, 0.0), random.uniform(300.0, 2500.0), None)


@given(share=st.floats(-1.0, 3.0), speed_mm_s=st.floats(150.0, 225.0))
@example(share=2.0, speed_mm_s=225.0).via("its echoes are those of a robot that drives backwards")
def test_a_few_echoes_of_somebody_who_walks_ahead_are_not_taken_for_a_wrong_wiring(share, speed_mm_s):
    check = WiringCheck(RobotTable(), CameraTable())
    for step in range(round(1.4 / STEP_S)):
        driven_mm = speed_mm_s * step * STEP_S
        check.look(step * STEP_S, Pose(driven_mm, 0.0), 1100.0 + (share - 1.0) * driven_mm, None)
