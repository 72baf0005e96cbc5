"""The latest messages of the robot about its mission, kept for an assistant that polls."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from typing import Any

from ..web.hub import Hub

LINES = 40
"""Latest lines of a mission that are kept."""
RESULT = ("ending", "achieved", "error", "duration_s", "targets", "hints")
"""The entries of a summary that are passed on."""


class MissionStatusHub(Hub):
    """A hub that also stores the latest mission; all methods may be called from any thread."""

    def __init__(self) -> None:
        super().__init__()
        self._guard = threading.Lock()
        self._mission: dict[str, Any] = {}
        self._lines: deque[str] = deque(maxlen=LINES)
        self.lost = ""
        self.begun = 0
        """Number of missions that have begun."""

    def show(self, kind: str, values: Mapping[str, Any]) -> None:
        """Note whether the brick can be reached."""
        super().show(kind, values)
        if kind == "link":
            self.lost = values["lost"]

    def publish(self, kind: str, values: Mapping[str, Any]) -> None:
        """Keep events of a mission."""
        super().publish(kind, values)
        with self._guard:
            if kind == "run":
                self._mission = {"run": values["folder"], "mission": values["name"], "profile": values["profile"]}
                self._lines.clear()
                self.begun += 1
            elif kind == "ended":
                self._mission["result"] = {key: values[key] for key in RESULT if key in values}
            elif kind in ("line", "problem"):
                self._lines.append(str(values["text"]))

    def mission(self) -> dict[str, Any]:
        """Return the latest mission: its run, name and profile, its lines, and at its end the result."""
        with self._guard:
            return {**self._mission, "lines": list(self._lines)}
