"""Check a mission before it runs: mistakes, and warnings of what is valid but probably not intended."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from behaviors.mission import Mission, MissionError, load_mission, valid_targets
from behaviors.mission.robot import FRAME_ASPECT
from behaviors.mission.targets import HaarTarget, MarkerTarget, PictureTarget, QrTarget, Target
from behaviors.mission.usual_heights import cascade_label, default_height_mm
from behaviors.mission.value_warnings import value_warnings
from behaviors.profile_names import ADAPTIVE
from firmware_protocol.errors import CameraError, ConfigError
from input_files.mistakes import excerpt
from nxtdrive.mission.detectors import make_detectors
from nxtdrive.mission.files import PICTURES, check_profile, default_robot_file
from nxtdrive.vision.geometry import A4_HEIGHT_MM, MARKER_HEIGHT_MM, QR_HEIGHT_MM

SHEETS_MM = {"A3": (297, 420), "A4": (210, 297), "A5": (148, 210), "A6": (105, 148)}
"""Short and long side of the usual sheets. Source: ISO 216."""
A4_SHAPE = SHEETS_MM["A4"][0] / SHEETS_MM["A4"][1]
A4_TOLERANCE = 0.1
"""A picture whose width over height differs from an upright A4 sheet's by less than this share may be one."""
SHEET_SHAPE = 0.02
"""A picture whose shape differs from a sheet's by less than this share fills a sheet."""
SHEET_SIZE = 0.08
"""A height within this share of a sheet's is that sheet's, measured roughly or printed with a margin."""
MIN_WIDTH_MM, MAX_WIDTH_MM = 30.0, 2500.0
MIN_IN_VIEW = 0.7
"""Share of a picture's width and height that the frame must show at the stop; its middle 60 % is enough to find it."""
RIM = 1.15
"""For a whole target to be in view, the frame must be larger than it by this factor."""


@dataclass(slots=True)
class Findings:
    """Results of checking a mission or a world.

    Attributes:
        mistakes: Why it cannot run.
        warnings: What is valid but probably not intended.
    """

    mistakes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def check_mission(
    path: Path, robot: Path | None = None, default: Path | None = None, *, load_profile: bool = False
) -> Findings:
    """Check a mission file, and try the pictures and cascades it names; finds all mistakes in one pass.

    Args:
        path: The mission file.
        robot: The robot file.
        default: The robot file if neither `robot` nor the mission names one; by default ``$NXT_ROBOT``.
        load_profile: Whether to load a mission's own profile, which runs the module that the file names.
    """
    found = Findings()
    try:
        mission = load_mission(path, [PICTURES], robot=robot, default_robot=default or default_robot_file())
    except MissionError as error:
        found.mistakes = [*error.mistakes] or [error.message.removeprefix(f"{path}: ")]
        targets = valid_targets(path, [PICTURES])
    else:
        targets = mission.target
        from nxtdrive.mission.picture_checks import picture_warnings

        found.warnings = [*warnings(mission), *picture_warnings(mission)]
        if load_profile:
            try:
                check_profile(mission.mission.profile)
            except ConfigError as error:
                found.mistakes.append(f"mission.profile: {error}")
    found.mistakes += make_detectors(targets, {})[1]
    return found


def warnings(mission: Mission) -> Iterator[str]:
    """Yield warnings, one sentence or two each: about values, and about how pictures fit them."""
    yield from value_warnings(mission)
    yield from _unknown_situations(mission)
    for name in dict.fromkeys(mission.mission.targets):
        target = mission.target[name]
        shape = _shape(target.pictures[0]) if isinstance(target, PictureTarget) else None
        if shape is not None:
            yield from _odd_shape(name, target.height_mm, shape, chosen="height_mm" in target.model_fields_set)
        yield from _no_sheet_height(name, target)
        yield from _no_cascade_height(name, target)
        whole = 1.0 if isinstance(target, MarkerTarget | QrTarget) else MIN_IN_VIEW
        yield from _out_of_view(mission, name, (shape or 0.0) * target.height_mm, target.height_mm, whole)


