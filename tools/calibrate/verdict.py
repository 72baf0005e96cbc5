"""Check an estimate, and make a robot file of it."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping
from pathlib import Path

from pydantic import BaseModel, ValidationError

from behaviors.mission.mistakes import mistakes
from behaviors.mission.robot import MeasuredTable, RobotFile
from input_files.toml_file import toml_key, toml_string

from .camera_and_wheels import Estimate
from .course import REMEDY, CalibrationRefused

MAX_RESIDUAL = 1.0 / 320
"""Largest distance between predicted and measured corners, over the frame's width."""
MOST_MISSED = 1.0 / 50
"""Largest such distance, root mean square, over the whole drive by wheel counts alone, over the frame's width: 1.4
degrees of 60. Random slip gives a quarter of that; a robot that was moved, or whose wheel slipped once, much more."""
UNSURE = {
    "hfov_deg": 0.8,
    "yaw_deg": 1.5,
    "tilt_deg": 1.0,
    "roll_deg": 1.0,
    "forward_mm": 15.0,
    "right_mm": 15.0,
    "latency_s": 0.02,
    "wheel_diameter_mm": 0.4,
    "wheel_mismatch_percent": 0.4,
    "axle_track_mm": 1.0,
}
"""Standard errors beyond these are of no use."""
DIGITS = {"latency_s": 4, "wheel_diameter_mm": 2, "wheel_mismatch_percent": 2, "hfov_deg": 2}


def check(found: Estimate, width_px: int, missed_px: float) -> None:
    """Refuse an estimate that is not good enough.

    Args:
        found: The estimate.
        width_px: Width of the frames.
        missed_px: By how much it misses the markers of the drive, as `camera_and_wheels.misfit_px` says.

    Raises:
        CalibrationRefused: It says why, and what to do.
    """
    for reason in _objections(found, width_px, missed_px):
        raise CalibrationRefused(reason, remedy=REMEDY)


def _objections(found: Estimate, width_px: int, missed_px: float) -> Iterator[str]:
    if not found.converged:
        yield "no values fit what the camera saw."
    if not found.residual_px <= MAX_RESIDUAL * width_px:
        yield (
            f"the best values still miss the markers by {found.residual_px:.1f} px; the sheet may be bent or printed "
            "in another size, the wheels slip, or the lens bends straight lines."
        )
    for key, most in UNSURE.items():
        if not found.standard_errors[key] <= most:  # NaN included
            yield f"{key} is uncertain by {found.standard_errors[key]:.2g}, more than {most:g}."
    if not missed_px <= MOST_MISSED * width_px:
        yield (
            f"over the whole drive the best values miss the markers by {missed_px:.1f} px: the robot was moved, or a "
            "wheel slipped."
        )


def rounded(values: Mapping[str, float], keys: tuple[str, ...]) -> dict[str, float]:
    """Return the values of some keys, with their significant digits."""
    return {key: round(values[key], DIGITS.get(key, 1)) + 0.0 for key in keys}


def described(before: RobotFile, changes: Mapping[str, Mapping[str, object]], remedy: str = REMEDY) -> RobotFile:
    """Return a robot file with new values for some keys of its tables.

    Args:
        before: The file so far.
        changes: New values by the name of the table.
        remedy: What to do about a value that cannot be that of a robot.

    Raises:
        CalibrationRefused: A value cannot be that of a robot.
    """
    tables = {name: {**table, **changes.get(name, {})} for name, table in before.model_dump(exclude_unset=True).items()}
    tables = {**{name: dict(table) for name, table in changes.items()}, **tables}
    try:
        return RobotFile.model_validate(tables)
    except ValidationError as error:
        found = "; ".join(mistakes(error, RobotFile))
        raise CalibrationRefused(f"the measured values are implausible: {found}.", remedy=remedy) from None


def measured(method: str, errors: Mapping[str, float], date: datetime.date, **others: float) -> dict[str, object]:
    """Return a table that says how some values were measured."""
    significant = {key: float(f"{error:.2g}") for key, error in errors.items()}
    return MeasuredTable(date=date, method=method, standard_uncertainty=significant, measured=others).model_dump(
        exclude_unset=True
    )


HEADING = "# How this robot is built, written by `nxtdrive calibrate`. `nxtdrive mission show` lists all keys."


def toml_text(file: RobotFile) -> str:
    """Return a robot file's text."""
    lines = [HEADING]
    for name, table in (("robot", file.robot), ("camera", file.camera)):
        if table.model_fields_set:
            lines += ["", f"[{name}]", *_keys(table)]
    for color, shade in file.color.items():
        lines += ["", f"[color.{color}]", *_keys(shade)]
    lines += ["", "[calibration]"]
    groups = []
    for key, value in file.calibration:
        if isinstance(value, MeasuredTable):
            groups += ["", f"[calibration.{key}]", *_keys(value)]
        elif value is not None:
            lines.append(f"{key} = {_value(value)}")
    return "\n".join([*lines, *groups, ""])


def _keys(table: BaseModel) -> Iterator[str]:
    for key in type(table).model_fields:
        if key in table.model_fields_set:
            yield f"{key} = {_value(getattr(table, key))}"


def _value(value: object) -> str:
    match value:
        case bool():
            return str(value).lower()
        case datetime.date():
            return value.isoformat()
        case dict():
            pairs = (f"{toml_key(key)} = {_value(each)}" for key, each in value.items())
            return f"{{ {', '.join(pairs)} }}"
        case str():
            return toml_string(value)
    return repr(value)


def write_robot_file(path: Path, file: RobotFile) -> Path | None:
    """Write a robot file as a whole, in place of one that exists.

    Returns:
        Where the previous file is kept, if there was one: under another name if it has comments, which the new one
        lacks, so that a second calibration does not replace it.

    Raises:
        OSError: It cannot be written; what was there before is left as it is.
    """
    from nxtdrive.recording.output_file import replace_file

    copy = None
    if path.is_file():
        commented = b"#" in (before := path.read_bytes()).removeprefix(HEADING.encode())
        copy = path.with_name(f"{path.name}.{'bak' if commented else 'previous'}")
        replace_file(copy, before)
    replace_file(path, toml_text(file).encode())
    return copy
