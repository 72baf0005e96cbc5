"""Read ``classroom.toml``: the robots of a classroom, their bricks and cameras, and where runs and missions are."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import count, islice
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from firmware_protocol.errors import ConfigError
from input_files.mistakes import key_path
from nxtdrive.cli.pace import in_real_time
from nxtdrive.mission.camera import GEOMETRIC
from nxtdrive.mission.files import in_own_room
from nxtdrive.transports import transport_class
from nxtdrive.transports.address import Address
from sim_backend.toml_file import Problem, check, mistakes, read_tables
from sim_backend.world.loading import load_world

from ..missions import Missions, is_device

MAX_ROBOTS = 30
"""Maximum number of robots in a classroom."""
DEFAULT_WORLD = "arena"
COLORS = ("#c4161c", "#0b5fb0", "#1b7a3d", "#b35900", "#7b2d8b", "#00747a", "#8a6d00", "#c2185b", "#4a5568", "#5d4037")
"""Colours of robots for which none is given, in order."""
NAME = r"^\w(?:[\w -]{0,38}\w)?$"
"""A robot's name is also a folder's, on every system."""


class _Table(BaseModel):
    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, arbitrary_types_allowed=True, allow_inf_nan=False
    )


def _address(text: object) -> Address:
    """Read a brick's address; a simulated one runs in real time."""
    if not isinstance(text, str):
        raise ValueError(f"must be text in quotes, not {text!r}")  # noqa: TRY004 - pydantic collects only these
    address = in_real_time(text)
    transport_class(address.scheme)
    return address


BrickAddress = Annotated[Address, BeforeValidator(_address)]


class RobotTable(_Table):
    """A ``[[robot]]`` of the file.

    Attributes:
        name: Shown on the page, and the name of the folder of its runs.
        color: Of its tile, ``#rrggbb``.
        nxt: Address of its brick; a simulated one by default.
        camera: As for ``nxtdrive run``. A simulated robot finds its targets by geometry unless this is ``sim``.
        mission: File of the mission that is proposed for it.
        fall_back: Whether a simulated robot takes its place when the brick is lost or cannot be opened.
    """

    name: Annotated[str, Field(pattern=NAME)]
    color: Annotated[str, Field(pattern=r"^#[0-9a-fA-F]{6}$")] | None = None
    nxt: BrickAddress | None = None
    camera: str | None = None
    mission: str | None = None
    fall_back: bool = False


class ClassroomTable(_Table):
    """The table ``[classroom]``.

    Attributes:
        name: Title of the page.
        runs: Folder of the runs, in which each robot has its own.
        missions: Folder of the mission files.
        simulated: Number of simulated robots besides those that are listed.
        world: Name or file of the world of each simulated robot.
    """

    name: str = "classroom"
    runs: str | None = None
    missions: str | None = None
    simulated: Annotated[int, Field(ge=0, le=MAX_ROBOTS)] = 0
    world: str = DEFAULT_WORLD


class ClassroomFile(_Table):
    """A whole file."""

    classroom: ClassroomTable = ClassroomTable()
    robot: list[RobotTable] = []


@dataclass(frozen=True, slots=True)
class RobotEntry:
    """One robot of a classroom.

    Attributes:
        name: Of the robot, and of the folder of its runs.
        color: ``#rrggbb``.
        address: Of its brick.
        camera: As for ``nxtdrive run``, or "geometric"; None for the first webcam.
        mission: The mission file that is proposed for it; empty for the built-in one.
        stand_in: Address of the simulated robot that replaces it; None if none does.
    """

    name: str
    color: str
    address: Address
    camera: str | None = GEOMETRIC
    mission: str = ""
    stand_in: Address | None = None


@dataclass(frozen=True, slots=True)
class ClassroomConfig:
    """A classroom.

    Attributes:
        name: Title of the page.
        robots: In the page's order.
        runs: Folder of the runs; each robot has its own in it.
        missions: Folder of the mission files.
    """

    name: str
    robots: tuple[RobotEntry, ...]
    runs: Path
    missions: Path


def simulated_classroom(number: int, missions: Path, runs: Path, mission: Path | None = None) -> ClassroomConfig:
    """Return a classroom of simulated robots.

    Args:
        number: How many robots.
        missions: Folder of the mission files.
        runs: Folder of the runs.
        mission: Each robot's own, if it is in `missions`; the robots stand in its room, else in the default world.

    Raises:
        ConfigError: There are too few or too many of them.
    """
    if not 1 <= number <= MAX_ROBOTS:
        raise ConfigError(f"a classroom has 1 to {MAX_ROBOTS} robots, not {number}.", remedy="Choose another number.")
    own = Missions(missions, mission=mission).proposed or None
    robots = [RobotTable(name=f"Robot {each}", mission=own) for each in range(1, number + 1)]
    address = in_own_room(Address("sim", ""), mission)
    return _config(ClassroomFile(robot=robots), address.target or DEFAULT_WORLD, missions, runs)


def read_classroom(path: Path, missions: Path, runs: Path) -> ClassroomConfig:
    """Read a classroom from a TOML file; its relative paths begin at the file's folder.

    Args:
        path: The file.
        missions: Folder of the mission files if the file names none.
        runs: Folder of the runs if the file names none.

    Raises:
        ConfigError: The file cannot be read or has mistakes; the message lists all of them.
    """
    tables = read_tables(path)
    if "mission" in tables:
        raise ConfigError(
            f"{path} is a mission file, not a classroom.",
            remedy="Choose the mission on the page; a classroom has a table [[robot]] for each robot, or is a number.",
        )
    file, problems = check(ClassroomFile, tables)
    found = [*map(_sentence, problems), *(_wrong_number(file) if file else ())]
    file = file or _valid_part(tables)
    table, folder = file.classroom, path.parent
    missions = folder / table.missions if table.missions else missions
    runs = folder / table.runs if table.runs else runs
    world = _world(folder, table.world)
    file = file.model_copy(update={"robot": [_with_world(folder, robot) for robot in file.robot]})
    found += _mistakes(file, world, Missions(missions))
    if found:
        raise mistakes(path, found)
    return _config(file, world, missions, runs)


