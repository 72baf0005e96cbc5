"""Learn how a colour looks in this camera and light, from pictures with something of that colour in the middle."""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

import cv2
import numpy as np

from behaviors.angles import wrapped_deg
from behaviors.mission.robot import ColorName, ColorTable, RobotFile
from nxtdrive.vision.detection import Detection, Image
from nxtdrive.vision.detectors.color import HUES, ColorDetector, default_shade

from .course import CalibrationRefused
from .session import CalibrationResult, ReportLine, identified
from .verdict import described, measured

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.vision.camera import Camera

FRAMES, FRAME_S = 20, 3.0
"""Frames from which the colour is learned, and the longest wait for each."""
MIDDLE = 0.06
"""Width of the patch in the middle of the frame from which the colour is learned, as a share of the frame's width."""
MIN_SATURATION_PERCENT, MAX_SPREAD_DEG = 20.0, 12.0
"""Paler patches have no hue to go by; more varied ones are not of one colour."""
FARTHEST_DEG = 60.0
"""A hue farther than this from the usual one is another colour."""
REACH_SPREADS, MIN_REACH_DEG, MAX_REACH_DEG = 4.0, 16.0, 24.0
"""How far a hue may be from the learned one: this many standard deviations of the patch's hues, within these bounds."""
SATURATION_SHARE, VALUE_SHARE = 0.7, 0.5
"""Minimum saturation and value, as shares of what the dullest twentieth of the patch has; the light changes."""
FOUND_SHARE = 0.8
"""Share of the frames in which the patch must be found."""
OTHER_SHARE = 0.5
"""Largest area of a second patch, as a share of the first one's."""


def calibrate_color(
    brick: Brick, camera: Camera, before: RobotFile, today: datetime.date, color: str | None = None
) -> CalibrationResult:
    """Learn the colour in the middle of the camera's picture; the robot stands still.

    Args:
        brick: The brick.
        camera: Its camera.
        before: The robot file so far.
        today: The date for the file.
        color: The colour's name in missions; by default the one that it resembles most.

    Raises:
        CalibrationRefused: It has no strong colour, is of another one, or does not differ from its surroundings.
    """
    identity = identified(brick, before)
    frames = [camera.read(FRAME_S).image for _ in range(FRAMES)]
    name, learned, error_deg = learn(frames, color)
    known = before.color.get(name, ColorTable(**default_shade(name)))
    shares = tuple(sum(_is_found(frame, name, shade) for frame in frames) / FRAMES for shade in (known, learned))
    if shares[1] < FOUND_SHARE:
        raise CalibrationRefused(
            f"with the values measured {name} is found in only {shares[1]:.0%} of the frames, or something else of "
            "that colour is in view.",
            remedy="Turn the robot to a background of another colour, or take a larger sheet.",
        )
    values = learned.model_dump()
    how = measured(f"{name}, in the middle of the picture", {"hue_deg": error_deg}, today)
    file = described(before, {"color": {name: values}, "calibration": {**identity, "colors": how}})
    lines = [
        ReportLine(f"color.{name}.{key}", getattr(known, key), value, error_deg if key == "hue_deg" else None)
        for key, value in values.items()
    ]
    remark = f"It was found in {shares[0]:.0%} of {FRAMES} frames before, and in {shares[1]:.0%} now."
    return CalibrationResult(file, lines, None, FRAMES, remark)


def learn(frames: Sequence[Image], color: str | None = None) -> tuple[ColorName, ColorTable, float]:
    """Return the name of the colour in the middle of frames, how it looks, and the standard error of its hue.

    Raises:
        CalibrationRefused: It has no strong colour, or is of another one.
    """
    by_frame = [_middle(frame) for frame in frames]
    patches = np.concatenate(by_frame)
    turned = _mean_hue(patches)
    hue_deg = math.degrees(np.angle(turned)) % 360
    spread_deg = math.degrees(math.sqrt(max(0.0, -2 * math.log(max(abs(turned), 1e-9)))))
    saturation, value = (float(np.percentile(patches[:, column], 5)) / 2.55 for column in (1, 2))
    if saturation < MIN_SATURATION_PERCENT or spread_deg > MAX_SPREAD_DEG:
        why = "has no strong colour" if saturation < MIN_SATURATION_PERCENT else "has several colours"
        raise CalibrationRefused(
            f"what is in the middle of the picture {why} (saturation {saturation:.0f} %, hues {spread_deg:.0f} degrees "
            "apart).",
            remedy="Put a sheet of one strong colour there, in good light, and see that it fills the middle.",
        )
    name = color or min(HUES, key=lambda each: abs(wrapped_deg(hue_deg - 2.0 * HUES[each])))
    if abs(wrapped_deg(hue_deg - 2.0 * HUES[name])) > FARTHEST_DEG:
        raise CalibrationRefused(
            f"what is in the middle of the picture is not {name}: its hue is {hue_deg:.0f} degrees, and that of {name} "
            f"is {2 * HUES[name]}.",
            remedy="Name its colour with --color.",
        )
    turns = np.array([_mean_hue(patch) for patch in by_frame])
    error_deg = float(np.degrees(np.std(np.angle(turns / turned)))) / math.sqrt(len(frames))
    reach_deg = min(max(MIN_REACH_DEG, REACH_SPREADS * spread_deg), MAX_REACH_DEG)
    shade = ColorTable(
        hue_deg=round(hue_deg, 1) % 360,
        reach_deg=round(reach_deg, 1),
        min_saturation_percent=round(SATURATION_SHARE * saturation, 1),
        min_value_percent=round(VALUE_SHARE * value, 1),
    )
    return cast("ColorName", name), shade, error_deg


def _mean_hue(patch: np.ndarray) -> complex:
    """Return the mean of the pixels' hues, each as a unit vector in the complex plane."""
    return complex(np.exp(1j * np.radians(patch[:, 0] * 2.0)).mean())


def _middle(image: Image) -> np.ndarray:
    """Return hue, saturation and value of the pixels in the middle of a frame, one row each."""
    height, width = image.shape[:2]
    half = max(2, round(MIDDLE * width / 2))
    patch = image[height // 2 - half : height // 2 + half, width // 2 - half : width // 2 + half]
    return np.asarray(cv2.cvtColor(cv2.GaussianBlur(patch, (3, 3), 0), cv2.COLOR_BGR2HSV), np.float64).reshape(-1, 3)


def _is_found(image: Image, name: str, shade: ColorTable) -> bool:
    """Return whether a detector finds the patch in the middle, and nothing else that is nearly as large."""
    found = ColorDetector(name, **shade.model_dump()).detect(image)
    height, width = image.shape[:2]
    return bool(
        found
        and _holds(found[0], width / 2, height / 2)
        and all(_area(other) < OTHER_SHARE * _area(found[0]) for other in found[1:])
    )


def _holds(detection: Detection, u: float, v: float) -> bool:
    left, top, width, height = detection.box
    return left <= u <= left + width and top <= v <= top + height


def _area(detection: Detection) -> float:
    return float(detection.box[2] * detection.box[3])
