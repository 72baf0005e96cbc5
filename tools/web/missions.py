"""The missions a page can start and edit: the built-in one and the files of a folder."""

from __future__ import annotations

import hashlib
import re
import threading
from pathlib import Path

from behaviors.mission import Mission
from behaviors.profile_names import offered_profile
from firmware_protocol.errors import ConfigError
from input_files.mistakes import excerpt
from input_files.plain import InputFileError, read_bytes, read_text
from input_files.toml_file import MAX_BYTES, parse_toml
from nxtdrive.mission.checking import Findings, check_mission
from nxtdrive.mission.files import read_mission_file, with_profile
from nxtdrive.recording.output_file import draft

NAME = re.compile(r"\w[\w .-]*\.toml")
LONGEST_NAME = 255
"""Bytes, by the limit of most file systems."""
DEVICES = frozenset(
    {"con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(10))}
)
"""Names that no file and no folder can have on Windows, whatever follows a dot."""


class Conflict(ValueError):
    """The file is not what it was when it was opened; nothing has been written."""


class Missions:
    """Mission files by name.

    Args:
        folder: Its ``*.toml`` files are offered.
        robot: The robot file; by default the one that a mission names.
        default: The robot file if neither is given; by default ``$NXT_ROBOT``.
        mission: The file that the server was started with, if any.

    Attributes:
        folder: As above.
        proposed: The name of `mission`; empty for the built-in one, and if it is not among those of the folder.
    """

    def __init__(
        self, folder: Path, robot: Path | None = None, default: Path | None = None, mission: Path | None = None
    ) -> None:
        self.folder = folder
        here = mission is not None and mission.parent.resolve() == folder.resolve() and mission.name in self.names()
        self.proposed = mission.name if mission and here else ""
        self._robot, self._default = robot, default
        self._saving = threading.Lock()

    def use(self, robot: Path) -> None:
        """Load missions with another robot file from now on."""
        self._robot = robot

    def names(self) -> list[str]:
        """Return the names of the files, sorted; the built-in mission is the empty name and not among them."""
        return sorted(path.name for path in self.folder.glob("*.toml") if _is_mission(path))

    def file(self, name: str) -> Path | None:
        """Return the path of a mission; None for the built-in one."""
        return self.folder / name if name else None

    def load(self, name: str, profile: str | None = None) -> Mission:
        """Read a mission.

        Args:
            name: Its file; empty for the built-in one.
            profile: A built-in or an installed profile; None for the mission's own.

        Raises:
            ValueError: There is none of this name, or it has mistakes; the text lists all of them. Or there is no such
                profile.
        """
        if name and name not in self.names():
            raise ValueError(f"There is no mission {name!r} in the folder {self.folder.resolve().name!r}.")
        try:
            mission = read_mission_file(self.file(name), self._robot, self._default)
            if profile in (None, mission.mission.profile):
                return mission
            return with_profile(mission, offered_profile(profile))
        except ConfigError as error:
            raise ValueError(str(error)) from None

    def read(self, name: str) -> tuple[str, str]:
        """Return the text of a mission file and its version, which `save` asks for.

        Raises:
            KeyError: There is none of this name.
        """
        if name not in self.names():
            raise KeyError(name)
        content = read_bytes(self.folder / name, MAX_BYTES)
        return content.decode(), _version(content)

    def check(self, text: str) -> Findings:
        """Check a text as ``nxtdrive mission check`` checks it as a file of the folder, but do not load its profile.

        Raises:
            OSError: The folder cannot be written.
        """
        beside = self.folder / "mission.toml"  # the missions' pictures lie there
        with draft(beside, text.encode()) as file:
            found = check_mission(file, self._robot, self._default)
        found.mistakes = [mistake.replace(str(file), "The text") for mistake in found.mistakes]
        return found

    def save(self, name: str, text: str, version: str) -> str:
        """Write a mission file, as a whole or not at all, even with mistakes; return its new version.

        Args:
            name: Of the file.
            text: Its new content.
            version: As `read` returned it; empty for a new file.

        Raises:
            Conflict: The file has changed or is gone, or a new one exists already.
            ValueError: The name is not that of a mission file, the file is larger than a mission's, or the text names a
                class as its profile that the file did not: to start the mission would run that class's module.
            OSError: It cannot be written.
        """
        if not NAME.fullmatch(name) or is_device(name) or len(name.encode()) > LONGEST_NAME:
            raise ValueError(
                f"{excerpt(name)} is not a valid mission file name. Use letters and digits, not too many of them, and "
                "end it in .toml."
            )
        path, content = self.folder / name, text.encode()
        with self._saving, draft(path, content) as file:
            before = read_bytes(path, MAX_BYTES) if path.exists() else b""
            if (_version(before) if path.exists() else "") != version:
                reason = "has changed on the disk since it was opened" if version else "exists already"
                raise Conflict(f"{name} {reason}. Nothing was saved: open it again, or choose another name.")
            if (chosen := _profile_class(content)) and chosen != _profile_class(before):
                raise ValueError(
                    f"profile = {excerpt(chosen)} runs a module of the computer that serves this page. Write it into "
                    "the file there, or choose a profile of the list."
                )
            file.replace(path)
        return _version(content)


def is_device(name: str) -> bool:
    """Return whether Windows takes the name of a file or folder for that of a device."""
    return name.partition(".")[0].casefold() in DEVICES


def _profile_class(content: bytes) -> str:
    """Return the class that a mission file names as its profile; empty if it names none, or cannot be read."""
    try:
        mission = parse_toml(content.decode("utf-8-sig")).get("mission")  # the file is also read without its BOM
    except ValueError:
        return ""
    profile = str(mission.get("profile", "")) if isinstance(mission, dict) else ""
    return profile if ":" in profile else ""


def _version(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _is_mission(path: Path) -> bool:
    try:
        return path.name.isprintable() and path.name[0] != "." and "[mission]" in read_text(path, MAX_BYTES)
    except InputFileError:
        return False
