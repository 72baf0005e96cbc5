"""A simulated room made from the map of a run, so that a mission on a real robot can be repeated in the simulator.

It has only what the run found: obstacles where the sonar found them, targets where the camera located them, the
robot as the mission describes it. An obstacle past which a target was seen is low. Unknown floor is free, no people
walk about, and targets that were never seen are missing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from behaviors.adaptive.grid_cells import CELL_MM
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.ports import Point, Pose
from nxtdrive.recording.map.scene import MapScene, gather, pose_of, sighted_at
from nxtdrive.simulated.scenario import Scenario
from sim_backend.toml_file import check
from sim_backend.world.world_file import MIN_RADIUS_MM, WorldFile

KIND = "rebuilt"
"""Class of the scenario, for displays."""
LIKELY = 0.8
"""Cells with more evidence than this are obstacles: several echoes came from there."""
EDGE_MM = 400.0
"""The room ends this far beyond everything that the run has a place for."""
TALL_MM = 600.0
"""Height of an obstacle above the camera: it hides what is behind it."""
TARGETS_OWN_MM = 250.0
"""Obstacles this near to a target are the target itself."""
OVER_MM = 60.0
"""A target was seen over obstacles this near to the line of sight."""
ROOM_MM = 160.0
"""Obstacles this near to the path of the middle of a usual robot are errors of the map: the robot was there."""
LATEST = 15
"""A target's place is the median of its last sightings: the nearest ones, mostly."""
MARGIN_MM = 15.0
"""By this the mission's robot is larger than the body, for safety."""
ABSENT = {
    "left_reversed": False,
    "right_reversed": False,
    "wheel_mismatch_percent": 0.0,
    "turn_slip_percent": 0.0,
}
"""What the simulated robot does not have, as a mission describes it."""
SHARED_CAMERA = ("hfov_deg", "height_mm", "forward_mm", "right_mm", "yaw_deg", "tilt_deg", "roll_deg", "latency_s")


def rebuilt(records: Sequence[Record], mission: Mission) -> Scenario:
    """Return a run's mission in the room that its map shows.

    Args:
        records: The run's journal.
        mission: What the robot did.

    Raises:
        ValueError: The journal has no path, or the simulator cannot have such a robot.
    """
    scene = gather(records, mission)
    if not scene.poses:
        raise ValueError("the journal says nowhere where the robot was")
    looks = list(_looks(records, mission))
    targets = _targets(looks, mission)
    low, high = _corners([*scene.points(), *(at for at, _ in targets.values())])
    cells = _obstacles(scene, [at for at, _ in targets.values()], max(ROOM_MM, mission.robot.radius_mm))
    over = {cell for cell in cells if any(_between(cell, look) for look in looks)}
    heights = (over, (mission.camera.height_mm + mission.robot.sonar_height_mm) / 2), (cells - over, TALL_MM)
    world = {
        "title": f"the room of {mission.mission.name}, as the robot mapped it",
        "floor": {"size_mm": (high[0] - low[0], high[1] - low[1])},
        "robot": {"start_mm": (-low[0], -low[1]), **_robot(mission)},
        "camera": {name: getattr(mission.camera, name) for name in SHARED_CAMERA},
        "ultrasonic": {"forward_mm": mission.robot.sonar_forward_mm, "height_mm": mission.robot.sonar_height_mm},
        "sensors": [{"kind": "compass", "port": mission.robot.compass}] if mission.robot.compass else [],
        "boxes": [
            {"name": f"{height_mm:.0f} mm, {number}", "at_mm": _minus(at, low), "size_mm": size, "height_mm": height_mm}
            for each, height_mm in heights
            for number, (at, size) in enumerate(_blocks(each), 1)
        ],
        "pictures": [
            {
                "name": name,
                "at_mm": _minus(at, low),
                "facing_deg": facing_deg,
                "size_mm": (mission.target[name].height_mm,) * 2,
                "centre_height_mm": max(mission.camera.height_mm, mission.target[name].height_mm / 2),
            }
            for name, (at, facing_deg) in targets.items()
        ],
    }
    room, problems = check(WorldFile, world)
    if room is None:
        raise ValueError(f"the simulator has no such robot: {'; '.join(each.sentence for each in problems)}")
    return Scenario(KIND, 0, room, mission.model_copy(update={"robot": mission.robot.model_copy(update=ABSENT)}))


