"""Read the files of a mission: the mission itself, and the robot file."""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path

from behaviors.mission import BUILT_IN, Mission, MissionError, load_mission
from behaviors.mission.robot import ROBOT_VARIABLE, RobotFile, RobotFileError, load_robot_file
from behaviors.profile_names import BUILT_IN_PROFILES
from firmware_protocol.errors import ConfigError
from nxtdrive.transports.address import Address
from nxtdrive.transports.record import in_room

PICTURES = Path(str(resources.files("sim_backend"))) / "pictures"
"""The built-in pictures; a mission may name them without having copies."""

ROBOT_FILE = Path("robot.toml")
"""Where `nxtdrive calibrate` writes when no robot file is named."""


def own_room(mission: Path) -> Path:
    """Return where `nxtdrive mission new` writes the simulated room of a mission."""
    return mission.parent / f"{mission.stem}-world.toml"


def in_own_room(address: Address, mission: Path | None) -> Address:
    """Return the address with a mission's own room, if that file exists and the simulated brick's address names none.

    Args:
        address: A brick's; returned as it is if the brick is not simulated.
        mission: The mission file; None for the built-in mission, which has no such room.
    """
    if mission is None or not (room := own_room(mission)).is_file():
        return address
    return in_room(address, str(room))


def default_robot_file() -> Path | None:
    """Return the robot file of the environment, if it names one."""
    named = os.environ.get(ROBOT_VARIABLE)
    return Path(named) if named else None


def robot_file_of(folder: Path) -> Path | None:
    """Return the robot file for missions in a folder if none is named: that of the environment, else ``robot.toml``."""
    beside = folder / ROBOT_FILE
    return default_robot_file() or (beside if os.path.lexists(beside) else None)


def read_robot_file(path: Path | None) -> RobotFile:
    """Read a robot file; without a path, one without values.

    Raises:
        ConfigError: The file has mistakes; the message lists all of them.
    """
    try:
        return RobotFile() if path is None else load_robot_file(path)
    except RobotFileError as error:
        raise ConfigError(str(error)) from None


def read_mission_file(path: Path | None, robot: Path | None = None, default: Path | None = None) -> Mission:
    """Read a mission file; without a path, the built-in one.

    Args:
        path: The mission file.
        robot: The robot file; by default the one that the mission names.
        default: The robot file if neither is given; by default ``$NXT_ROBOT``.

    Raises:
        ConfigError: A file has mistakes; the message lists all of them.
    """
    try:
        mission = load_mission(path or BUILT_IN, [PICTURES], robot=robot, default_robot=default or default_robot_file())
    except MissionError as error:
        raise ConfigError(str(error)) from None
    return with_profile(mission, mission.mission.profile)


def with_profile(mission: Mission, profile: str) -> Mission:
    """Return the mission with a profile; errors as for `check_profile`."""
    check_profile(profile)
    return mission.model_copy(update={"mission": mission.mission.model_copy(update={"profile": profile})})


def check_profile(profile: str) -> None:
    """Load a profile's class.

    Raises:
        ConfigError: It cannot be loaded.
    """
    if profile not in BUILT_IN_PROFILES:
        from behaviors.profiles.registry import find_profile

        try:
            find_profile(profile)
        except MissionError as error:
            raise ConfigError(str(error)) from None
