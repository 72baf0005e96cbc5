"""The map of a search: truth and belief are drawn in one frame, that of the robot's odometry."""

import numpy as np
import pytest

from behaviors.adaptive.grid_cells import CELL_MM, Cells
from behaviors.adaptive.world_model import WorldModel
from behaviors.events import Reason
from behaviors.evidence import Evidence, Viewpoint
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.tools.dev.search_map import AROUND_PX, BLUE, OBSTACLE, VIOLET, drawn, from_start, pixel


@pytest.fixture
def scenario():
    return generate_scenario("open", 1)


def test_the_world_is_turned_into_the_frame_of_the_start(scenario):
    robot = scenario.world.robot.model_copy(update={"start_mm": (1000.0, 500.0), "heading_deg": 90.0})
    truth = scenario.world.model_copy(update={"robot": robot})
    assert from_start((1000.0, 1500.0), truth) == pytest.approx((1000.0, 0.0))
    assert from_start((0.0, 500.0), truth) == pytest.approx((0.0, 1000.0))


def test_obstacles_target_and_viewpoints_are_where_they_are(scenario):
    truth, mission = scenario.world, scenario.mission
    target = mission.mission.targets[0]
    world = WorldModel(mission)
    middle = Cells().side // 2
    world.floor.log_odds[middle - 6 : middle + 6, middle - 6 : middle + 6] = -1.0
    world.floor.log_odds[middle + 6, middle : middle + 3] = 2.0
    world.plan()
    viewpoints = (Viewpoint(2.0, 7.0, 0.5, route=((0.0, 0.0), (400.0, 240.0))),)
    evidence = Evidence(
        target=target,
        reason=Reason.FULL_TURN_WITHOUT_SIGHTING,
        seen_since_search=False,
        researches=0,
        viewpoints=viewpoints,
    )
    image = drawn(world, mission, evidence, truth)

    width, depth = truth.floor.size_mm
    corners = [pixel(Cells(), from_start(each, truth)) for each in ((0, 0), (width, 0), (width, depth), (0, depth))]
    edge = np.maximum(np.min(corners, axis=0) - AROUND_PX, 0)

    def color(at):
        x, y = np.subtract(at, edge)
        return tuple(int(value) for value in image[y, x])

    (shown,) = (each for each in truth.pictures if each.name == target)
    assert color(pixel(Cells(), from_start(shown.at_mm, truth))) == BLUE
    assert color(pixel(Cells(), (6.5 * CELL_MM, 1.2 * CELL_MM))) == OBSTACLE
    x, y = pixel(Cells(), (400.0, 240.0))
    assert color((x + 12, y)) == VIOLET
