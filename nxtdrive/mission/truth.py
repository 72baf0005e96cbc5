"""The simulation's ground truth, for messages and the record of a run; nothing that drives the robot reads it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, cast

import cv2
import numpy as np

from nxtdrive.mission.detectors import codes_in
from nxtdrive.transports.sim import simulated
from nxtdrive.vision.detectors.color import ColorDetector

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.vision.detection import Detector, Image

FRAME = (240, 320)
HEIGHTS_PX = (120, 70)
"""Apparent heights at which a front is shown to a detector; every detector finds its target at one of these."""
GRAY = 128
MIN_COLOR_SHARE = 0.25
"""A colour that covers less of a front is of a detail: a red sleeve on a portrait is not a red box."""

FAR_MM = 1500.0
"""A picture that is seen whole only from farther away is seldom found; robots look from nearer in most rooms."""


class Truth(Protocol):
    """The ground truth of the room. Only ``sim://`` offers it, and reading it changes nothing."""

    @property
    def pose(self) -> tuple[float, float, float]:
        """Return the robot's true position and heading on the map: x_mm, y_mm (down), degrees clockwise from x."""
        ...

    def build(self) -> Mapping[str, Sequence[str | float]]:
        """Return how the robot is built, by the keys of a mission's [robot]: the values that describe it, if any."""
        ...

    def outlines(self) -> Sequence[tuple[float, float, float, float]]:
        """Return the sides of walls and objects on the floor: x0_mm, y0_mm, x1_mm, y1_mm of each, on the map."""
        ...

    def front_images(self) -> Mapping[str, Image]:
        """Return an image of each object's front, present or absent, by name; BGR pixels."""
        ...

    def lens_distance_mm(self, name: str) -> float:
        """Return how far an object is from the camera's lens."""
        ...

    def whole_from_mm(self, name: str) -> float:
        """Return how far away the lens must be for the frame to show a picture's whole height; 0 for other objects."""
        ...

    def in_front_of_camera(self, name: str) -> bool:
        """Return whether the camera points at an object and nothing hides it."""
        ...


def truth_of(brick: Brick) -> Truth | None:
    """Return the truth about a simulated brick's world; None for any other brick."""
    transport = simulated(brick.link.transport)
    return cast("Truth", transport.truth) if transport else None


class SimulatedRoom:
    """The ground truth of the room, in the frame of the robot's start: x forward, y to the right.

    Args:
        truth: Of a simulated world; the robot stands at its start now.
    """

    def __init__(self, truth: Truth) -> None:
        self._truth = truth
        self._x_mm, self._y_mm, self._heading_deg = truth.pose

    def pose(self) -> tuple[float, float, float]:
        """Return where the robot really is: x_mm, y_mm, degrees clockwise from where it faced at the start."""
        x_mm, y_mm, heading_deg = self._truth.pose
        return *self._from_start(x_mm, y_mm), round(heading_deg - self._heading_deg, 1)

    def outlines(self) -> list[tuple[float, float, float, float]]:
        """Return the sides of walls and objects on the floor: x0_mm, y0_mm, x1_mm, y1_mm of each."""
        return [(*self._from_start(x0, y0), *self._from_start(x1, y1)) for x0, y0, x1, y1 in self._truth.outlines()]

    def _from_start(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        angle = math.radians(self._heading_deg)
        dx, dy = x_mm - self._x_mm, y_mm - self._y_mm
        forward, right = dx * math.cos(angle) + dy * math.sin(angle), dy * math.cos(angle) - dx * math.sin(angle)
        return round(forward, 1), round(right, 1)


def simulated_room_of(brick: Brick) -> SimulatedRoom | None:
    """Return the room of a simulated brick whose odometry begins now; None for any other brick."""
    truth = truth_of(brick)
    return None if truth is None else SimulatedRoom(truth)


def recognised(detector: Detector, truth: Truth) -> list[str]:
    """Return the names of the objects of the world whose front a detector takes for its target."""
    return [name for name, front in truth.front_images().items() if shows(front, detector)]


def shows(front: Image, detector: Detector, heights_px: Sequence[int] = HEIGHTS_PX) -> bool:
    """Return whether a detector finds its target in a frame that shows `front`, this high, on a grey wall."""
    return any(_finds(detector, front, height_px) for height_px in heights_px)


def _finds(detector: Detector, front: Image, height_px: int) -> bool:
    frame, area = _shown(front, height_px)
    least = MIN_COLOR_SHARE * area if isinstance(detector, ColorDetector) else 0.0
    return any(found.box[2] * found.box[3] >= least for found in detector.detect(frame))


def codes_on(front: Image, detector: Detector) -> list[str]:
    """Return in words the QR codes or markers that a detector of these reads in a frame that shows `front`."""
    return codes_in(_shown(front, HEIGHTS_PX[0])[0], detector)


def _shown(front: Image, height_px: int) -> tuple[Image, int]:
    """Return a frame that shows `front` on a grey wall, and how many of its pixels that takes."""
    frame = np.full((*FRAME, 3), GRAY, np.uint8)
    height, width = front.shape[:2]
    scale = min(height_px / height, 0.9 * FRAME[1] / width)
    wide, high = max(1, round(scale * width)), max(1, round(scale * height))
    left, top = (FRAME[1] - wide) // 2, (FRAME[0] - high) // 2
    frame[top : top + high, left : left + wide] = cv2.resize(front, (wide, high), interpolation=cv2.INTER_AREA)
    return frame, wide * high
