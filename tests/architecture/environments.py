"""Environments without nxtdrive, in which tests install it."""

from __future__ import annotations

import subprocess
import sys
import sysconfig
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("firmware_protocol", "input_files", "nxtdrive", "behaviors", "sim_backend")


def make_environment(home: Path) -> Path:
    """Make a virtual environment with everything the suite's environment has, except nxtdrive.

    Returns:
        Its folder of packages.
    """
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", home], check=True, timeout=60)
    (packages,) = home.glob("lib/python*/site-packages")
    for folder in {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}:
        for entry in Path(folder).iterdir():
            if not entry.name.startswith((*PACKAGES, "tools", "__editable__")):
                (packages / entry.name).symlink_to(entry)
    return packages


def python_of(home: Path) -> Path:
    """Return the interpreter of a virtual environment."""
    return home / "bin" / "python"
