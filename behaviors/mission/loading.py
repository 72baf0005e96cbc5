"""Read a mission file, and complete it with a robot file.

TOML, checked as a whole: every mistake is reported at once, with its path.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Sequence
from contextlib import suppress
from itertools import chain, islice
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from behaviors.detector_names import BUILT_IN_DETECTORS
from behaviors.mission.cross_checks import cross_checks
from behaviors.mission.mistakes import mistake_count, mistakes
from behaviors.mission.robot import ROBOT_VARIABLE, RobotFile, RobotFileError, RobotTable, load_robot_file, with_robot
from behaviors.mission.tables import Mission
from behaviors.mission.targets import MAX_PICTURES, MAX_TARGETS, Target
from input_files.json_text import parse_object
from input_files.mistakes import MistakesError, excerpt, is_foreign, listed
from input_files.plain import MEGABYTE, PICTURE_SUFFIXES, InputFileError, at_home, missing_file, read_text
from input_files.toml_file import read_toml

BUILT_IN = Path(__file__).parent / "lena_rilakkuma.toml"
"""The mission that runs by default."""
FILES = {"onnx": ("model", "labels")}
"""Keys of a target that name files besides pictures, by built-in detector."""
FILE = "_file"
"""A key of another package's detector names a file if it ends in this."""


class MissionError(MistakesError):
    """A mission file with mistakes, or a profile that cannot be used."""


def load_mission(
    path: Path, picture_folders: Sequence[Path] = (), *, robot: Path | None = None, default_robot: Path | None = None
) -> Mission:
    """Read and check a mission file.

    Values of the robot come from the mission's own tables first, then from a robot file, then from the defaults.

    Args:
        path: The TOML file.
        picture_folders: Where else pictures are looked for when they do not lie beside the file.
        robot: The robot file; by default the one that the mission names.
        default_robot: The robot file if neither is given: that of ``$NXT_ROBOT`` or of the folder.

    Returns:
        The mission; its pictures are absolute paths of files that exist.

    Raises:
        MissionError: A file cannot be read or has mistakes; the message lists all of them.
    """
    table = _read(path)
    _refuse_other_kinds(table, path)
    robot_error = None
    try:
        if (described := _robot_file(table, path, robot, default_robot)) is not None:
            table = with_robot(table, described)
    except MissionError as error:
        robot_error = error
    folders = [path.resolve().parent, *picture_folders]
    problems = [
        *cross_checks(table, RobotTable().model_dump()),
        *_resolve_files(table, folders),
        *_resolve_chances(table, path.resolve().parent),
    ]
    invalid: ValidationError | None = None
    try:
        mission = Mission.model_validate(table)
    except ValidationError as error:
        invalid = error
    if invalid is None and not problems:
        if robot_error is not None:
            raise robot_error
        return mission
    if robot_error is not None:
        problems += robot_error.mistakes or [robot_error.message]
    found = chain(mistakes(invalid, Mission) if invalid else (), problems)
    number, *lines = listed((mistake_count(invalid) if invalid else 0) + len(problems), found)
    raise MissionError(f"{path}: {number}", lines)


def _refuse_other_kinds(table: dict[str, Any], path: Path) -> None:
    """Refuse a world, a robot file, and a file of another program.

    Raises:
        MissionError: It is one of these.
    """
    if "mission" not in table and "floor" in table:
        raise MissionError(f"{path} is a world, not a mission. Missions drive in it with --nxt sim://{path}")
    if table and table.keys() <= RobotFile.model_fields.keys():
        raise MissionError(
            f"{path} is a robot file, not a mission. Missions use it with --robot {shlex.quote(str(path))}"
        )
    if is_foreign(table, Mission.model_fields):
        raise MissionError(
            f"{path} is not a mission: it has no [mission] and no [target.NAME]. "
            "`nxtdrive mission new FILE` writes one."
        )


def _robot_file(table: dict[str, Any], path: Path, robot: Path | None, default: Path | None) -> RobotFile | None:
    settings = table.get("mission")
    named = settings.get("robot_file") if isinstance(settings, dict) else None
    chosen = chosen_robot_file(named, path, robot, default)
    try:
        return None if chosen is None else load_robot_file(chosen)
    except RobotFileError as error:
        if robot:
            origin = ""
        elif isinstance(named, str):
            origin = f"{path}: mission.robot_file: "
        else:
            origin = f"{ROBOT_VARIABLE}: " if os.environ.get(ROBOT_VARIABLE) else ""  # or it is that of the folder
        raise MissionError(f"{origin}{error.message}", [f"{chosen}: {each}" for each in error.mistakes]) from None


