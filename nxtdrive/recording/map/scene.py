"""The contents of a run's map, from its journal: path, obstacles as the sonar found them, sightings, events.

Everything is in the frame of the robot's start and as the robot measured it: x forward, y to the right, millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median_high

import numpy as np

from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.mission.robot import CameraTable, RobotTable
from behaviors.ports import Point, Pose
from input_files.plain import is_number
from nxtdrive.recording.map.events import EventReader, MapEvent

Line = tuple[float, float, float, float]
"""Both ends of a line on the floor: x0_mm, y0_mm, x1_mm, y1_mm."""
FARTHEST_MM = 1e6
"""Numbers beyond this are not places."""
FOOTPRINT_STEP_MM = 60.0
"""After each such stretch the floor under the robot is marked free."""
LAST = 9
"""A target's place on the map is the median of this many last sightings, which are usually the nearest."""
START = Pose(0.0, 0.0, 0.0)


@dataclass(slots=True)
class MapScene:
    """Data of a journal for the map.

    Attributes:
        poses: Where the robot was, and the state in which it got there.
        echoes: Where the sonar received its echoes from.
        sightings: Where the camera located each target.
        events: What happened.
        floor: Obstacles as the sonar found them.
    """

    poses: list[tuple[Pose, str]] = field(default_factory=list)
    echoes: list[Point] = field(default_factory=list)
    sightings: dict[str, list[Point]] = field(default_factory=dict)
    events: list[MapEvent] = field(default_factory=list)
    floor: OccupancyGrid = field(default_factory=OccupancyGrid)

    def points(self) -> list[Point]:
        """Return every place that must be on the map. Single sightings may be of something else far away."""
        seen = (target_place(points) for points in self.sightings.values())
        return [(0.0, 0.0), *(pose.point for pose, _ in self.poses), *self.echoes, *seen]

    def pieces(self) -> list[tuple[str, list[Point]]]:
        """Return the path in pieces, each with the state in which it was driven."""
        pieces: list[tuple[str, list[Point]]] = []
        here: Point = (0.0, 0.0)
        for pose, state in self.poses:
            there = pose.point
            if there != here:
                if not pieces or pieces[-1][0] != state:
                    pieces.append((state, [here]))
                pieces[-1][1].append(there)
            here = there
        return pieces

    def cells(self, least: float, most: float = math.inf) -> list[Point]:
        """Return the middles of the cells whose log odds of an obstacle are above `least` and up to `most`.

        The outermost cells are left out: of a grid that can grow no further they stand for everything beyond it.
        """
        inner = self.floor.log_odds[1:-1, 1:-1]
        rows, columns = np.nonzero((inner > least) & (inner <= most))
        x_mm, y_mm = (self.floor.cells.centre_mm(each + 1) for each in (rows, columns))
        return list(zip(x_mm.tolist(), y_mm.tolist(), strict=True))


def target_place(points: Sequence[Point]) -> Point:
    """Return the estimated place of a target."""
    xs_mm, ys_mm = zip(*points[-LAST:], strict=True)
    return median_high(xs_mm), median_high(ys_mm)


def gather(records: Sequence[Record], mission: Mission | None = None) -> MapScene:
    """Extract the map's contents from a journal; the mission gives the robot's dimensions."""
    robot, camera = (mission.robot, mission.camera) if mission else (RobotTable(), CameraTable())
    scene, reader, here, stood = MapScene(floor=OccupancyGrid(robot)), EventReader(), START, Pose(math.inf)
    has_sonar = robot.ultrasonic != 0
    for record in records:
        if record.kind is RecordKind.SENSOR and record.data.get("sensor") == "sonar":
            has_sonar = bool(record.data.get("answers"))
        pose = pose_of(record)
        if pose is not None:
            here = pose
            scene.poses.append((here, record.state))
            if stood.distance_mm_to(here) >= FOOTPRINT_STEP_MM:
                stood = here
                scene.floor.clear_footprint(here)
            if record.kind in (RecordKind.LOOK, RecordKind.ECHO):
                _add_look(scene, record, here, camera, has_sonar=has_sonar)
        event = reader.read(record, here)
        if event:
            scene.events.append(event)
    return scene


def _add_look(scene: MapScene, record: Record, here: Pose, camera: CameraTable, *, has_sonar: bool) -> None:
    range_mm = _number(record.data.get("range_mm"))
    if range_mm is None and has_sonar:  # without a sonar, nothing is known about what is ahead
        scene.floor.add_no_echo(here)
    elif range_mm is not None:
        scene.echoes.append(here.ahead(scene.floor.sonar_forward_mm + range_mm))
        scene.floor.add_echo(here, range_mm)
    place = sighted_at(record, here, camera)
    if place is not None:
        scene.sightings.setdefault(record.target, []).append(place)


def sighted_at(record: Record, here: Pose, camera: CameraTable) -> Point | None:
    """Return where a look located the target; None if it did not see it, or only bounds its distance."""
    sighting = record.data.get("sighting")
    if not isinstance(sighting, dict) or sighting.get("bound"):
        return None
    distance_mm, bearing_deg = _number(sighting.get("distance_mm")), _number(sighting.get("bearing_deg"))
    if distance_mm is None or bearing_deg is None:
        return None
    return camera.lens_at(here).ahead(distance_mm, bearing_deg)


def pose_of(record: Record) -> Pose | None:
    """Return where the robot was, if a record says it."""
    value = record.data.get("pose")
    if not isinstance(value, list) or len(value) != 3:
        return None
    x_mm, y_mm, heading_deg = map(_number, value)
    return None if x_mm is None or y_mm is None or heading_deg is None else Pose(x_mm, y_mm, heading_deg)


def _number(value: object) -> float | None:
    return float(value) if is_number(value) and abs(value) <= FARTHEST_MM else None  # not NaN, either
