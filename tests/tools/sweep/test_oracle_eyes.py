"""The oracle that searches with the camera: it tours viewpoints on the true map, and drives to targets in view."""

import pytest

from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.tools.sweep.oracle_eyes import ScanPositions
from nxtdrive.tools.sweep.task import Task, result_of, run_episode
from sim_backend.scenarios.floor_plan import FloorPlan, Obstacle

WALL = Obstacle("wall", (2000.0, 600.0), (10.0, 1200.0))
"""Between two rooms of 2 m by 2 m; the door is at its end."""
LEFT, SPEED_MM_S = (1000.0, 1000.0), 200.0


def test_what_was_shown_is_not_looked_for_again():
    """After a look in one room the best place is in the other one; after both nothing is left."""
    places = ScanPositions(FloorPlan((4000.0, 2000.0), (WALL,)))
    places.looked(LEFT)
    path = places.best(LEFT, SPEED_MM_S)
    assert path is not None
    assert path.points[-1][0] > 2000.0
    for _ in range(40):
        path = places.best(LEFT, SPEED_MM_S)
        if path is None:
            break
        places.looked(path.points[-1])
    assert path is None
    places.forget()
    assert places.best(LEFT, SPEED_MM_S) is not None


def test_no_place_behind_a_closed_wall_is_chosen():
    """A room without a door cannot be looked into."""
    places = ScanPositions(FloorPlan((4000.0, 2000.0), (Obstacle("wall", (2000.0, 1000.0), (10.0, 2000.0)),)))
    for _ in range(40):
        path = places.best(LEFT, SPEED_MM_S)
        if path is None:
            return
        assert path.points[-1][0] < 2000.0
        places.looked(path.points[-1])
    raise AssertionError("it never came to an end")


@pytest.mark.slow
def test_a_target_is_found_by_sight_through_the_only_door():
    """Both targets hang beyond a door; the map alone does not lead to them."""
    trace, _ = run_episode(generate_scenario("doorway", 100), "oracle-eyes", "geometric")
    states = [entry.record.data["to"] for entry in trace.entries if "to" in entry.record.data]
    assert trace.ending == "achieved"
    assert states.index("search") < states.index("arrive")
    assert result_of(Task(0, "doorway", 100, "oracle-eyes", "geometric"), trace).success
