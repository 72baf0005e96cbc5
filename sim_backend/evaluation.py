"""The ground truth of a running simulation: where everything stands, and whether a stop is an arrival.

For evaluation, oracles and rewards; code that drives the robot never reads it. Definitions: docs/evaluation.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim_backend.plane import on_map
from sim_backend.scenarios.floor_plan import FloorPlan, Goal, Obstacle
from sim_backend.scenarios.room_builder import obstacles
from sim_backend.simulation import Simulation
from sim_backend.world.truth import TruePose


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
    heights = {picture.name: picture.centre_height_mm for picture in simulation.world.file.pictures}
    goals = {
        name: Goal(name, (at.x_mm, at.y_mm), at.heading_deg, heights[name])
        for name, at in simulation.truth.pictures.items()
    }
    return Scene(current_floor_plan(simulation), goals)


def stop_counts(pose: TruePose, scene: Scene, target: str) -> bool:
    """Return whether a stop here is an arrival: near, in front, and with the picture not hidden from the camera."""
    goal = scene.goals.get(target)
    if goal is None:
        return False
    mounted = scene.plan.camera
    heading = math.radians(pose.heading_deg)
    camera = np.array([on_map((pose.x_mm, pose.y_mm), heading, mounted.forward_mm, mounted.right_mm)])
    return bool(goal.covers(camera)[0] and scene.plan.sees(camera, goal)[0])


def current_floor_plan(simulation: Simulation) -> FloorPlan:
    """Return the floor plan of this moment."""
    world, truth = simulation.world.file, simulation.truth
    boxes, pictures = (
        {name: ((at.x_mm, at.y_mm), at.heading_deg) for name, at in poses.items()}
        for poses in (truth.boxes, truth.pictures)
    )
    places = truth.people
    people = (
        Obstacle(person.name, places[person.name], radius_mm=person.radius_mm, height_mm=person.height_mm)
        for person in world.people
        if person.name in places
    )
    return FloorPlan(world.floor.size_mm, (*obstacles(world, boxes, pictures), *people), world.camera)