def _robot(mission: Mission) -> dict[str, Any]:
    robot = mission.robot
    return {
        "radius_mm": max(MIN_RADIUS_MM, robot.radius_mm - MARGIN_MM),
        "wheel_diameter_mm": robot.wheel_diameter_mm,
        "track_mm": robot.axle_track_mm,
        "left_port": robot.left,
        "right_port": robot.right,
        "touch_port": robot.touch,
        "ultrasonic_port": robot.ultrasonic,
    }


@dataclass(frozen=True, slots=True)
class _Look:
    """A sighting: which target, from where, and its place."""

    target: str
    pose: Pose
    place: Point


def _looks(records: Sequence[Record], mission: Mission) -> Iterator[_Look]:
    for record in records:
        pose = pose_of(record) if record.kind is RecordKind.LOOK else None
        place = pose and sighted_at(record, pose, mission.camera)
        if pose and place:
            yield _Look(record.target, pose, place)


def _targets(looks: Sequence[_Look], mission: Mission) -> dict[str, tuple[Point, float]]:
    """Return the place of each target that was seen, and the direction from there to where it was seen from."""
    found = {}
    for target in mission.mission.targets:
        latest = [look for look in looks if look.target == target][-LATEST:]
        if latest:
            x_mm, y_mm = (median(look.place[axis] for look in latest) for axis in (0, 1))
            here = latest[-1].pose
            found[target] = (x_mm, y_mm), math.degrees(math.atan2(here.y_mm - y_mm, here.x_mm - x_mm))
    return found


def _between(cell: Point, look: _Look) -> bool:
    """Return whether the line of sight of a look crosses a cell."""
    forward_mm = math.dist(look.place, look.pose.point)
    bearing = math.atan2(look.place[1] - look.pose.y_mm, look.place[0] - look.pose.x_mm)
    x_mm, y_mm = cell[0] - look.pose.x_mm, cell[1] - look.pose.y_mm
    along_mm = x_mm * math.cos(bearing) + y_mm * math.sin(bearing)
    aside_mm = y_mm * math.cos(bearing) - x_mm * math.sin(bearing)
    return 0.0 < along_mm < forward_mm and abs(aside_mm) <= OVER_MM


def _obstacles(scene: MapScene, targets: Sequence[Point], room_mm: float) -> set[Point]:
    """Return the cells with an obstacle that is not a target and farther than `room_mm` from the robot's path."""
    path = [pose.point for pose, _ in scene.poses]
    return {
        cell
        for cell in scene.cells(LIKELY)
        if all(math.dist(cell, at) > TARGETS_OWN_MM for at in targets)
        and all(math.dist(cell, at) > room_mm for at in path)
    }


def _blocks(cells: Iterable[Point]) -> list[tuple[Point, tuple[float, float]]]:
    """Join cells that lie in a line along x; return the middle of each block and its size along both axes."""
    blocks: list[list[float]] = []
    for x_mm, y_mm in sorted(cells, key=lambda cell: (cell[1], cell[0])):
        last = blocks[-1] if blocks else None
        if last and last[2] == y_mm and x_mm - last[1] < 1.5 * CELL_MM:
            last[1] = x_mm
        else:
            blocks.append([x_mm, x_mm, y_mm])
    return [(((first + end) / 2, y_mm), (end - first + CELL_MM, CELL_MM)) for first, end, y_mm in blocks]


def _corners(points: Sequence[Point]) -> tuple[Point, Point]:
    """Return opposite corners of the room."""
    x, y = [point[0] for point in points], [point[1] for point in points]
    return (min(x) - EDGE_MM, min(y) - EDGE_MM), (max(x) + EDGE_MM, max(y) + EDGE_MM)


def _minus(point: Point, origin: Point) -> Point:
    return round(point[0] - origin[0], 1), round(point[1] - origin[1], 1)
