"""Environments without nxtdrive, in which tests install it."""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("firmware_protocol", "input_files", "nxtdrive", "behaviors", "sim_backend")
FILES = ("pyproject.toml", "README.md", "LICENSE")


def copy_sources(to: Path) -> Path:
    """Copy what is published into a folder, and return that."""
    for name in (*PACKAGES, "tools"):
        shutil.copytree(ROOT / name, to / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in FILES:
        shutil.copy(ROOT / name, to)
    return to


def make_environment(home: Path) -> Path:
    """Make a virtual environment with everything the suite's environment has, except nxtdrive.

    Returns:
        Its folder of packages.
    """
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", home], check=True, timeout=60)
    (packages,) = home.glob("lib/python*/site-packages")
    for folder in {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}:
        for entry in Path(folder).iterdir():
            if not entry.name.startswith((*PACKAGES, "_nxtdrive")):
                (packages / entry.name).symlink_to(entry)
    return packages


def python_of(home: Path) -> Path:
    """Return the interpreter of a virtual environment."""
    return home / "bin" / "python"
