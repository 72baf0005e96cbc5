"""The world model: the robot's poses, the map, past attempts, and the memory of the targets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from behaviors.adaptive.attempts import Attempts
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.adaptive.path_planner import PathPlanner
from behaviors.adaptive.recent_echoes import RecentEchoes
from behaviors.adaptive.target_memory import TargetMemory
from behaviors.adaptive.turn_scale import Beam, corrected
from behaviors.adaptive.visible_floor import FloorRanges
from behaviors.angles import wrapped_deg
from behaviors.events import Event, Reason
from behaviors.failures import Blocker, Failure
from behaviors.mission import Mission
from behaviors.ports import FloorRay, Glimpse, Point, Pose, Sighting
from behaviors.pose_history import PoseHistory

SAME_BLOCKER_S = 40.0
SAME_BLOCKER_MM = 400.0
"""A blocker is the last one again if that was no longer ago and no farther away than this."""
MARKED_MM = 600.0
"""A blocker farther away than this is left to the echoes, which place it better."""
WATCHED_MM = 650.0
"""Where there is no path, a moving blocker that is no farther away than this is still the cause."""


class _LastBlocker(NamedTuple):
    """The blocker of the last failure that had one: where, since when and until when it was known, and if it moves."""

    place: Point
    since_s: float
    last_s: float
    moving: bool


class WorldModel:
    """Everything known in one mission.

    Args:
        mission: Its targets, robot, camera and cruising speed.

    Attributes:
        floor: The map of the floor.
        camera: How the camera is mounted.
        track_mm: Distance between the wheels.
        has_compass: Whether a compass corrects the heading.
        knows_turns: Whether turns need not be measured: the wheels are calibrated, or a compass corrects the heading.
        poses: Recent poses.
        echoes: Recent echoes.
        attempts: What was tried where, and what failed.
        targets: Where targets were seen and may be.
        pose: Where the robot is.
        blocker: The obstacle at the last failure, if any.
        paths: All paths from where the robot was at the last failure.
        travel_mm_s: How fast the robot drives along paths now.
    """

    def __init__(self, mission: Mission) -> None:
        self.floor, self.camera = OccupancyGrid(mission.robot), mission.camera
        self.track_mm = mission.robot.turning_track_mm
        self.has_compass = mission.robot.compass != 0
        self.knows_turns = self.has_compass or mission.calibration.wheels is not None
        calibrated = mission.calibration.camera is not None
        beam_deg = mission.robot.sonar_cone_deg / 2
        self._ranges = FloorRanges(mission.camera, mission.sonar_ahead_mm, beam_deg, calibrated=calibrated)
        self.poses = PoseHistory()
        self.echoes = RecentEchoes(mission.robot.sonar_forward_mm)
        self.attempts = Attempts()
        self.targets = TargetMemory(mission, self.floor, self.poses)
        self.pose = Pose()
        self._now_s = 0.0
        self.blocker: Blocker | None = None
        self.travel_mm_s = mission.adaptive.travel_mm_s
        self.paths = self.paths_from_here()
        self._last: _LastBlocker | None = None

    @property
    def here(self) -> Point:
        """Where the robot is."""
        return self.pose.point

    def perceive(
        self,
        now_s: float,
        pose: Pose,
        range_mm: float | None,
        looked_for: Sequence[str],
        glimpse: Glimpse,
        *,
        sonar_works: bool = True,
    ) -> Mapping[str, Sighting]:
        """Update with a frame and an echo.

        Args:
            now_s: Current time on the mission's clock.
            pose: Where the robot is.
            range_mm: The sonar's echo, or None.
            looked_for: Targets that were looked for in the frame.
            glimpse: What the frame showed.
            sonar_works: Whether the sonar works, so that a missing echo means that nothing is near.

        Returns:
            The sightings that are not of a known look-alike.
        """
        self.pose = pose
        self._now_s = now_s
        self.poses.add(now_s, pose)
        self.echoes.add(now_s, pose, range_mm)
        self.targets.decay(now_s)
        self.floor.decay(now_s)
        self.floor.clear_footprint(pose)
        self.floor.without_sonar = not sonar_works
        self._add_echo(pose, range_mm)
        return self.targets.look(looked_for, glimpse, range_mm)

    def see_floor(self, time_s: float, rays: Sequence[FloorRay], range_mm: float | None) -> None:
        """Update with the free floor in a frame.

        Args:
            time_s: When the frame was taken.
            rays: The floor.
            range_mm: The sonar's echo at the current pose, or None.
        """
        if not rays:
            return
        pose = self.poses.at(time_s)
        echo = None
        if range_mm is not None:
            echo = (self.pose, range_mm)
            ahead_mm = self.floor.sonar_forward_mm
            off_deg, away_mm = pose.polar_to(self.pose.ahead(ahead_mm + range_mm))
            self._ranges.compare(rays, pose, away_mm - ahead_mm, off_deg)
        self.floor.add_view(self.camera.lens_at(pose), self._ranges.measure(rays, self.poses.turn_deg_s(time_s)), echo)

    def _add_echo(self, pose: Pose, range_mm: float | None) -> None:
        if range_mm is not None:
            self.floor.add_echo(pose, range_mm)
        elif not self.floor.without_sonar:
            self.floor.add_no_echo(pose)

    def learn(self, target: str, failure: Failure, now_s: float, round_number: int = 1) -> None:
        """Update with a failure, before recoveries are weighed.

        Args:
            target: What was pursued.
            failure: What went wrong.
            now_s: Current time on the mission's clock.
            round_number: The round of the target, from 1.
        """
        self._now_s = now_s
        self.attempts.failed(target, round_number, failure.reason, self.here)
        known = self.targets.known.get(target)
        may_leave = failure.blocker is not None and failure.blocker.hides
        if failure.event is Event.ARRIVE_FAILED and not may_leave and known is not None:
            self.attempts.approach_failed(target, self.here, known.place, now_s)
        if failure.reason is Reason.RANGE_MISMATCH:
            self.targets.mismatched.add(target)
        self.targets.learn(target, failure.finding, self.here)
        self.targets.flush_looks()
        self.blocker = self._place_blocker(failure, now_s)
        self.plan()

    def plan(self) -> None:
        """Plan paths from here; a map on which the robot is walled in is wrong, and its obstacles are forgotten."""
        self.paths = self.paths_from_here()
        if self.paths.walled_in:
            self.floor.forget_obstacles()
            self.paths = self.paths_from_here()

    def paths_from_here(self) -> PathPlanner:
        """Return all paths from here, by what is known now."""
        return PathPlanner(self.floor, self.here, self.travel_mm_s)

    def _place_blocker(self, failure: Failure, now_s: float) -> Blocker | None:
        """Put a blocker onto the map unless it comes from there; return it with the time it has been known."""
        blocker = failure.blocker
        if blocker is None:
            return self._blocker_of_no_path(now_s) if failure.reason is Reason.NO_WAY else None
        if blocker.range_mm <= MARKED_MM and not failure.mapped:
            self.floor.mark_obstacle(self.pose, blocker.range_mm)
        place = self.pose.ahead(self.floor.sonar_forward_mm + blocker.range_mm)
        since_s, moving, last = now_s, blocker.moving, self._recent_blocker(now_s)
        if last is not None and math.dist(last.place, place) < SAME_BLOCKER_MM:
            since_s, moving = last.since_s, moving or last.moving
        self._last = _LastBlocker(place, since_s, now_s, moving)
        return replace(blocker, age_s=now_s - since_s, moving=moving)

    def _recent_blocker(self, now_s: float) -> _LastBlocker | None:
        last = self._last
        return last if last is not None and now_s - last.last_s < SAME_BLOCKER_S else None

    def _blocker_of_no_path(self, now_s: float) -> Blocker | None:
        """Return the last blocker, if it moves and the robot is still near it: it may be why there is no path."""
        last = self._recent_blocker(now_s)
        if last is None or not last.moving:
            return None
        bearing_deg, away_mm = self.pose.polar_to(last.place)
        range_mm = away_mm - self.floor.sonar_forward_mm
        if range_mm > WATCHED_MM:
            return None
        return Blocker(range_mm, now_s - last.since_s, moving=True, hides=True, bearing_deg=bearing_deg)

    def turned(self, scale: float, beams: Sequence[Beam]) -> None:
        """Redraw the echoes of a turn on the spot: the robot turned `scale` times as far as its wheels said.

        Targets seen in it are moved, too; the floor that the camera saw in it is forgotten.
        """
        self.targets.turned(scale, beams[0][0], beams[-1][0])
        self.floor.restore()
        self.poses.clear()
        for pose, range_mm in beams:
            self._add_echo(corrected(pose, beams[0][0], scale), range_mm)

    def sight_to(self, point: Point) -> tuple[float, float]:
        """Return a point's bearing from the robot, degrees, and its distance from the lens, as sightings have it."""
        return self.pose.polar_to(point)[0], self.camera.lens_at(self.pose).polar_to(point)[1]

    def camera_turn_deg(self, point: Point) -> float:
        """Return the turn after which the camera, which may be mounted turned, points at a point."""
        return wrapped_deg(self.pose.polar_to(point)[0] - self.camera.yaw_deg)

    def new_approach(self, target: str, start: Point) -> bool:
        """Return whether no approach to a target failed lately on the straight path from `start`."""
        known = self.targets.known.get(target)
        return known is None or self.attempts.new_approach(target, start, known.place, self._now_s)