def _world(folder: Path, world: str) -> str:
    """Return the path of a world's file in a folder, if it is there, or else the world as given."""
    beside = folder / world
    return str(beside) if os.path.isfile(beside) else world


def _with_world(folder: Path, robot: RobotTable) -> RobotTable:
    """Return a robot's table, with the path of its world's file if its address names one in a folder."""
    if robot.nxt is None or robot.nxt.scheme != "sim":
        return robot
    return robot.model_copy(update={"nxt": replace(robot.nxt, target=_world(folder, robot.nxt.target))})


def _sentence(problem: Problem) -> str:
    """Return a problem as a sentence; for a pattern also what it requires."""
    if problem.kind != "string_pattern_mismatch":
        return problem.sentence
    where = key_path(problem.location)
    if problem.location[-1] == "color":
        return f'{where}: a colour is written "#rrggbb", as in "#c4161c"'
    return f"{where}: at most 40 letters, digits, spaces, - and _, with a letter or digit at both ends"


def _config(file: ClassroomFile, world: str, missions: Path, runs: Path) -> ClassroomConfig:
    names = islice(_free_names(table.name for table in file.robot), file.classroom.simulated)
    tables = [*file.robot, *(RobotTable(name=name) for name in names)]
    robots = tuple(
        _entry(table, COLORS[seed % len(COLORS)], Address("sim", world, {"seed": str(seed), "pace": "realtime"}))
        for seed, table in enumerate(tables)
    )
    return ClassroomConfig(file.classroom.name, robots, runs, missions)


def _entry(table: RobotTable, color: str, simulated: Address) -> RobotEntry:
    address = table.nxt or simulated
    is_simulated = address.scheme == "sim"
    return RobotEntry(
        name=table.name,
        color=table.color or color,
        address=address,
        camera=table.camera or (GEOMETRIC if is_simulated else None),
        mission=table.mission or "",
        stand_in=simulated if table.fall_back and not is_simulated else None,
    )


def _free_names(taken: Iterable[str]) -> Iterator[str]:
    """Yield "Robot 1", "Robot 2" and so on, without the names that are taken."""
    known = {name.casefold() for name in taken}
    return (name for number in count(1) if (name := f"Robot {number}").casefold() not in known)


def _valid_part(tables: Mapping[str, Any]) -> ClassroomFile:
    """Return a file with only the valid tables.

    Without that of the classroom the folder of the missions is not known, so no robot has one.
    """
    classroom, _ = check(ClassroomTable, tables.get("classroom", {}))
    listed = tables.get("robot")
    robots = [robot for each in (listed if isinstance(listed, list) else ()) if (robot := check(RobotTable, each)[0])]
    if classroom is None:
        robots = [robot.model_copy(update={"mission": None}) for robot in robots]
    return ClassroomFile(classroom=classroom or ClassroomTable(), robot=robots)


def _wrong_number(file: ClassroomFile) -> Iterator[str]:
    number = len(file.robot) + file.classroom.simulated
    if not number:
        yield "there are no robots; set classroom.simulated = 12, or describe each in a table [[robot]]"
    elif number > MAX_ROBOTS:
        yield f"there are {number} robots; a classroom has at most {MAX_ROBOTS}"


def _mistakes(file: ClassroomFile, world: str, missions: Missions) -> Iterator[str]:
    """Yield what is wrong with values that are valid by themselves."""
    yield from _wrong_robots(file.robot)
    if os.path.isdir(missions.folder):
        yield from _wrong_missions(file.robot, missions)
    else:
        yield f"classroom.missions: there is no folder {missions.folder}"
    targets = {table.nxt.target for table in file.robot if table.nxt and table.nxt.scheme == "sim"}
    for each in sorted({world, *targets}):
        try:
            load_world(each or DEFAULT_WORLD)
        except ConfigError as error:
            yield f"the world {each!r}: {error}"


def _wrong_robots(robots: list[RobotTable]) -> Iterator[str]:
    """Yield what is wrong with robots whose tables are valid by themselves."""
    for name in sorted({table.name for table in robots if is_device(table.name)}):
        yield f"robot {name!r}: Windows has no folder of this name; choose another one"
    for key, values in _unique_values(robots):
        for value, times in Counter(values).items():
            if times > 1:
                yield f"{times} robots have the {key} {value!r}; each robot needs its own"
    for table in robots:
        if table.camera == GEOMETRIC and table.nxt and table.nxt.scheme != "sim":
            yield f'robot {table.name!r}, camera: only a simulated robot can have "{GEOMETRIC}"; name its webcam'


def _unique_values(robots: list[RobotTable]) -> Iterator[tuple[str, list[str]]]:
    """Yield the keys whose values no two robots may share: folders, bricks, webcams."""
    yield "name", [table.name.casefold() for table in robots]
    yield "nxt", [str(table.nxt).casefold() for table in robots if table.nxt and table.nxt.scheme != "sim"]
    yield "camera", [table.camera for table in robots if table.camera and table.camera.isdecimal()]


def _wrong_missions(robots: list[RobotTable], missions: Missions) -> Iterator[str]:
    for table in robots:
        try:
            missions.load(table.mission or "")
        except ValueError as error:
            yield f"robot {table.name!r}, mission: {error}"
