"""Read the floor plan of a running simulation from its ground truth, for the oracle and the referee."""

from __future__ import annotations

from sim_backend.scenarios.floor_plan import FloorPlan, Obstacle
from sim_backend.scenarios.room_builder import box_obstacle, picture_obstacle, wall_obstacle
from sim_backend.simulation import Simulation


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
