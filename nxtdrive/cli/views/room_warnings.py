"""Warn of simulated rooms that are valid but in which a robot cannot do what was probably intended."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from nxtdrive.mission.truth import FAR_MM
from sim_backend.evaluation import Scene, scene
from sim_backend.plane import wrapped_deg
from sim_backend.scenarios.floor_plan import FloorPlan, Goal
from sim_backend.simulation import Simulation
from sim_backend.world.placement import solid_outlines
from sim_backend.world.toml_types import PRINT_M, ROOM_M, in_other_unit
from sim_backend.world.world_file import WorldFile

MAX_STRETCH = 1.25
"""Photographs of a print are cropped less exactly than this, but rarely."""
TINY_PRINT_MM = 60.0
"""A print with no side longer than this is found only from very near; an A2 sheet has 59.4 cm."""
STOP_SHARE = 1.4
"""A frame shows the whole of a picture from this many times its longer side, and the robot stops no farther away."""


def room_warnings(simulation: Simulation) -> Iterator[str]:
    """Yield what is probably not intended in a room that was just opened, each with the path of its key.

    Pictures that are stretched or tiny, that hang too high or stand too low for the camera, that face a wall, or to
    which no path leads; people who come in inside a box or an inner wall; and a tiny room.
    """
    world = simulation.world.file
    if world.floor.is_tiny:
        yield f"floor.size_mm: the room is tiny; if that is {in_other_unit(world.floor.size_mm, ROOM_M)}."
    solid = solid_outlines(world)
    for index, person in enumerate(world.people):
        for outline in solid:
            if outline.distance_mm(person.enters_from_mm) == 0:
                yield (
                    f"people[{index}].enters_from_mm: {person.name} comes in inside {outline.what}. Move the door to "
                    "its edge or to a wall of the room."
                )
    fronts, now = simulation.truth.front_images(), _lasting(simulation)
    for index, picture in enumerate(world.pictures):
        path, name = f"pictures[{index}]", picture.name
        height, width = fronts[name].shape[:2]
        wide_mm, high_mm = picture.size_mm
        if not 1 / MAX_STRETCH < wide_mm / high_mm * height / width < MAX_STRETCH:
            yield (
                f"{path}.size_mm: {name} is stretched: its image has {width}x{height} pixels. Width "
                f"comes first; {high_mm:g} mm high it would be {high_mm * width / height:.0f} mm wide."
            )
        if max(picture.size_mm) <= TINY_PRINT_MM:
            yield f"{path}.size_mm: {name} is tiny; if that is {in_other_unit(picture.size_mm, PRINT_M)}."
        if simulation.truth.whole_from_mm(name) > FAR_MM:
            yield (
                f"{path}.centre_height_mm: the camera, {world.camera.height_mm:g} mm above the floor, sees the "
                f"whole of {name} only from far away; bring it nearer to that height."
            )
        if name in now.goals and not world.floor.is_tiny:
            yield from _unreachable(path, now.plan, now.goals[name], world)


def _lasting(simulation: Simulation) -> Scene:
    """Return where everything is, without the boxes that may leave their place and the pictures that events change."""
    world, now = simulation.world.file, scene(simulation)
    moving = {event.box for event in world.events} | {event.picture for event in world.events}
    moving |= {box.name for box in world.boxes if box.mass_kg is not None}
    obstacles = tuple(each for each in now.plan.obstacles if each.name not in moving)
    stops_mm = {picture.name: STOP_SHARE * max(picture.size_mm) for picture in world.pictures}
    goals = {
        name: replace(goal, reach_mm=max(goal.reach_mm, stops_mm[name]))
        for name, goal in now.goals.items()
        if name not in moving
    }
    return Scene(replace(now.plan, obstacles=obstacles), goals)


def _unreachable(path: str, plan: FloorPlan, goal: Goal, world: WorldFile) -> Iterator[str]:
    """Warn of a picture to which no path leads, unless an event carries the robot elsewhere."""
    robot, name = world.robot, goal.name
    if not plan.has_stop(goal, robot.radius_mm):
        turned = replace(goal, facing_deg=wrapped_deg(goal.facing_deg + 180))
        turn = f", or turn it round by facing_deg = {turned.facing_deg % 360:g}"
        remedy = f"move one of them{turn if plan.has_stop(turned, robot.radius_mm) else ''}"
        yield (
            f"{path}.facing_deg: {name} looks at a wall, a box or another picture right in front of it, so the robot "
            f"cannot see it from anywhere; {remedy}."
        )
    elif not plan.reachable(robot.start_mm, [goal], robot.radius_mm) and not any(e.robot for e in world.events):
        yield (
            f"{path}.at_mm: no path leads from the robot's start to where it would see {name}; the robot needs a gap "
            f"of {2 * robot.radius_mm:g} mm."
        )
