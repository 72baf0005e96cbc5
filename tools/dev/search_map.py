"""Draw the adaptive profile's map and beliefs when it chooses a viewpoint, over the scenario's true walls.

    python -m tools.dev.search_map CLASS SEED [--from S] [--to S] [--most N] --out FILE.png

One map for each decision: cells are red where the map has an obstacle and green where it is free, blue lines are the
true walls, a blue cross the true target, violet discs the belief. Each place that is considered has a label with its
gain in thousandths (black) and the seconds to get there (green); circles mark the robot (black) and the viewpoints that
are offered (violet).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from behaviors.adaptive.belief_tuning import SPACING_MM
from behaviors.adaptive.candidate_generator import CandidateGenerator
from behaviors.adaptive.grid_cells import CELL_MM, Cells
from behaviors.adaptive.grid_tuning import HINT
from behaviors.adaptive.world_model import WorldModel
from behaviors.evidence import Evidence
from behaviors.executive import Executive
from behaviors.mission import Mission
from behaviors.ports import Point
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.skills import SkillContext
from behaviors.target_queue import TargetQueue
from nxtdrive.recording.output_file import write_file
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.scenario import generate_scenario
from sim_backend.plane import along_and_across
from sim_backend.world.world_file import WorldFile

from .program import parser

Image = NDArray[np.uint8]

CELL_PX = 9
BLUE, BLACK, GREEN, VIOLET = (255, 0, 0), (0, 0, 0), (0, 110, 0), (200, 0, 200)
OBSTACLE, FREE, UNKNOWN = (130, 130, 255), (225, 255, 225), (225, 225, 225)
BELIEF_PX, MIN_BELIEF = 80, 0.001
"""Radius of the disc of a belief of 1, and the least belief that has one."""

AROUND_PX = 60


def main() -> None:
    """Run the mission and write the picture."""
    arguments = parser(__doc__)
    arguments.add_argument("kind", metavar="CLASS", help="class of the scenario")
    arguments.add_argument("seed", metavar="SEED", type=int)
    arguments.add_argument("--from", dest="start_s", metavar="S", type=float, default=0.0, help="first moment, seconds")
    arguments.add_argument("--to", dest="end_s", metavar="S", type=float, default=math.inf, help="last moment, seconds")
    arguments.add_argument("--most", metavar="N", type=int, default=3, help="draw at most this many decisions")
    arguments.add_argument("--out", type=Path, required=True)
    args = arguments.parse_args()
    maps: list[Image] = []

    def watch(profile: AdaptiveProfile, mission: Mission, evidence: Evidence) -> None:
        if args.start_s <= episode.time_s <= args.end_s and len(maps) < args.most:
            maps.append(drawn(profile.world, mission, evidence, scenario.world))
            cv2.putText(maps[-1], f"{episode.time_s:.0f} s {evidence.target}", (5, 14), 0, 0.5, BLACK)

    scenario = generate_scenario(args.kind, args.seed)
    with closing(Episode(scenario, "geometric")) as episode:
        robot = episode.robot
        Executive(robot.mission, robot.ports, robot.observers, _watched(watch)).run()
    if not maps:
        arguments.error("no viewpoint was considered in that time; choose another --from and --to")
    height = max(each.shape[0] for each in maps)
    rows = [cv2.copyMakeBorder(each, 0, height - len(each), 0, 4, cv2.BORDER_CONSTANT) for each in maps]
    write_file(args.out, cv2.imencode(".png", np.hstack(rows))[1].tobytes())
    print(f"{args.out}: {len(maps)} decisions")


def _watched(
    watch: Callable[[AdaptiveProfile, Mission, Evidence], None],
) -> Callable[[SkillContext, Mission, TargetQueue], AdaptiveProfile]:
    """Return a function that makes an adaptive profile and observes each decision before it is taken."""

    class Watched(AdaptiveProfile):
        def __init__(self, context: SkillContext, mission: Mission, queue: TargetQueue) -> None:
            super().__init__(context, mission, queue)
            self._mission = mission

        def evidence(self, basis: Evidence) -> Evidence:
            evidence = super().evidence(basis)
            if evidence.viewpoints:
                watch(self, self._mission, evidence)
            return evidence

    return Watched


def drawn(world: WorldModel, mission: Mission, evidence: Evidence, truth: WorldFile) -> Image:
    """Draw one decision.

    Args:
        world: The profile's world model.
        mission: The mission, with the profile's parameters.
        evidence: The evidence of the decision: the target, and the viewpoints that are offered.
        truth: The scenario's world, with true walls.
    """
    image, cells = _floor(world), world.floor.cells
    corners = _true_walls(image, cells, truth)
    _belief(image, world, evidence.target)
    for picture in truth.pictures:
        if picture.name == evidence.target:
            at = pixel(cells, from_start(picture.at_mm, truth))
            cv2.drawMarker(image, at, BLUE, cv2.MARKER_TILTED_CROSS, 14, 2)
    for gain in CandidateGenerator(world, mission.adaptive).gains(evidence.target):
        x, y = pixel(cells, gain.place)
        cv2.putText(image, f"{1000 * gain.chance:.0f}", (x - 8, y + 3), 0, 0.33, BLACK)
        cv2.putText(image, f"{gain.travel_s:.0f}", (x - 8, y + 13), 0, 0.28, GREEN)
    cv2.circle(image, pixel(cells, world.here), 10, BLACK, 2)
    for viewpoint in evidence.viewpoints:
        if viewpoint.route:
            cv2.circle(image, pixel(cells, viewpoint.route[-1]), 12, VIOLET, 2)
    left, top = np.maximum(corners.min(axis=0) - AROUND_PX, 0)
    right, bottom = corners.max(axis=0) + AROUND_PX
    return image[top:bottom, left:right].copy()


def from_start(place_mm: Point, truth: WorldFile) -> Point:
    """Return a place of the world in the robot's odometry frame: ahead of its start, and to the right."""
    x, y = (float(to - start) for to, start in zip(place_mm, truth.robot.start_mm, strict=True))
    return along_and_across(x, y, truth.robot.heading_deg)


