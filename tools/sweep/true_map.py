"""Draw the true map of one run: the room, its objects, the robot's path, and its stops."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from behaviors.journal import Kind

from .floor_plan import Goal, Obstacle, Point
from .metrics import stop_counts
from .referee import EpisodeTrace, Mark
from .room_builder import ROBOT_RADIUS_MM

Image = NDArray[np.uint8]
Color = tuple[int, int, int]

SCALE = 0.2
"""Pixels per millimetre."""
MARGIN_PX, FOOT_PX = 30, 60
"""Margin around the room, and space for the caption below it."""
LOW_MM = 200.0
"""Objects lower than this hide no picture; they are drawn in outline."""
LATE_PX = 2
"""Line width of a late object's outline."""

INK: Color = (60, 50, 45)
PAPER: Color = (250, 250, 248)
SOLID: Color = (170, 180, 190)
LATE: Color = (90, 150, 230)
TARGET_COLORS: tuple[Color, ...] = ((200, 130, 30), (150, 60, 160))
GOOD, BAD = (60, 150, 40), (40, 40, 210)
FONT = cv2.FONT_HERSHEY_SIMPLEX


def draw_true_map(trace: EpisodeTrace, title: str) -> Image:
    """Draw the map of one mission.

    Returns:
        Shape (height, width, 3), dtype uint8, BGR.
    """
    width_mm, depth_mm = trace.moments[0].scene.plan.size_mm
    width_px, depth_px = (round(side * SCALE) + 2 * MARGIN_PX for side in (width_mm, depth_mm))
    image: Image = np.full((depth_px + FOOT_PX, max(width_px, 420), 3), PAPER, np.uint8)
    cv2.rectangle(image, _at((0, 0)), _at((width_mm, depth_mm)), INK, 2)
    _draw_objects(image, trace)
    _draw_path(image, trace)
    for mark in trace.marks:
        _draw_mark(image, mark)
    x_mm, y_mm, heading_deg = trace.moments[0].pose
    ahead = math.radians(heading_deg)
    nose = (x_mm + 250 * math.cos(ahead), y_mm + 250 * math.sin(ahead))
    cv2.circle(image, _at((x_mm, y_mm)), round(ROBOT_RADIUS_MM * SCALE), INK, 1, cv2.LINE_AA)
    cv2.arrowedLine(image, _at((x_mm, y_mm)), _at(nose), INK, 2, cv2.LINE_AA, tipLength=0.3)
    caption = f"{trace.ending.replace('_', ' ')} after {trace.duration_s:.0f} s, contacts: {trace.moments[-1].contacts}"
    for row, text in enumerate((title, caption)):
        cv2.putText(image, text, (MARGIN_PX, depth_px + 12 + 24 * row), FONT, 0.5, INK, 1, cv2.LINE_AA)
    return image


def _draw_objects(image: Image, trace: EpisodeTrace) -> None:
    """Draw the obstacles, and every place where a late object stood still."""
    first = trace.moments[0].scene
    for obstacle in first.plan.obstacles:
        _draw_obstacle(image, obstacle, SOLID, 1 if obstacle.height_mm < LOW_MM else -1)
    drawn = {id(first)}
    for one, other in zip(trace.moments, trace.moments[10:], strict=False):
        if one.scene is other.scene and id(one.scene) not in drawn:
            drawn.add(id(one.scene))
            for obstacle in one.scene.plan.obstacles:
                if obstacle.name in trace.late_objects:
                    _draw_obstacle(image, obstacle, LATE, LATE_PX)
    for goals in (first.goals, trace.moments[-1].scene.goals):
        for goal in goals.values():
            _draw_picture(image, goal, wanted=goal.name in trace.targets)


def _draw_obstacle(image: Image, obstacle: Obstacle, color: Color, thickness: int) -> None:
    if obstacle.size_mm == (0.0, 0.0):
        cv2.circle(image, _at(obstacle.at_mm), round(obstacle.radius_mm * SCALE), color, thickness, cv2.LINE_AA)
        return
    length, width = (max(10.0, side + 2 * obstacle.radius_mm) * SCALE for side in obstacle.size_mm)
    corners = cv2.boxPoints((_at(obstacle.at_mm), (length, width), obstacle.facing_deg)).round().astype(np.int32)
    if thickness < 0:
        cv2.fillPoly(image, [corners], color, cv2.LINE_AA)
    cv2.polylines(image, [corners], True, INK if thickness < 0 else color, max(1, thickness), cv2.LINE_AA)


def _draw_picture(image: Image, goal: Goal, *, wanted: bool) -> None:
    color = GOOD if wanted else SOLID
    (x, y), angle = goal.at_mm, math.radians(goal.facing_deg)
    across = (-math.sin(angle) * 80, math.cos(angle) * 80)
    cv2.line(image, _at((x - across[0], y - across[1])), _at((x + across[0], y + across[1])), color, 4, cv2.LINE_AA)
    nose = (x + 120 * math.cos(angle), y + 120 * math.sin(angle))
    cv2.arrowedLine(image, _at(goal.at_mm), _at(nose), color, 1, cv2.LINE_AA)
    if wanted:
        column, row = _at(nose)
        cv2.putText(image, goal.name, (column - 20, row + 14), FONT, 0.4, color, 1, cv2.LINE_AA)


def _draw_path(image: Image, trace: EpisodeTrace) -> None:
    """Draw the path in one colour per target, with a red ring at each contact."""
    marks = iter(trace.marks)
    mark, target = next(marks, None), ""
    for one, other in zip(trace.moments, trace.moments[1:], strict=False):
        while mark is not None and mark.moment.time_s <= one.time_s:
            target, mark = mark.record.target, next(marks, None)
        color = TARGET_COLORS[trace.targets.index(target) % len(TARGET_COLORS)] if target in trace.targets else INK
        cv2.line(image, _at(one.pose[:2]), _at(other.pose[:2]), color, 2, cv2.LINE_AA)
        if other.contacts > one.contacts:
            cv2.circle(image, _at(other.pose[:2]), 7, BAD, 1, cv2.LINE_AA)


def _draw_mark(image: Image, mark: Mark) -> None:
    """Draw a star or a cross where the robot reported an arrival, and the name of a choice where it was made."""
    record, moment = mark.record, mark.moment
    place = _at(moment.pose[:2])
    if record.kind is Kind.TRANSITION and record.data["to"] == "reached":
        good = stop_counts(moment.pose, moment.scene, record.target)
        shape = cv2.MARKER_STAR if good else cv2.MARKER_TILTED_CROSS
        cv2.drawMarker(image, place, GOOD if good else BAD, shape, 16, 2, cv2.LINE_AA)
    elif record.kind is Kind.CHOICE:
        text = str(record.data["choice"]).replace("_", " ")
        cv2.putText(image, text, (place[0] + 6, place[1] - 6), FONT, 0.35, INK, 1, cv2.LINE_AA)
        cv2.drawMarker(image, place, INK, cv2.MARKER_DIAMOND, 8, 1, cv2.LINE_AA)


def _at(point: Point) -> tuple[int, int]:
    """Return the pixel of a point on the floor."""
    return round(point[0] * SCALE) + MARGIN_PX, round(point[1] * SCALE) + MARGIN_PX
