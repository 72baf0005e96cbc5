"""The map: an occupancy grid from sonar and bumper, in the frame of odometry; what it shows fades with time.

A sonar's beam is wide. An echo says that the whole beam is free up to it, and that something is *somewhere* on its arc.
So an echo clears the cone and marks only the middle of the arc. From far away it may be to one side and counts as a
hint, which a path may cross at a cost, until nearer beams confirm or clear it. If a known obstacle lies on
the arc, that explains the echo, and the rest of the arc is left as it is: it may be a doorway.

The grid grows when there is something to put beyond its edge.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from numpy.typing import NDArray

from behaviors.adaptive import grid_tuning as tuning
from behaviors.adaptive.grid_cells import CELL_MM, Cells, Cone, Mask
from behaviors.adaptive.visible_floor import VisibleFloor
from behaviors.mission.robot import RobotTable
from behaviors.ports import Point, Pose

USUAL_ROBOT = RobotTable()

DIRECTIONS = 72
"""Lines of sight are followed in this many directions, 5 degrees apart."""

Grid = NDArray[np.float32]

_LAYERS = {
    "log_odds": np.float32(0.0),
    "_echo_heading_deg": np.float32(np.nan),
    **dict.fromkeys(("_swept", "_was_free", "_appeared", "_unseen", "_grazed", "seen"), np.False_),
}
"""What is known of the cells, and its value where nothing is."""


class OccupancyGrid:
    """A grid of the log odds of obstacles, indexed [x, y]; the start lies in the middle.

    Args:
        robot: How the robot is built.

    Attributes:
        cells: Where its cells are.
        radius_mm: Radius of the robot.
        sonar_forward_mm: How far the sonar is in front of the axle.
        sonar_height_mm: How far the sonar is above the floor.
        log_odds: Log odds of an obstacle in each cell, as in `grid_tuning`.
        forgotten: How often its obstacles were forgotten.
        without_sonar: Whether it has to do without a sonar now.
        seen: Where the camera saw something stand, in a direction that is known to a cell.
        weight: Floor that an echo shows to be free counts as this many echoes: on a slow link there are fewer, and
            from places farther apart. The source of the echo does not, since it may stand anywhere on its arc.
    """

    log_odds: Grid
    seen: Mask
    _echo_heading_deg: Grid
    _swept: Mask
    _was_free: Mask
    _appeared: Mask
    _unseen: Mask
    _grazed: Mask

    def __init__(self, robot: RobotTable = USUAL_ROBOT) -> None:
        self.cells = Cells()
        self.radius_mm, self.sonar_forward_mm = robot.radius_mm, robot.sonar_forward_mm
        self.sonar_height_mm = robot.sonar_height_mm
        self._beam_deg = robot.sonar_cone_deg / 2
        self.forgotten = 0
        self.without_sonar = False
        self.weight = 1.0
        self._time_s = -math.inf
        self._last: tuple[Pose, float] | None = None
        self._seen_from: Pose | None = None
        self._rays = self._floor_like = 0.0
        self._floor_like_from = np.full((DIRECTIONS, 2), np.nan)
        for name, empty in _LAYERS.items():
            setattr(self, name, np.full((self.cells.side, self.cells.side), empty))
        self.save()

    def save(self) -> None:
        """Save the current state, for `restore`."""
        self._saved = {name: getattr(self, name).copy() for name in _LAYERS}

    def restore(self) -> None:
        """Restore the saved state."""
        for name, saved in self._saved.items():
            getattr(self, name)[:] = saved
        self._last = self._seen_from = None
        self._floor_like_from[:] = np.nan

    def include(self, *places: Point, margin_mm: float = 0.0) -> bool:
        """Let the grid grow until it holds these places, mm, and a margin around them, as far as it may.

        Returns:
            Whether it has grown.
        """
        before = self.cells
        farthest_mm = max((abs(each) for place in places for each in place), default=0.0) + margin_mm
        while farthest_mm >= self.cells.reach_mm and self.cells.side < tuning.MAX_SIDE:
            self.cells = Cells(self.cells.side + 2 * tuning.GROWS_CELLS)
            for name, empty in _LAYERS.items():
                setattr(self, name, np.pad(getattr(self, name), tuning.GROWS_CELLS, constant_values=empty))
                self._saved[name] = np.pad(self._saved[name], tuning.GROWS_CELLS, constant_values=empty)
        return self.cells is not before

    def decay(self, now_s: float) -> None:
        """Let old evidence decay."""
        if now_s - self._time_s > tuning.DECAY_EVERY_S:
            if self._time_s > -math.inf:
                # where the camera alone saw free floor it may have overlooked something
                self._was_free |= self._swept & (self.log_odds < tuning.MIN_NO_ECHO_LOG_ODDS)
                for marks in (self._appeared, self._unseen, self._grazed, self.seen):
                    marks &= self.log_odds > 0.0
                decay_s = np.where(self._appeared, tuning.APPEARED_DECAY_S, tuning.DECAY_S)
                self.log_odds *= np.exp((self._time_s - now_s) / decay_s)
            self._time_s = now_s

    def add_echo(self, pose: Pose, range_mm: float) -> None:
        """Update with an echo; one that repeats the last from the same place does not mark its arc again."""
        repeated = self._last is not None and _same(self._last, (pose, range_mm))
        self._last = (pose, range_mm)
        reach_mm = min(range_mm, tuning.FAR_MM)
        cone = self._cone(pose, reach_mm, CELL_MM * 2)
        cells = self.log_odds[cone.window]
        free = self._passed(cone, reach_mm - tuning.MARGIN_MM)
        cells[free] = np.maximum(cells[free] - self.weight * tuning.FREE_ECHO, tuning.MIN_LOG_ODDS)
        self._swept[cone.window] |= free
        if range_mm >= tuning.FAR_MM or repeated:
            return
        hit = cone.arc(range_mm, CELL_MM * tuning.ARC_CELLS) & (np.abs(cone.off_deg) <= tuning.ARC_DEG)
        gain, most = tuning.HIT_NEAR, tuning.MAX_LOG_ODDS
        if range_mm > tuning.NEAR_MM:
            gain, most = tuning.HIT_FAR, tuning.MAX_HINT_LOG_ODDS
            for likelier in (
                hit & (cells > -tuning.PASSED_LOG_ODDS),
                cone.arc(range_mm, CELL_MM) & (cells > tuning.EXPLAINING_LOG_ODDS),
            ):
                hit = likelier if likelier.any() else hit
        cells[hit] = np.maximum(cells[hit], np.minimum(cells[hit] + gain, most))
        self._echo_heading_deg[cone.window][hit] = pose.heading_deg

    def add_no_echo(self, pose: Pose) -> None:
        """Update with a missing echo: most likely nothing is near, but smooth surfaces deflect the sound."""
        if self._last is not None and _same(self._last, (pose, math.inf)):
            return
        self._last = (pose, math.inf)
        cone = self._cone(pose, tuning.NO_ECHO_MM)
        cells = self.log_odds[cone.window]
        free = self._passed(cone, tuning.NO_ECHO_MM)
        cells[free] = np.maximum(
            cells[free] - self.weight * tuning.FREE_NO_ECHO, np.minimum(cells[free], tuning.MIN_NO_ECHO_LOG_ODDS)
        )

    def add_view(self, lens: Pose, view: VisibleFloor, echo: tuple[Pose, float] | None = None) -> None:
        """Update with the free floor that a camera sees; another view from the same place says nothing new.

        Floor that an echo of the same moment shows to be free is not an obstacle, whatever it looks like there; and
        where the floor seems to continue beyond an echo, the source of the echo stays on the map however often it is
        overlooked.

        Args:
            lens: Pose of the lens, with the robot's heading.
            view: The floor.
            echo: The robot's pose at an echo, and its distance from the sonar.
        """
        if self._seen_from is not None and _same_place(self._seen_from, lens):
            return
        self._seen_from = lens
        free_mm, end_mm = view.free_mm - tuning.SEEN_MARGIN_MM, view.end_mm
        if echo is not None:
            free_mm, end_mm = self._reconciled(lens, view, free_mm, echo)
        along_mm = np.arange(0.0, float(free_mm.max(initial=0.0)), CELL_MM / 2)[None, :]
        ends_mm, known = end_mm[:, None] + CELL_MM / 4, np.isfinite(end_mm)
        far_mm = np.where(known, ends_mm[:, 0], free_mm)
        self.include(*map(lens.ahead, far_mm.tolist(), view.bearing_deg.tolist()))
        window, *_ = self.cells.around(*lens.point, max(float(each.max(initial=0.0)) for each in (far_mm, free_mm)))
        near = along_mm >= view.near_mm[:, None]
        free = self._mask(lens, view, along_mm, near & (along_mm <= free_mm[:, None]))[window]
        ends = self._mask(lens, view, ends_mm, known[:, None])[window]
        exact = self._mask(lens, view, ends_mm, (known & view.exact)[:, None])[window]
        cells = self.log_odds[window]
        free &= ~ends & ~(self._unseen[window] & (cells > 0.0))
        cells[free] = np.maximum(cells[free] - tuning.FREE_SEEN, tuning.MIN_LOG_ODDS)
        most = np.where(exact, tuning.MAX_LOG_ODDS, tuning.MAX_HINT_LOG_ODDS)[ends]
        cells[ends] = np.maximum(cells[ends], np.minimum(cells[ends] + tuning.HIT_SEEN, most))
        self.seen[window] |= exact
        self._add_floor_like(lens, view)

    def _add_floor_like(self, lens: Pose, view: VisibleFloor) -> None:
        """Suspect an obstacle on each ray on which something that looks like the floor stands at an unknown distance.

        It is suspected in each cell as far as what is known of the others leaves it there, so rays from several places
        meet at it; another ray in the same direction from the same place says nothing new. Where most rays are like
        that, the walls may look like the floor, and little is learned.
        """
        count = len(view.floor_like_deg)
        self._rays = tuning.FLOOR_LIKE_KEPT * self._rays + len(view.bearing_deg) + count
        self._floor_like = tuning.FLOOR_LIKE_KEPT * self._floor_like + count
        if not count:
            return
        along_mm = np.arange(0.0, tuning.FLOOR_LIKE_MM, CELL_MM)
        sector = ((lens.heading_deg + view.floor_like_deg) % 360.0 * DIRECTIONS / 360.0).astype(np.int64) % DIRECTIONS
        moved_mm = np.hypot(*(self._floor_like_from[sector] - lens.point).T)  # NaN where there was no such ray yet
        useful = (view.floor_like_near_mm < along_mm[-1]) & ~(moved_mm < tuning.FLOOR_LIKE_MOVED_MM)
        self._floor_like_from[sector[useful]] = lens.point
        bearing_deg, near_mm = view.floor_like_deg[useful], view.floor_like_near_mm[useful]
        self.include(*(lens.ahead(tuning.FLOOR_LIKE_MM, each) for each in bearing_deg.tolist()))
        i, j = self._cells_along(lens, bearing_deg, along_mm)
        odds = np.exp(tuning.FLOOR_LIKE_SHARPNESS * self.log_odds[i, j] - tuning.RARE_LOG_ODDS)
        chance = np.where(along_mm >= near_mm[:, None], odds / (1.0 + odds), 0.0)
        first = chance * np.cumprod(1.0 - chance, axis=1) / (1.0 - chance)
        share = first / first.sum(axis=1, keepdims=True)
        gain = tuning.HIT_FLOOR_LIKE * (1.0 - self._floor_like / self._rays) * share
        limit = np.maximum(self.log_odds[i, j], tuning.MAX_HINT_LOG_ODDS)
        raised = np.minimum(self.log_odds[i, j] + gain.astype(np.float32), limit)
        np.maximum.at(self.log_odds, (i, j), raised)  # a frame counts once in a cell that several rays cross

    def _reconciled(
        self, lens: Pose, view: VisibleFloor, free_mm: NDArray[np.float64], echo: tuple[Pose, float]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return up to where a view shows free floor, and where it shows something, as far as an echo allows it."""
        pose, range_mm = echo
        off_deg, echo_mm = lens.polar_to(pose.ahead(self.sonar_forward_mm + range_mm))
        ahead = np.abs(view.bearing_deg - off_deg) <= tuning.ARC_DEG
        end_mm = np.where(ahead & (view.end_mm < (1.0 - tuning.SAME_SHARE) * echo_mm), np.inf, view.end_mm)
        overlooked = ahead & (free_mm > echo_mm)
        seen = ahead & (end_mm < (1.0 + tuning.SAME_SHARE) * echo_mm)
        if range_mm <= tuning.FAR_MM and overlooked.any() and not seen.any():
            free_mm = np.where(ahead, np.minimum(free_mm, echo_mm - tuning.MARGIN_MM), free_mm)
            sonar = pose.ahead(self.sonar_forward_mm)
            cone = self.cells.cone(*sonar, pose.heading_deg, range_mm + 2 * CELL_MM, tuning.ARC_DEG)
            self._unseen[cone.window] |= cone.arc(range_mm, CELL_MM * tuning.ARC_CELLS)
        return free_mm, end_mm

    def _cone(self, pose: Pose, reach_mm: float, beyond_mm: float = 0.0) -> Cone:
        """Return the cells that the sonar's beam meets up to a distance from it, and some way beyond."""
        far_mm = self.sonar_forward_mm + reach_mm
        self.include(*(pose.ahead(far_mm, side_deg) for side_deg in (-self._beam_deg, 0.0, self._beam_deg)))
        sonar = pose.ahead(self.sonar_forward_mm)
        return self.cells.cone(*sonar, pose.heading_deg, reach_mm + beyond_mm, self._beam_deg)

    def _mask(self, lens: Pose, view: VisibleFloor, along_mm: NDArray[np.float64], wanted: Mask) -> Mask:
        """Return the cells along a view's rays, at distances (rays, n) or (1, n), where they are wanted, (rays, n)."""
        i, j = self._cells_along(lens, view.bearing_deg, np.where(wanted, along_mm, 0.0))
        mask = np.zeros_like(self.seen)
        mask[i[wanted], j[wanted]] = True
        return mask

    def _cells_along(
        self, lens: Pose, bearing_deg: NDArray[np.float64], along_mm: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the indices of the cells along rays, (rays, n), at distances (rays, n) or (n,)."""
        angle = np.radians(lens.heading_deg + bearing_deg)[:, None]
        x_mm, y_mm = lens.x_mm + along_mm * np.cos(angle), lens.y_mm + along_mm * np.sin(angle)
        return self.cells.index(x_mm), self.cells.index(y_mm)

    def _passed(self, cone: Cone, far_mm: float) -> Mask:
        """Return which cells a beam has passed up to a distance, without what deflects it and what lies behind that."""
        before = cone.inside & (cone.along_mm < far_mm)
        # a surface deflects a beam at a grazing angle
        along = np.abs(np.cos(np.radians(self._echo_heading_deg[cone.window] - cone.heading_deg)))
        glanced = before & (along < math.cos(math.radians(tuning.GLANCING_DEG))) & (self.log_odds[cone.window] > 0.0)
        passed = before & ~glanced
        deflecting = glanced & (self.log_odds[cone.window] > tuning.HINT)
        if deflecting.any():
            half_deg = np.degrees(np.arctan2(CELL_MM / 2, np.maximum(cone.along_mm[deflecting], 1.0)))
            farther = cone.along_mm[passed][:, None] > cone.along_mm[deflecting]
            in_line = np.abs(cone.off_deg[passed][:, None] - cone.off_deg[deflecting]) <= half_deg
            passed[passed] = ~(farther & in_line).any(axis=1)
        return np.asarray(passed)

    def clear_line_of_sight(self, start: Point, end: Point) -> None:
        """Update with a line of sight from `start` to `end`: it clears merely suspected cells in between."""
        length = math.dist(start, end)
        share = np.arange(0.0, max(0.0, length - tuning.SPARED_MM), CELL_MM / 2) / max(length, 1.0)
        i = self.cells.index(start[0] + share * (end[0] - start[0]))
        j = self.cells.index(start[1] + share * (end[1] - start[1]))
        cells = self.log_odds[i, j]
        self.log_odds[i, j] = np.where((cells > 0.0) & (cells < tuning.SOLID), 0.0, cells)

    def forget_obstacles(self) -> None:
        """Clear all obstacles."""
        self.forgotten += 1
        self._floor_like_from[:] = np.nan
        np.minimum(self.log_odds, 0.0, out=self.log_odds)

    def clear_footprint(self, pose: Pose) -> None:
        """Clear the robot's footprint."""
        self.include(pose.point, margin_mm=self.radius_mm)
        window, inside = self.cells.disc(*pose.point, self.radius_mm)
        self.log_odds[window][inside] = tuning.MIN_LOG_ODDS
        self._swept[window] |= inside

    def mark_obstacle(self, pose: Pose, range_mm: float) -> None:
        """Mark what stopped or touched the robot: the object that the camera saw there, or one of unknown size."""
        saw = self._saw_at(pose, range_mm)
        if saw is not None:
            window, inside = self.cells.disc(*saw, tuning.GRAZED_MM)
            known = self._grazed[window][inside].any() or (self.log_odds[window][inside] > tuning.SOLID).all()
            self._grazed[window] |= inside
        # if the mark was that large before, or was touched before, the robot has met something else or something larger
        if saw is None or known:
            place = pose.ahead(self.sonar_forward_mm + range_mm + tuning.BLOCK_RADIUS_MM * tuning.BLOCK_BEYOND)
            self.include(place, margin_mm=tuning.BLOCK_RADIUS_MM)
            window, inside = self.cells.disc(*place, tuning.BLOCK_RADIUS_MM)
            self._unseen[window] |= inside
        cells = self.log_odds[window]
        cells[inside] = np.maximum(cells[inside], tuning.BLOCK_LOG_ODDS)
        self._appeared[window] |= inside & self._was_free[window]

    def _saw_at(self, pose: Pose, range_mm: float) -> Point | None:
        """Return what the camera saw nearest to where something stopped the robot; None if it saw nothing there."""
        x_mm, y_mm = pose.ahead(self.sonar_forward_mm + range_mm)
        window, near = self.cells.disc(x_mm, y_mm, self.radius_mm + tuning.GRAZED_MM)
        near &= self.seen[window] & (self.log_odds[window] > tuning.SOLID)
        if not near.any():
            return None
        i, j = np.nonzero(near)
        x, y = self.cells.centre_mm(i + window[0].start), self.cells.centre_mm(j + window[1].start)
        best = int(np.argmin(np.hypot(x - x_mm, y - y_mm)))
        return float(x[best]), float(y[best])

    def appeared(self, pose: Pose, range_mm: float) -> bool:
        """Return whether the source of an echo stands where the map once was free: all along its arc, and behind it."""
        depths_mm = (self.sonar_forward_mm + range_mm + each * CELL_MM for each in tuning.APPEARED_CELLS)
        sides_deg = (-tuning.ARC_DEG, 0.0, tuning.ARC_DEG)
        return all(self._was_free[self.cells.at(*pose.ahead(*each))] for each in product(depths_mm, sides_deg))

    def visibility(
        self, x_mm: float, y_mm: float, limit_mm: float, unknown_hides_mm: float = tuning.UNKNOWN_HIDES_MM
    ) -> NDArray[np.float64]:
        """Return the chance of a free line of sight, (DIRECTIONS, steps of CELL_MM), from a place up to `limit_mm`.

        Free floor hides nothing; the more unknown floor there is, the more likely something stands on it:
        `unknown_hides_mm` of it is empty with probability 1/e.
        """
        steps = np.arange(CELL_MM, limit_mm + CELL_MM, CELL_MM)
        i = self.cells.index(x_mm + steps[None, :] * _ALONG[:, 0:1])
        j = self.cells.index(y_mm + steps[None, :] * _ALONG[:, 1:2])
        log_odds = self.log_odds[i, j]
        log_odds[:, :2] = -1.0  # the robot itself stands there
        behind = np.logical_or.accumulate(log_odds > tuning.HINT, axis=1)
        unknown_mm = np.cumsum(np.abs(log_odds) < tuning.KNOWN, axis=1) * CELL_MM
        return np.asarray(np.where(behind, tuning.BEHIND_CHANCE, np.exp(-unknown_mm / unknown_hides_mm)), np.float64)

    def clear_between(self, start: Point, end: Point, standoff_mm: float = 0.0, clearance_mm: float = 0.0) -> bool:
        """Return whether the robot could drive straight, as far as the map shows.

        Args:
            start: Where it would set off.
            end: Where it would go.
            standoff_mm: The last stretch, which need not be free.
            clearance_mm: Room that must be free beside the robot.
        """
        return self.blocked_after_mm(start, end, standoff_mm, clearance_mm) is None

    def blocked_after_mm(
        self, start: Point, end: Point, standoff_mm: float = 0.0, clearance_mm: float = 0.0
    ) -> float | None:
        """Return the distance from `start` to the first obstacle on the path of `clear_between`; None without one."""
        length = math.dist(start, end) - standoff_mm
        if length <= 0:
            return None
        ux, uy = (end[0] - start[0]) / (length + standoff_mm), (end[1] - start[1]) / (length + standoff_mm)
        along = np.arange(self.radius_mm, max(length, self.radius_mm + 1), CELL_MM * 0.75)
        half_mm = self.radius_mm - CELL_MM / 4 + clearance_mm
        across = np.linspace(-half_mm, half_mm, 7)
        i = self.cells.index(start[0] + along[:, None] * ux - across[None, :] * uy)
        j = self.cells.index(start[1] + along[:, None] * uy + across[None, :] * ux)
        blocked = (self.log_odds[i, j] > tuning.SOLID).any(axis=1)
        return float(along[blocked.argmax()]) if blocked.any() else None


_ANGLES = np.radians(np.arange(DIRECTIONS) * 360.0 / DIRECTIONS)
_ALONG = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)


def _same(one: tuple[Pose, float], other: tuple[Pose, float]) -> bool:
    """Return whether two echoes, infinity standing for none, are one measurement to the map."""
    (a, range_a), (b, range_b) = one, other
    return _same_place(a, b) and (range_a == range_b or abs(range_a - range_b) < tuning.REPEATED_RANGE_MM)


def _same_place(a: Pose, b: Pose) -> bool:
    """Return whether measurements at two poses are one measurement to the map."""
    return a.is_near(b, tuning.REPEATED_MM, tuning.REPEATED_DEG)
