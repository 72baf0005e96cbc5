"""The Python environment that nxtdrive is installed in."""

from __future__ import annotations

import os
import shlex
import sys
from importlib.util import find_spec


def pip_command(*words: str) -> str:
    """Return a shell command that runs pip on this environment, for remedies; pip need not be installed in it.

    Args:
        words: Such as ``"install", "nxtdrive[tui]"``.
    """
    if find_spec("pip"):
        command = [sys.executable, "-m", "pip", *words]
    else:  # of an environment made --without-pip: the Python that made it has pip
        maker = getattr(sys, "_base_executable", "") or "python3"
        command = [maker, "-m", "pip", "--python", sys.executable, *words]
    if os.name == "nt":
        return " ".join(f'"{word}"' if set(word) & set(" <>&") else word for word in command)
    return shlex.join(command)
