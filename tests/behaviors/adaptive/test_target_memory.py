"""The height of a target, from the frames that showed it, and which frames are evidence of its absence."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from random_ports import two_targets

from behaviors.adaptive.camera_scale import CameraScale
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.adaptive.target_memory import TargetMemory
from behaviors.failures import TargetFinding
from behaviors.ports import Cut, Glimpse, Pose, Sighting
from behaviors.pose_history import PoseHistory

LEVEL, HIGH = (-100.0, 100.0), (200.0, 400.0)
"""Edges above the lens, in millimetres."""


class Memory(TargetMemory):
    """The memory of a robot that turns on the spot, with one frame every tenth of a second."""

    def __init__(self, guessed=()) -> None:
        self.turned = PoseHistory()
        super().__init__(two_targets(), OccupancyGrid(), self.turned)
        self.scale = CameraScale(0.0, guessed)
        self._frames = 0

    def show(
        self,
        edges_mm=None,
        distance_mm=2000.0,
        *,
        heading_deg=0.0,
        cut=Cut.NONE,
        bearing_deg=0.0,
        echo_mm=None,
        floor_mm=None,
    ):
        """Look, by default straight ahead, for a target with these edges if there is one."""
        self._frames += 1
        time_s = 0.1 * self._frames
        self.turned.add(time_s, Pose(heading_deg=heading_deg))
        seen = Sighting("a", bearing_deg, distance_mm, 1.0, time_s, (100, 80, 40, 56), cut, edges_mm=edges_mm)
        if floor_mm is not None:  # the lens is 200 mm high
            seen = replace(seen, lower_deg=math.degrees(math.atan2(200.0, floor_mm)))
        self.look(["a"], Glimpse(time_s, {} if edges_mm is None else {"a": seen}), echo_mm)


def _whole_mm(*edges_mm):
    memory = Memory()
    for each in edges_mm:
        memory.show(each)
    return memory.whole_mm("a")


@pytest.mark.parametrize("finding", [TargetFinding.LOOK_ALIKE, TargetFinding.NOT_THERE])
def test_a_target_does_not_take_over_the_edges_of_what_was_taken_for_it(finding):
    memory = Memory()
    memory.show(HIGH, 1000.0)
    memory.learn("a", finding, (0.0, 0.0))
    memory.show(LEVEL, 3000.0)
    assert memory.whole_mm("a") == pytest.approx(_whole_mm(LEVEL))


def test_a_target_seen_elsewhere_has_the_edges_that_it_has_there():
    memory = Memory()
    memory.show(HIGH, 1000.0)
    for _ in range(15):
        memory.show()
    memory.show(LEVEL, 3000.0)
    assert memory.whole_mm("a") == pytest.approx(_whole_mm(LEVEL))


def test_edges_that_jitter_are_smoothed():
    jittering = [(200.0, 390.0), (200.0, 410.0)] * 10
    assert abs(_whole_mm(*jittering) - _whole_mm(*jittering, jittering[0])) < 0.6 * (
        _whole_mm(jittering[1]) - _whole_mm(jittering[0])
    )


def test_what_the_frame_cuts_off_is_no_evidence_about_the_edges():
    memory = Memory()
    memory.show(HIGH, cut=Cut.TOP)
    assert memory.whole_mm("a") == 0.0
    assert memory.fits("a", 100.0)
    memory.show(HIGH)
    memory.show(LEVEL, cut=Cut.TOP)
    assert memory.whole_mm("a") == pytest.approx(_whole_mm(HIGH))


@pytest.mark.parametrize(
    ("edges_mm", "heading_deg", "counts"),
    [(HIGH, 0.0, False), (LEVEL, 0.0, True), (HIGH, 180.0, True)],
    ids=["too near", "in the frame", "elsewhere"],
)
def test_a_look_without_a_detection_counts_unless_the_target_is_too_near_for_the_frame(edges_mm, heading_deg, counts):
    memory = Memory()
    memory.show(edges_mm, 600.0)
    ahead = Pose(heading_deg=heading_deg).ahead(600.0)
    before = memory.beliefs["a"].held_at(ahead)
    for _ in range(5):
        memory.show(heading_deg=heading_deg)
    memory.flush_looks()
    assert (memory.beliefs["a"].held_at(ahead) < 0.9 * before) is counts


@pytest.mark.parametrize(("bearing_deg", "believed"), [(8.0, True), (-40.0, False)])
def test_an_echo_that_brings_what_was_not_measured_nearer_does_not_make_it_another_target(bearing_deg, believed):
    memory = Memory(guessed={"a"})
    for bearing in (15.0, 12.0, bearing_deg):
        memory.show(LEVEL, 1200.0, bearing_deg=bearing, echo_mm=580.0)
    assert (memory.known["a"].distance_mm == 580.0, memory.known["a"].time_s == pytest.approx(0.3)) == (
        believed,
        believed,
    )


@pytest.mark.parametrize(
    ("cut", "floor_mm", "echo_mm", "distance_mm"),
    [
        (Cut.NONE, 600.0, None, 600.0),
        (Cut.NONE, 600.0, 1400.0, 600.0),  # of what is behind it
        (Cut.NONE, 600.0, 400.0, 400.0),  # it does not stand on the floor
        (Cut.NONE, 2500.0, 1400.0, 1400.0),
        (Cut.NONE, 4000.0, None, 2000.0),  # too near to the horizon to say anything
        (Cut.BOTTOM, 500.0, None, 500.0),
        (Cut.BOTTOM, 2500.0, None, 2000.0),  # it may be nearer than where the frame ends
    ],
)
def test_the_floor_at_its_lower_edge_says_how_far_away_what_was_not_measured_is(cut, floor_mm, echo_mm, distance_mm):
    memory = Memory(guessed={"a"})
    memory.show(LEVEL, 2000.0, cut=cut, floor_mm=floor_mm, echo_mm=echo_mm)
    assert memory.known["a"].distance_mm == pytest.approx(distance_mm)


def test_a_measured_height_counts_more_than_the_floor():
    memory = Memory()
    memory.show(LEVEL, 2000.0, floor_mm=600.0, echo_mm=1400.0)
    assert memory.known["a"].distance_mm == 2000.0


@pytest.mark.parametrize(
    ("guessed", "echo_mm", "beyond"), [(True, 1400.0, True), (True, 650.0, False), (False, 1400.0, False)]
)
def test_an_echo_from_beyond_the_floor_at_its_lower_edge_is_of_something_else(guessed, echo_mm, beyond):
    memory = Memory(guessed={"a"} if guessed else ())
    seen = Sighting("a", 0.0, 2000.0, 1.0, 0.0, (100, 80, 40, 56), lower_deg=math.degrees(math.atan2(200.0, 600.0)))
    assert memory.beyond(seen, echo_mm) is beyond
