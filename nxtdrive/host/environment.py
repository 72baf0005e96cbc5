"""The Python environment that nxtdrive is installed in."""

from __future__ import annotations

import importlib.util
import os
import shlex
import sys
from importlib.machinery import PathFinder
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from firmware_protocol.errors import ConfigError

CHECKOUT = Path(__file__).parents[2]


def install_extra(extra: str) -> str:
    """Return a shell command that installs the requirements of an optional part of nxtdrive, such as ``tui``."""
    try:
        distribution("nxtdrive")
    except PackageNotFoundError:  # run in a checkout without installation, so pip would look for the name elsewhere
        return pip_command("install", f"{CHECKOUT}[{extra}]")
    return pip_command("install", f"nxtdrive[{extra}]")


def require(extra: str, *packages: str, what: str) -> None:
    """Check that the packages of an extra are installed.

    Args:
        extra: Such as ``tui``.
        packages: Names by which they are imported.
        what: What needs them, for the message.

    Raises:
        ConfigError: One is missing.
    """
    if any(importlib.util.find_spec(name) is None for name in packages):
        raise ConfigError(
            f"{what} needs the extra nxtdrive[{extra}], which is not installed.",
            remedy=f"Install it: {install_extra(extra)}",
        )


def pip_command(*words: str) -> str:
    """Return a shell command that runs pip (uv's in an environment of uv) on this environment, for remedies.

    Args:
        words: Such as ``"install", "textual"``.
    """
    if PathFinder.find_spec("pip"):  # importlib.util.find_spec also calls setuptools's hook, which warns
        command = [sys.executable, "-m", "pip", *words]
    elif _made_by_uv():
        command = ["uv", "pip", words[0], "--python", sys.executable, *words[1:]]
    else:  # an environment made --without-pip: the Python that made it has pip
        maker = getattr(sys, "_base_executable", "") or "python3"
        command = [maker, "-m", "pip", "--python", sys.executable, *words]
    if os.name == "nt":
        return " ".join(f'"{word}"' if set(word) & set(" <>&") else word for word in command)
    return shlex.join(command)


def _made_by_uv() -> bool:
    """Whether uv made this environment, by the line that it writes into pyvenv.cfg."""
    file = Path(sys.prefix, "pyvenv.cfg")
    return file.exists() and any(line.split("=")[0].strip() == "uv" for line in file.read_text("utf-8").splitlines())