def chosen_robot_file(named: object, path: Path | None, robot: Path | None, default: Path | None) -> Path | None:
    """Return the robot file that counts, if there is one.

    Args:
        named: The one that the mission names, if it is a text.
        path: The mission's file, beside which that one is; None for a mission without a file.
        robot: The one that comes before it.
        default: The one that comes after it.
    """
    beside = path.parent / at_home(named) if path is not None and isinstance(named, str) else None
    return robot or beside or default


def described_by(mission: Mission, described: RobotFile) -> Mission:
    """Return a mission with the robot file's values for keys of [robot] and [camera] that the mission does not set."""
    return Mission.model_validate(with_robot(mission.model_dump(exclude_unset=True), described))


def valid_targets(path: Path, picture_folders: Sequence[Path] = ()) -> dict[str, Target]:
    """Return the targets of a mission file that are valid without their wrong values; it may have other mistakes."""
    try:
        table = _read(path)
    except MissionError:
        return {}
    folders = [path.resolve().parent, *picture_folders]
    valid: dict[str, Target] = {}
    for name, target in _targets(table):
        if isinstance(target, dict) and not list(_resolve_files({"target": {name: target}}, folders)):
            with suppress(ValidationError):
                valid[name] = _target_without_mistakes(target)
    return valid


def _target_without_mistakes(table: dict[str, Any]) -> Target:
    target: TypeAdapter[Target] = TypeAdapter(Target)
    try:
        return target.validate_python(table)
    except ValidationError as error:
        wrong = {key for mistake in error.errors() for key in mistake["loc"][1:2]}  # after the detector's name
        return target.validate_python({key: value for key, value in table.items() if key not in wrong})


def _read(path: Path) -> dict[str, Any]:
    if path.suffix.lower() in PICTURE_SUFFIXES and path.is_file():
        writes = f"`nxtdrive mission new --picture {shlex.quote(str(path))} --height-mm MM`"
        raise MissionError(f"{path} is a picture, not a mission. {writes} writes a mission that searches for it.")
    try:
        return read_toml(path)
    except InputFileError as error:
        raise MissionError(str(error)) from None


def _targets(table: dict[str, Any]) -> Iterable[tuple[str, Any]]:
    """Return the targets by name, as many as a mission may have."""
    targets = table.get("target")
    return islice(targets.items(), MAX_TARGETS) if isinstance(targets, dict) else ()


def _resolve_files(table: dict[str, Any], folders: Sequence[Path]) -> Iterable[str]:
    """Make the paths of pictures, models and lists of labels absolute in place; yields what is wrong with them."""
    for name, target in _targets(table):
        if not isinstance(target, dict):
            continue
        pictures = target.get("pictures")
        pictures = pictures if isinstance(pictures, list) else []
        for i, picture in enumerate(pictures[:MAX_PICTURES]):
            if not isinstance(picture, str):
                continue
            paths = [folder / at_home(picture) for folder in folders]
            if found := next(filter(os.path.isfile, paths), None):
                pictures[i] = str(found)
            else:
                yield f"target.{name}.pictures[{i}]: there is no picture {missing_file(picture, folders[0], 'mission')}"
        detector = str(target.get("detector"))
        others = [] if detector in BUILT_IN_DETECTORS else [key for key in target if key.endswith(FILE)]
        for key in FILES.get(detector, others):
            if isinstance(file := target.get(key), str):
                target[key] = str(folders[0] / at_home(file))
                if not os.path.isfile(target[key]):
                    yield f"target.{name}.{key}: there is no file {missing_file(file, folders[0], 'mission')}"


def _resolve_chances(table: dict[str, Any], folder: Path) -> Iterable[str]:
    """Put the counts of a file beside the mission in place of its name; yields what is wrong with it."""
    adaptive = table.get("adaptive")
    name = adaptive.get("chances") if isinstance(adaptive, dict) else None
    if isinstance(adaptive, dict) and isinstance(name, str):
        del adaptive["chances"]
        try:
            adaptive["chances"] = parse_object(read_text(folder / at_home(name), MEGABYTE))["counts"]
        except InputFileError as error:
            yield f"adaptive.chances: {error}"
        except (ValueError, KeyError):
            yield f"adaptive.chances: {excerpt(name)}, beside the mission file, is not from nxtdrive chances --out"
