"""Warn of photographs that will be hard to find, by trying the detector on them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import permutations
from pathlib import Path
from typing import NamedTuple

from behaviors.mission import Mission
from behaviors.mission.targets import PictureTarget
from firmware_protocol.errors import CameraError, ConfigError
from nxtdrive.mission.simpler_detector import simpler_detector
from nxtdrive.mission.truth import HEIGHTS_PX, shows
from nxtdrive.vision.detection import Image
from nxtdrive.vision.detectors.picture import PictureDetector, check_picture
from nxtdrive.vision.detectors.range_prediction import USUAL_HEIGHT_PX, Limitation, RangePrediction, predict_range
from nxtdrive.vision.geometry import Pinhole
from nxtdrive.vision.sources import read_image

FRAME_WIDTH = 320
STOP_PX = 183
"""Height of an A4 print in the frame where a robot stops, 450 mm away: only there a detail of it may be recognised."""
MIN_RANGE_M = 1.2
"""A print that is found only from nearer is worth a warning for any reason: the robot hardly ever gets that near."""


def picture_warnings(mission: Mission) -> Iterator[str]:
    """Yield a warning for each target whose photographs are hard to find or resemble another target's.

    Photographs that cannot be used are left out; they are reported as mistakes.
    """
    pictures: dict[str, list[Image]] = {}
    for name in dict.fromkeys(mission.mission.targets):
        target = mission.target[name]
        files = target.pictures if isinstance(target, PictureTarget) else []
        tried = [found for file in files if (found := _tried(file)) is not None]
        if tried:
            pictures[name] = [each.image for each in tried]
            yield from _hard_to_find(mission, name, [each.expected for each in tried])
            yield from {f"target.{name}: {each.simpler}.": None for each in tried if each.simpler}
    detectors = {name: PictureDetector(images) for name, images in pictures.items()} if len(pictures) > 1 else {}
    for name, other in permutations(pictures, 2):
        if any(shows(front, detectors[name], (*HEIGHTS_PX, STOP_PX)) for front in pictures[other]):
            yield (
                f"target.{name}: its picture resembles that of target.{other}, which will be taken for it. "
                f"Choose pictures that differ more."
            )


class _PhotographCheck(NamedTuple):
    """A photograph, what to expect of it, and the detector that fits it better, if there is one."""

    image: Image
    expected: RangePrediction
    simpler: str


def _tried(file: str) -> _PhotographCheck | None:
    """Try a photograph; return None if it cannot be used."""
    try:
        stat = Path(file).stat()
        return _prediction_of(file, stat.st_mtime_ns, stat.st_size)
    except (OSError, CameraError, ConfigError):
        return None


@lru_cache(maxsize=32)
def _prediction_of(file: str, _mtime_ns: int, _size: int) -> _PhotographCheck:
    """Try the detector on a photograph, once for each version of its file: editors check at each pause in typing."""
    image = read_image(Path(file))
    check_picture(image)
    return _PhotographCheck(image, predict_range(image), simpler_detector(image))


def _hard_to_find(mission: Mission, name: str, predictions: list[RangePrediction]) -> Iterator[str]:
    """Warn if no photograph of a target is found from as far as most prints are."""
    best = min(predictions, key=lambda each: each.height_px or math.inf)
    pinhole = Pinhole.from_hfov(FRAME_WIDTH, mission.camera.hfov_deg)
    height_mm = mission.target[name].height_mm
    usual_m = pinhole.distance_mm(USUAL_HEIGHT_PX, height_mm) / 1000
    range_m = 0.0 if best.height_px is None else pinhole.distance_mm(best.height_px, height_mm) / 1000
    if best.hard:
        cause, better = Limitation.joined(best.limitations)
        far = f"only up to about {range_m:.1f} m" if best.height_px else "only from very near"
        yield (
            f"target.{name}: the picture will be hard to find: {far}, where most prints of its size are found up to "
            f"{usual_m:.1f} m. The reason: {cause}. Choose a picture with {better}, or print it larger and set "
            "height_mm."
        )
    elif range_m < MIN_RANGE_M:
        yield (
            f"target.{name}: a print of {height_mm:g} mm is small: it is found only up to about {range_m:.1f} m. "
            f"Print it larger, and set height_mm."
        )