def _unknown_situations(mission: Mission) -> Iterator[str]:
    from behaviors.adaptive.chances import is_situation

    counts = mission.adaptive.chances or {}
    unknown = [each for each in counts if not is_situation(each)]
    if unknown and mission.mission.profile == ADAPTIVE:
        yield (
            f"adaptive.chances: {len(unknown)} of {len(counts)} counts have no effect, "
            f"{excerpt(unknown[0])} for instance: this version of nxtdrive has no such situation. Count the runs again."
        )


def _shape(picture: str) -> float | None:
    """Return a picture's width over its height; None if it cannot be read, which is reported as a mistake."""
    from nxtdrive.vision.sources import read_image

    try:
        height, width = read_image(Path(picture)).shape[:2]
    except CameraError:
        return None
    return float(width / height)


def _odd_shape(name: str, height_mm: float, shape: float, *, chosen: bool) -> Iterator[str]:
    width_mm = height_mm * shape
    if not chosen and abs(shape / A4_SHAPE - 1) > A4_TOLERANCE:
        landscape = "; an A4 sheet in landscape is 210 mm high" if shape > 1 else ""
        yield (
            f"target.{name}: height_mm is missing, so that of an upright A4 sheet is assumed, {A4_HEIGHT_MM:g}, but "
            f"the picture has another shape. Measure it and set height_mm{landscape}."
        )
    elif not MIN_WIDTH_MM <= width_mm <= MAX_WIDTH_MM:
        yield f"target.{name}: at height_mm = {height_mm:g} the picture is {width_mm:.0f} mm wide. Is that its height?"
    elif abs(min(shape, 1 / shape) / A4_SHAPE - 1) < SHEET_SHAPE:
        heights = {sheet: sides[shape < 1] for sheet, sides in SHEETS_MM.items()}
        if all(abs(height_mm / each - 1) > SHEET_SIZE for each in heights.values()):
            sheets = ", ".join(f"{sheet} {each}" for sheet, each in heights.items())
            yield (
                f"target.{name}: the picture has the shape of a sheet of paper, and no sheet is {height_mm:g} mm high "
                f"({'portrait' if shape < 1 else 'landscape'}: {sheets}). Measure the print."
            )


def _no_sheet_height(name: str, target: Target) -> Iterator[str]:
    if isinstance(target, MarkerTarget | QrTarget) and "height_mm" not in target.model_fields_set:
        usual_mm = MARKER_HEIGHT_MM if isinstance(target, MarkerTarget) else QR_HEIGHT_MM
        yield (
            f"target.{name}: height_mm is missing, so {target.height_mm:g} is assumed; the sheet that "
            f"`nxtdrive mission new` writes has {usual_mm:g}. Measure the black part and set height_mm: all distances "
            "are computed from it."
        )


def _no_cascade_height(name: str, target: Target) -> Iterator[str]:
    if isinstance(target, HaarTarget) and "height_mm" not in target.model_fields_set:
        label = cascade_label(target.cascade)
        usual = f"; {default_height_mm(label):g} is usual for a {label}" if label else ""
        yield (
            f"target.{name}: height_mm is missing, so {target.height_mm:g} is assumed, that of an A4 sheet{usual}. "
            "Measure what the cascade finds and set height_mm: all distances are computed from it."
        )


def _out_of_view(mission: Mission, name: str, width_mm: float, height_mm: float, share: float) -> Iterator[str]:
    arrive_mm = mission.parameters.arrive_mm
    view = 2 * math.tan(math.radians(mission.camera.hfov_deg / 2))
    whole_mm = RIM * max(width_mm / view, height_mm / (view * FRAME_ASPECT))
    if arrive_mm * RIM < share * whole_mm:
        yield (
            f"target.{name}: from {mission.parameters_name}.arrive_mm = {arrive_mm:g} the camera sees only part of it "
            f"and may lose it there. Set arrive_mm = {10 * math.ceil(whole_mm / 10)}."
        )