def pixel(cells: Cells, place_mm: Point) -> tuple[int, int]:
    """Return where a place of a map is drawn before the edges are cut off: ahead is up."""
    middle = cells.side * CELL_PX / 2
    return int(middle + place_mm[1] / CELL_MM * CELL_PX), int(middle - place_mm[0] / CELL_MM * CELL_PX)


def _floor(world: WorldModel) -> Image:
    image = np.full((*world.floor.log_odds.shape, 3), UNKNOWN, np.uint8)
    image[world.floor.log_odds < -HINT] = FREE
    image[world.floor.log_odds > HINT] = OBSTACLE
    return np.flipud(image).repeat(CELL_PX, axis=0).repeat(CELL_PX, axis=1).copy()


def _true_walls(image: Image, cells: Cells, truth: WorldFile) -> NDArray[np.int64]:
    """Draw the walls; return the corners of the floor in pixels."""
    width, depth = truth.floor.size_mm
    corners = [pixel(cells, from_start(each, truth)) for each in ((0, 0), (width, 0), (width, depth), (0, depth))]
    cv2.polylines(image, [np.array(corners)], isClosed=True, color=BLUE)
    for wall in truth.walls:
        cv2.line(
            image, pixel(cells, from_start(wall.from_mm, truth)), pixel(cells, from_start(wall.to_mm, truth)), BLUE
        )
    return np.array(corners)


def _belief(image: Image, world: WorldModel, target: str) -> None:
    belief, cells = world.targets.beliefs[target], world.floor.cells
    by_place = belief.by_place()
    for i, j in zip(*np.nonzero(by_place > MIN_BELIEF), strict=True):
        place = i * SPACING_MM - belief.reach_mm, j * SPACING_MM - belief.reach_mm
        cv2.circle(image, pixel(cells, place), round(BELIEF_PX * math.sqrt(by_place[i, j])), VIOLET)


if __name__ == "__main__":
    main()
