"""Read a detector's options one by one, so that every mistake has its own message."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

from firmware_protocol.errors import ConfigError
from input_files.plain import at_home

T = TypeVar("T", str, int, float)


class DetectorSpec:
    """The options of one detector.

    Args:
        kind: Kind of the detector, for messages.
        values: The options.
        folder: Where relative paths start.
    """

    def __init__(self, kind: str, values: Mapping[str, object], folder: Path) -> None:
        self.kind = kind
        self._values = dict(values)
        self._folder = folder

    def take(self, name: str, type_: type[T], default: T | None = None) -> T:
        """Remove and return the option `name`.

        Raises:
            ConfigError: The option has another type, or is missing without a default.
        """
        value = self._values.pop(name, default)
        if value is None:
            raise ConfigError(f"the {self.kind} detector needs {name}.", remedy=f"Add {name} to the target.")
        if type_ is float and isinstance(value, int) and not isinstance(value, bool):
            return type_(value)
        if not isinstance(value, type_) or isinstance(value, bool):
            raise ConfigError(
                f"{name} of the {self.kind} detector must be {_KINDS[type_]}, not {value!r}.",
                remedy="Correct the target.",
            )
        return value

    def take_optional(self, name: str) -> str | None:
        """Remove and return the text `name`, or None if it is missing.

        Raises:
            ConfigError: The option is not text.
        """
        if self._values.get(name) is None:
            self._values.pop(name, None)
            return None
        return self.take(name, str)

    def take_paths(self, name: str) -> list[Path]:
        """Remove and return the option `name`, one file or a list of files; whether they exist is not checked.

        Raises:
            ConfigError: The option is missing, empty or of another type.
        """
        value = self._values.pop(name, None)
        names = [value] if isinstance(value, str | Path) else value
        if not isinstance(names, list | tuple) or not names or not all(isinstance(one, str | Path) for one in names):
            raise ConfigError(
                f"the {self.kind} detector needs {name}, a list of files.", remedy=f'{name} = ["lena.png"]'
            )
        return [self.path(one) for one in names]

    def path(self, text: str | Path) -> Path:
        """Resolve a path relative to the folder."""
        return self._folder / at_home(text)

    def finish(self) -> None:
        """Refuse options that have not been taken.

        Raises:
            ConfigError: There are some.
        """
        if self._values:
            names = ", ".join(sorted(self._values))
            raise ConfigError(
                f"the {self.kind} detector has no option {names}.", remedy="Remove it, or check the spelling."
            )


_KINDS: dict[type, str] = {str: "a text", int: "a whole number", float: "a number"}
