"""Hang the targets that a robot has not had in view yet elsewhere: anywhere it does not know of.

What a choice was worth depends on where the targets are, and a robot that searches cannot know that. Another place in
each future measures the choice by what could be known.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from random import Random

import numpy as np

from sim_backend.camera.scene import Viewpoint
from sim_backend.evaluation import current_floor_plan
from sim_backend.plane import Point, on_map, sides_of
from sim_backend.scenarios.flats import FLAT_TARGETS_APART_MM
from sim_backend.scenarios.floor_plan import Goal
from sim_backend.scenarios.room_builder import AT_WALL_DEG, AT_WALL_MM, CLEARANCE_MM, ROBOT_RADIUS_MM
from sim_backend.simulation import Simulation
from sim_backend.world.world_file import WorldFile

LOOK_MS = 100
"""How often the camera's view is noted."""
TRIES = 300
"""Places to try for a target; if none will do, it stays where it is."""
CORNER_MM = 300.0
"""Smallest distance from a wall's ends."""
OFF_ROBOT_MM = 300.0
"""Smallest distance from the middle of the robot."""
GAP_MM = 10.0
"""Smallest distance of a picture's edges from walls and objects."""


class UnseenTargets:
    """The targets that have not been in view since this was made, and everything that was.

    Pictures that an event moves stay where they are.

    Args:
        simulation: The simulation, at the start of its mission.
        targets: Names of the targets.
        view_mm: Largest distance at which a target can be recognised.
    """

    def __init__(self, simulation: Simulation, targets: Sequence[str], view_mm: float) -> None:
        self._simulation, self._view_mm = simulation, view_mm
        moved = {event.picture for event in simulation.world.file.events}
        self._unseen = {name for name in targets if name in simulation.truth.pictures and name not in moved}
        self._views: list[Viewpoint] = []
        self._walls = [each for each in _walls(simulation.world.file) if math.dist(*each[:2]) > 2 * CORNER_MM]
        self._look()

    def _look(self) -> None:
        simulation, now = self._simulation, self._simulation.world.viewpoint()
        if not self._views or self._views[-1] != now:
            self._views.append(now)
        self._unseen = {name for name in self._unseen if not self._shows(now, name)}
        simulation.at(simulation.now_ms + LOOK_MS, self._look)

    def _shows(self, view: Viewpoint, name: str) -> bool:
        at = self._simulation.truth.pictures[name]
        near = math.dist((view.x_mm, view.y_mm), (at.x_mm, at.y_mm)) <= self._view_mm
        return near and self._simulation.world.in_view(name, view)

    def hang_elsewhere(self, future: int) -> None:
        """Hang each of them at another wall, where it can be reached and has not been in view either.

        Args:
            future: Selects the places.
        """
        for name in sorted(self._unseen):
            random = Random(f"{name} in future {future}")
            at = self._simulation.truth.pictures[name]
            if not any(self._hangs(name, *_beside(random, self._walls)) for _ in range(TRIES if self._walls else 0)):
                self._simulation.world.place(name, (at.x_mm, at.y_mm), at.heading_deg, present=True)

    def _hangs(self, name: str, at_mm: Point, facing_deg: float) -> bool:
        """Hang a target at a place; return whether it may stay there."""
        simulation, truth = self._simulation, self._simulation.truth
        pose = truth.pose
        others = [(each.x_mm, each.y_mm) for other, each in truth.pictures.items() if other != name]
        near_robot = math.dist(at_mm, (pose.x_mm, pose.y_mm)) < OFF_ROBOT_MM
        if near_robot or any(math.dist(at_mm, other) < FLAT_TARGETS_APART_MM for other in others):
            return False
        picture = next(each for each in simulation.world.file.pictures if each.name == name)
        half_mm, facing = picture.size_mm[0] / 2, math.radians(facing_deg)
        edges = np.array([on_map(at_mm, facing, 0.0, aside) for aside in (-half_mm, 0.0, half_mm)])
        simulation.world.place(name, None, None, present=False)
        plan = current_floor_plan(simulation)
        simulation.world.place(name, at_mm, facing_deg, present=True)
        return (
            bool(np.all(plan.clearance_mm(edges) >= GAP_MM))
            and not any(self._shows(view, name) for view in self._views)
            and plan.reachable(
                (pose.x_mm, pose.y_mm),
                [Goal(name, at_mm, facing_deg, picture.centre_height_mm)],
                ROBOT_RADIUS_MM + CLEARANCE_MM,
            )
        )


def _walls(world: WorldFile) -> Iterator[tuple[Point, Point, float]]:
    """Yield both ends of each side of each wall, from which the room is to the right, and half the wall's thickness."""
    width, depth = world.floor.size_mm
    corners = [(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)]
    for start, end in sides_of(corners):
        yield start, end, 0.0
    for wall in world.walls:
        yield wall.from_mm, wall.to_mm, wall.thickness_mm / 2
        yield wall.to_mm, wall.from_mm, wall.thickness_mm / 2


def _beside(random: Random, walls: Sequence[tuple[Point, Point, float]]) -> tuple[Point, float]:
    """Draw a place near a wall, all metres of wall alike, and a direction away from it, degrees."""
    lengths = [math.dist(start, end) - 2 * CORNER_MM for start, end, _ in walls]
    (x0, y0), (x1, y1), half_mm = random.choices(walls, lengths)[0]
    along = math.atan2(y1 - y0, x1 - x0)
    ahead = random.uniform(CORNER_MM, math.dist((x0, y0), (x1, y1)) - CORNER_MM)
    at = on_map((x0, y0), along, ahead, half_mm + random.uniform(*AT_WALL_MM))
    return at, math.degrees(along) + 90.0 + random.uniform(-AT_WALL_DEG, AT_WALL_DEG)
