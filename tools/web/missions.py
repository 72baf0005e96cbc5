"""The missions a page can start: the built-in one and the files of a folder."""

from __future__ import annotations

from pathlib import Path

from behaviors.mission import Mission
from firmware_protocol.errors import ConfigError
from nxtdrive.mission import setup


class Missions:
    """Mission files by name.

    Args:
        folder: Its ``*.toml`` files are offered.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def names(self) -> list[str]:
        """Return the names of the files, sorted; the built-in mission is the empty name and not among them."""
        return sorted(path.name for path in self._folder.glob("*.toml") if _is_mission(path))

    def load(self, name: str, profile: str | None = None) -> Mission:
        """Read a mission.

        Raises:
            ValueError: There is none of this name, or it has mistakes; the text lists all of them.
        """
        if name and name not in self.names():
            raise ValueError(f"There is no mission {name!r} here.")
        try:
            mission = setup.load(self._folder / name if name else None)
        except ConfigError as error:
            raise ValueError(str(error)) from None
        if profile is None:
            return mission
        table = mission.mission.model_copy(update={"profile": profile})
        return mission.model_copy(update={"mission": table})


def _is_mission(path: Path) -> bool:
    try:
        return "[mission]" in path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False
