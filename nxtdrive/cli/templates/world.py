"""The room for a first mission: it holds the one target, is large enough for it, and is tried before it is written."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from input_files.toml_file import toml_string
from nxtdrive.cli.templates.target import FARTHEST_STOP_MM, TemplateTarget

if TYPE_CHECKING:
    from nxtdrive.vision.detection import TargetDetector
    from nxtdrive.vision.detectors.range_prediction import Limitation
    from sim_backend.simulation import Simulation

START_X_MM = 600.0
FRAMES = 3
"""Frames tried from one pose: noise may make a code illegible in one of them."""
LENS_FORWARD_MM = 60.0
DISTANCE_TOLERANCE = 0.2
"""Largest error of the distance of a target that counts as found, as a share of it."""
UNLIKELY_MM = 60.0
"""A smaller height of what a photograph shows was probably measured in centimetres."""

WORLD = """\
# A room for a first mission; `nxtdrive world show FILE` draws it.
# Lengths in mm, times in s, angles in degrees clockwise: 0 points to the right of the map, 90 down.
# The map has x to the right and y down. `nxtdrive world keys` lists all tables and keys.
title = {title}

[floor]
size_mm = [{width_mm:g}, {depth_mm:g}]
wall_height_mm = {wall_mm:g}

[robot]
start_mm = [{start_x_mm:g}, {row_mm:g}]
heading_deg = 270              # it has to turn before it sees the target

{target}

# More to put into the room; remove the "# ".
#
# [[boxes]]
# name = "crate"               # stops the robot, and hides the target if it is high enough
# at_mm = [{way_mm:g}, {row_mm:g}]
# size_mm = [300, 300]
# height_mm = 350
# texture = "crate"
#
# [[people]]
# name = "anna"                # comes in through the door at the edge
# enters_from_mm = [{way_mm:g}, {depth_mm:g}]
#
# [[events]]
# name = "anna steps in front of it"
# when = {{ at_s = 3 }}
# person = "anna"
# to_mm = [{way_mm:g}, {row_mm:g}]
# stays_s = 8
"""

PICTURE = """\
[[pictures]]
name = {name}
file = {file}
at_mm = [{x_mm:g}, {row_mm:g}]
facing_deg = 180               # towards the robot's start
size_mm = [{width_mm:.6g}, {height_mm:.6g}]
centre_height_mm = {centre_mm:.6g}"""

BOX = """\
[[boxes]]
name = {name}
at_mm = [{x_mm:g}, {row_mm:g}]
size_mm = [200, 200]
height_mm = {height_mm:g}
texture = "{color}_box\""""


def world_text(target: TemplateTarget, folder: Path) -> str:
    """Return the text of a world with the target.

    Args:
        target: The target.
        folder: Where the world will lie; the picture's path is relative to it if it can be.

    Raises:
        ConfigError: The name of the picture cannot be written in TOML.
    """
    width_mm, height_mm = target.size_mm
    row_mm = math.ceil(max(1200.0, width_mm / 2 + 400.0) / 100) * 100.0
    x_mm = math.ceil(START_X_MM + LENS_FORWARD_MM + target.distance_mm)
    place = {"name": toml_string(target.name), "x_mm": x_mm, "row_mm": row_mm, "height_mm": height_mm}
    if target.picture is None:
        table = BOX.format(**place, color=target.options["color"])
    else:
        file = toml_path(target.picture, folder)
        table = PICTURE.format(**place, file=file, width_mm=width_mm, centre_mm=target.centre_mm)
    return WORLD.format(
        title=toml_string(f"A room with {target.name}"),
        width_mm=math.ceil((x_mm + 600.0) / 100) * 100,
        depth_mm=2 * row_mm,
        wall_mm=max(600.0, math.ceil(target.top_mm / 100) * 100 + 100.0),
        start_x_mm=START_X_MM,
        row_mm=row_mm,
        way_mm=round((START_X_MM + x_mm) / 2),
        target=table,
    )


def toml_path(path: Path, folder: Path) -> str:
    """Return a path as a TOML string: relative to a folder that is above it, else absolute.

    Raises:
        ConfigError: It is not UTF-8.
    """
    path, folder = path.resolve(), folder.resolve()
    shown = path.relative_to(folder) if path.is_relative_to(folder) else path
    text = toml_string(shown.as_posix())
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ConfigError(f"{path}: a mission cannot name this file, it is not UTF-8.", remedy="Rename it.") from None
    return text


