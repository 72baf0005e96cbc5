"""Judge by the ground truth of a running simulation where everything stands, and whether a stop is an arrival.

For referees, oracles and rewards; code that drives the robot never reads it. Definitions: docs/evaluation.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim_backend.scenarios.floor_plan import FloorPlan, Goal, Obstacle
from sim_backend.scenarios.room_builder import box_obstacle, picture_obstacle, wall_obstacle
from sim_backend.simulation import Simulation
from sim_backend.world.truth import TruePose

CAMERA_FORWARD_MM, CAMERA_HEIGHT_MM = 60.0, 200.0
"""Position of the world file's default camera."""


@dataclass(frozen=True, slots=True)
class Scene:
    """The positions of all objects.

    Attributes:
        plan: All obstacles.
        goals: The pictures that are present, by name.
    """

    plan: FloorPlan
    goals: dict[str, Goal]


def scene(simulation: Simulation) -> Scene:
    """Return where everything is at this moment."""
    heights = {picture.name: picture.centre_height_mm for picture in simulation.world_file.pictures}
    goals = {
        name: Goal(name, (at.x_mm, at.y_mm), at.heading_deg, heights[name])
        for name, at in simulation.truth.pictures.items()
    }
    return Scene(survey(simulation), goals)


def stop_counts(pose: TruePose, scene: Scene, target: str) -> bool:
    """Return whether a stop here is an arrival: near, in front, and with the picture not hidden from the camera."""
    goal = scene.goals.get(target)
    if goal is None:
        return False
    heading = math.radians(pose.heading_deg)
    forward = (CAMERA_FORWARD_MM * math.cos(heading), CAMERA_FORWARD_MM * math.sin(heading))
    eye = np.array([[pose.x_mm + forward[0], pose.y_mm + forward[1]]])
    return bool(goal.covers(eye)[0] and scene.plan.sees(eye, CAMERA_HEIGHT_MM, goal)[0])


def survey(simulation: Simulation) -> FloorPlan:
    """Return the floor plan of this moment."""
    world, truth = simulation.world_file, simulation.truth
    obstacles = [wall_obstacle(wall, i) for i, wall in enumerate(world.walls)]
    boxes, pictures, people = truth.boxes, truth.pictures, truth.people
    for box in world.boxes:
        if box.name in boxes:
            at = boxes[box.name]
            obstacles.append(box_obstacle(box, (at.x_mm, at.y_mm), at.heading_deg))
    for picture in world.pictures:
        if picture.name in pictures:
            at = pictures[picture.name]
            obstacles.append(picture_obstacle(picture, (at.x_mm, at.y_mm), at.heading_deg))
    for person in world.people:
        if person.name in people:
            obstacles.append(
                Obstacle(person.name, people[person.name], radius_mm=person.radius_mm, height_mm=person.height_mm)
            )
    return FloorPlan(world.floor.size_mm, tuple(obstacles))
