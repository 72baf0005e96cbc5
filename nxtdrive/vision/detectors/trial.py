"""Try a file in a process of its own: a damaged one can crash, exhaust or stop the library that loads it."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

MAX_MEMORY = 4_000_000_000
"""Address space of the process, bytes."""


def run_trial(program: Path, *words: str, limit_s: float) -> subprocess.CompletedProcess[bytes] | None:
    """Run a program of this package in a process of its own; return how it ended, None after `limit_s`."""
    # -P: the folder of the program is not a place for modules
    command = [sys.executable, "-P", str(program), *words]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        return subprocess.run(command, check=False, capture_output=True, timeout=limit_s, env=environment)  # noqa: S603 - our own
    except subprocess.TimeoutExpired:
        return None


def limit_this_process() -> None:
    """Limit the calling process to `MAX_MEMORY`, without core dumps; no effect on Windows.

    macOS refuses a limit below what a process has mapped, hundreds of gigabytes on Apple's processors.
    """
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    most = MAX_MEMORY if hard == resource.RLIM_INFINITY else min(MAX_MEMORY, hard)
    with suppress(ValueError):
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))