def try_out(target: TemplateTarget, detector: TargetDetector, text: str, path: Path) -> None:
    """Look for the target in its room, from the start to the stop, as the simulated robot will.

    Args:
        target: The target.
        detector: The mission's detector of it.
        text: The world, as `world_text` made it.
        path: Where the world will lie.

    Raises:
        ConfigError: The detector does not find the target, or finds it where it is not.
    """
    from sim_backend.simulation import Simulation
    from sim_backend.world.loading import parse_world

    if target.stop_mm > FARTHEST_STOP_MM:
        raise _too_large(target)
    simulation = Simulation(parse_world(tomllib.loads(text), path))
    row_mm = simulation.truth.pose.y_mm
    for heading_deg in (270.0, 225.0, 180.0, 135.0):
        if _found_mm(simulation, detector, START_X_MM, row_mm, heading_deg) is not None:
            raise ConfigError(
                f"{target.picture}: the picture detector finds it where it is not: it looks like a plain wall.",
                remedy="Use a picture with more contrast and detail, or a marker (--marker).",
            )
    far_mm, near_mm = target.distance_mm, target.stop_mm
    for away_mm in (far_mm, (far_mm + near_mm) / 2, near_mm):
        found_mm = _found_mm(simulation, detector, START_X_MM + far_mm - away_mm, row_mm, 0.0)
        if found_mm is None or abs(found_mm - away_mm) > DISTANCE_TOLERANCE * away_mm:
            raise _not_found(target, away_mm)


def _too_large(target: TemplateTarget) -> ConfigError:
    return ConfigError(
        f"{target.picture}: {target.width_mm:.0f} x {target.height_mm:.0f} mm is too large: the camera sees all of "
        f"it only from {target.stop_mm / 1000:.1f} m, and arrivals are at {FARTHEST_STOP_MM / 1000:g} m or less.",
        remedy="Print it smaller and give that --height-mm."
        if target.sheet
        else "Crop the photograph to a part of it, and give the height of that part.",
    )


def _not_found(target: TemplateTarget, away_mm: float) -> ConfigError:
    """Return why the target is not found from a distance, or is found at another one, and what to do."""
    if target.sheet:
        return ConfigError(
            f"{target.name} is not found from {away_mm / 1000:.1f} m: {target.height_mm:g} mm is too small for it.",
            remedy="Print it larger and give that --height-mm; a QR code of a shorter text has larger squares.",
        )
    cause, better = _limitation(target)
    return ConfigError(
        f"{target.picture}: the picture detector does not find it from {away_mm / 1000:.1f} m as a print of "
        f"{target.width_mm:.0f} x {target.height_mm:.0f} mm; {cause}.",
        remedy=f"A height in centimetres? {target.height_mm:g} cm are {10 * target.height_mm:g} mm."
        if target.height_mm < UNLIKELY_MM
        else f"Crop it, print it larger and give that --height-mm, choose a picture with {better}, or use a marker "
        "(--marker).",
    )


def _limitation(target: TemplateTarget) -> Limitation:
    """Return why a photograph is not found, and what one has that is found."""
    from nxtdrive.vision.detectors.range_prediction import Limitation, predict_range
    from nxtdrive.vision.sources import read_image

    found = predict_range(read_image(target.picture)).limitations if target.picture else ()
    return Limitation.joined(found or [Limitation("its details are too small for that", "large shapes")])


def _found_mm(
    simulation: Simulation, detector: TargetDetector, x_mm: float, y_mm: float, heading_deg: float
) -> float | None:
    """Return how far away a detector places its target in frames from a pose; None where it finds nothing."""
    from nxtdrive.vision.geometry import Pinhole

    simulation.world.place_robot((x_mm, y_mm), heading_deg)
    for _ in range(FRAMES):
        simulation.advance(1000)
        image = simulation.webcam.frame()
        found = [] if image is None else detector.detector.detect(image)
        if image is not None and found:
            pinhole = Pinhole.from_hfov(image.shape[1], simulation.webcam.hfov_deg)
            return pinhole.locate(found[0], detector.height_mm)[1]
    return None
