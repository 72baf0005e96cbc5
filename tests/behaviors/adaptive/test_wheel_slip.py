"""A wheel that slips is noticed by how the camera turns, and the pose follows the camera until the wheel grips."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviors.adaptive.wheel_slip import WheelSlip
from behaviors.ports import Glimpse, Pose

TRACK_MM = 112.0
STEP_S = 0.1
FORWARD, SPIN, CURVE = (200.0, 200.0), (60.0, -60.0), (220.0, 160.0)
REST = (0.0, 0.0)
COURSE = (*[SPIN] * 60, *[FORWARD] * 30, *[CURVE] * 30, *[REST] * 10, *[(-60.0, 60.0)] * 30, *[FORWARD] * 40)
Speeds = tuple[float, float]


@dataclass
class Robot:
    """A robot on two wheels, its odometry, and its camera.

    Attributes:
        lost: Share of its way that each wheel loses, left and right.
        track: True track over the believed one.
        lens: Turns that the camera shows over the true ones.
        late_s: How much older frames are than their time says.
        measured: Share of the frames that show the turn.
        step_s: Time between two frames.
    """

    lost: Speeds = (0.0, 0.0)
    track: float = 1.0
    lens: float = 1.0
    late_s: float = 0.0
    measured: float = 1.0
    step_s: float = STEP_S
    slip: WheelSlip = field(default_factory=lambda: WheelSlip(TRACK_MM))
    true: Pose = field(default_factory=Pose)
    believed: Pose = field(default_factory=Pose)
    now_s: float = 0.0
    random: Random = field(default_factory=lambda: Random(1))
    headings: list[float] = field(default_factory=list)
    corrections: int = 0

    def drive(self, speeds: Sequence[Speeds], moves: Callable[[float], float] = lambda turned_deg: turned_deg) -> None:
        """Drive with these speeds of the wheels, mm/s, one frame each; `moves` says how far the camera turns."""
        for left, right in speeds:
            self.now_s += self.step_s
            ways = left * self.step_s, right * self.step_s
            self.believed = _driven(self.believed, *ways, TRACK_MM)
            kept = [way * (1.0 - lost) for way, lost in zip(ways, self.lost, strict=True)]
            before = self.true.heading_deg
            self.true = _driven(self.true, *kept, TRACK_MM * self.track)
            shown = moves(self.true.heading_deg - before)
            self.headings.append((self.headings[-1] if self.headings else 0.0) + shown)
            self._look()

    def _look(self) -> None:
        late = round(self.late_s / self.step_s)
        now, then = (self.headings[max(0, len(self.headings) - 1 - late - back)] for back in (0, 1))
        self.slip.add_pose(self.now_s, self.believed)
        turned_deg = self.lens * (now - then) + self.random.gauss(0.0, 0.15)
        shown_deg = turned_deg if self.random.random() < self.measured else None
        correction = self.slip.correction(Glimpse(self.now_s, {}, turned_deg=shown_deg))
        if correction is not None:
            self.corrections += 1
            self.believed = self.believed.corrected(*correction)

    @property
    def heading_error_deg(self) -> float:
        return abs(self.believed.heading_deg - self.true.heading_deg)


def _driven(pose: Pose, left_mm: float, right_mm: float, track_mm: float) -> Pose:
    return pose.corrected(math.degrees((left_mm - right_mm) / track_mm), (left_mm + right_mm) / 2)


@settings(max_examples=60, deadline=None)
@given(
    track=st.floats(0.92, 1.08),
    lens=st.floats(0.95, 1.1),
    late_s=st.sampled_from([0.0, 0.1, 0.2, 0.3, 0.4]),
    measured=st.floats(0.0, 1.0),
    seed=st.integers(0, 99),
)
def test_wrong_numbers_late_frames_and_noise_are_no_slip(track, lens, late_s, measured, seed):
    robot = Robot(track=track, lens=lens, late_s=late_s, measured=measured, random=Random(seed))
    robot.drive(COURSE)
    assert not robot.slip.slips
    assert robot.corrections == 0


@pytest.mark.parametrize("wheel", ["left", "right"])
@pytest.mark.parametrize("lost_share", [0.2, 0.5, 0.7])
@pytest.mark.parametrize("measured", [1.0, 0.6])
def test_the_pose_follows_the_camera_while_a_wheel_slips(wheel, lost_share, measured):
    robot = Robot(measured=measured)
    robot.drive(COURSE)
    robot.lost = (lost_share, 0.0) if wheel == "left" else (0.0, lost_share)
    robot.drive([FORWARD] * 20)
    assert robot.slip.slips
    assert robot.slip.evidence["wheel"] == wheel
    robot.drive([CURVE] * 20)
    assert robot.slip.evidence["lost_share"] == pytest.approx(lost_share, abs=0.1)
    slipped_s = robot.slip.evidence["slipped_s"]
    assert isinstance(slipped_s, float)
    assert 2.5 < slipped_s < 4.0
    robot.drive([*[FORWARD] * 60, *[SPIN] * 40, *[FORWARD] * 60])
    assert robot.heading_error_deg < 12.0
    driven_mm = (
        sum(abs(left + right) for left, right in [*[FORWARD] * 20, *[CURVE] * 20, *[FORWARD] * 120]) / 2 * STEP_S
    )
    assert robot.believed.distance_mm_to(robot.true) < 0.1 * driven_mm


@pytest.mark.parametrize("wheel", ["left", "right"])
@pytest.mark.parametrize("speeds", [(150.0, 0.0), (120.0, 20.0), (120.0, -20.0)])
def test_the_wheel_that_slips_turns_faster_so_that_the_robot_drives_as_it_should(wheel, speeds):
    robot = Robot(lost=(0.4, 0.0) if wheel == "left" else (0.0, 0.4))
    robot.drive([FORWARD] * 40)
    begin = robot.true
    for _ in range(20):
        speed_mm_s, turn_deg_s = robot.slip.compensated(*speeds)
        arc_mm_s = math.radians(turn_deg_s) * TRACK_MM / 2
        robot.drive([(speed_mm_s + arc_mm_s, speed_mm_s - arc_mm_s)])
    duration_s = 20 * STEP_S
    assert robot.true.heading_deg - begin.heading_deg == pytest.approx(speeds[1] * duration_s, abs=6.0)
    assert robot.true.distance_mm_to(begin) == pytest.approx(speeds[0] * duration_s, rel=0.05)


def test_a_turn_on_the_spot_and_a_robot_that_grips_are_driven_as_they_are():
    robot = Robot()
    assert robot.slip.compensated(150.0, 10.0) == (150.0, 10.0)
    robot.lost = (0.4, 0.0)
    robot.drive([FORWARD] * 40)
    assert robot.slip.compensated(0.0, 45.0) == (0.0, 45.0)
    assert robot.slip.compensated(-60.0, 0.0) == (-60.0, 0.0)


def test_a_slip_in_a_turn_on_the_spot_is_noticed_where_it_is_large():
    robot = Robot()
    robot.drive(COURSE)
    robot.lost = (0.7, 0.0)
    robot.drive([SPIN] * 40)
    assert robot.slip.slips
    assert robot.heading_error_deg < 5.0


@pytest.mark.parametrize(("course", "error_deg"), [([FORWARD] * 40, 20.0), ([*[SPIN] * 30, *[CURVE] * 40], 30.0)])
def test_when_the_wheel_grips_again_the_pose_goes_by_the_wheels(course, error_deg):
    robot = Robot(measured=0.7)
    robot.drive([FORWARD] * 20)
    robot.lost = (0.0, 0.6)
    robot.drive([FORWARD] * 60)
    assert robot.slip.slips
    robot.lost = (0.0, 0.0)
    robot.drive(course)
    assert not robot.slip.slips
    assert robot.heading_error_deg < error_deg
    corrections = robot.corrections
    robot.drive(COURSE)
    assert robot.corrections == corrections


def test_a_robot_at_rest_goes_on_slipping_as_nothing_shows_that_it_grips():
    robot = Robot(lost=(0.5, 0.0))
    robot.drive([FORWARD] * 30)
    robot.drive([REST] * 100)
    assert robot.slip.slips


@pytest.mark.parametrize(
    "moves",
    [
        pytest.param(lambda turned_deg: turned_deg + 6.0, id="something large passes by, or it is carried"),
        pytest.param(lambda turned_deg: -turned_deg, id="the motors are exchanged"),
    ],
)
def test_what_no_slip_explains_does_not_change_the_pose(moves):
    robot = Robot()
    robot.drive([*[SPIN] * 20, *[REST] * 5], moves)
    assert robot.corrections == 0
    robot.drive([*[FORWARD] * 40, *[CURVE] * 40], moves)
    assert robot.corrections == 0


@pytest.mark.parametrize("step_s", [0.5, 0.9])
def test_frames_far_apart_are_not_compared_as_the_turn_in_between_is_not_known(step_s):
    robot = Robot(step_s=step_s, lost=(0.5, 0.0))
    robot.drive([FORWARD] * 20)
    assert robot.corrections == 0


@settings(max_examples=200, deadline=None)
@given(
    steps=st.lists(
        st.tuples(
            st.floats(0.0, 2.0),
            st.floats(-300.0, 300.0),
            st.floats(-90.0, 90.0),
            st.one_of(st.none(), st.floats(-90.0, 90.0)),
        ),
        max_size=40,
    )
)
def test_whatever_wheels_and_frames_say_corrections_are_finite(steps):
    slip, pose, now_s = WheelSlip(TRACK_MM), Pose(), 0.0
    for duration_s, way_mm, turned_deg, seen_deg in steps:
        now_s += duration_s
        pose = pose.corrected(turned_deg, way_mm)
        slip.add_pose(now_s, pose)
        correction = slip.correction(Glimpse(now_s, {}, turned_deg=seen_deg))
        if correction is not None:
            assert all(map(math.isfinite, correction))
            pose = pose.corrected(*correction)
        if slip.slips:
            assert 0.0 <= slip.evidence["lost_share"] <= 0.85


def test_after_a_pose_was_corrected_by_others_it_begins_again():
    robot = Robot()
    robot.drive([SPIN] * 30)
    robot.slip.restart()
    robot.believed = robot.true = Pose(0.0, 0.0, robot.true.heading_deg + 40.0)
    robot.drive(COURSE)
    assert robot.corrections == 0
