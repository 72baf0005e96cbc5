"""Fixtures shared by several parts of the suite.

The suite uses the same plugin as users' suites, also where its entry point is not installed.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Generator, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

from nxtdrive.cli.main import BLAS_THREADS, DONE, USAGE, main

if TYPE_CHECKING:
    from behaviors.mission import Mission

# as `nxtdrive` has it: before numpy is imported, and for the processes that run the tests
os.environ.setdefault(BLAS_THREADS, "1")
# with two of OpenCV's threads a calibration takes a fifth more processor time and no less wall time
os.environ.setdefault("OPENCV_FOR_THREADS_NUM", "1")

# what a shell exports for the developer's own robot, which tests would drive, and for the terminal's width and colours
for _variable in ("NXT", "NXT_ROBOT", "COLUMNS", "LINES", "FORCE_COLOR", "NO_COLOR"):
    os.environ.pop(_variable, None)

pytest_plugins = ["nxtdrive.pytest_plugin", "pytester"]

MAX_PROCESSES = 8
"""Each takes up to 0.7 GB."""

# a deadline is wall time, which tells of the machine and not of the code
settings.register_profile("any machine", deadline=None)
settings.load_profile("any machine")


# a shell starts what it runs in the background with interrupts ignored, which programs inherit
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the switch of the stage that needs a virtual machine."""
    parser.addoption("--hil", action="store_true", help="run tests/hil: hardware in the loop, in a virtual machine")


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One process more than processors for folders, since tests wait for programs that they start.

    None for single files and tests, so that -s and debuggers work there.
    """
    single = any("::" in arg or arg.endswith(".py") for arg in config.args)
    return 0 if single or config.option.capture == "no" else min(MAX_PROCESSES, (os.cpu_count() or 1) + 1)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keep the garbage collector from going through twelve thousand tests again and again, now and while they run."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the groups, which stay in one process each: begun last, they would be waited for.

    Tests for the night are slow too: an `-m` on the command line replaces the one that leaves them out.
    """
    items.sort(key=lambda item: item.get_closest_marker("xdist_group") is None)
    for item in items:
        if item.get_closest_marker("nightly"):
            item.add_marker(pytest.mark.slow)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, which is the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _exit_code(words: Iterable[object]) -> int | str | None:
    try:
        return main([str(word) for word in words])
    except SystemExit as left:  # argparse ends the program for a usage error and for --help
        return left.code


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Runs a command that succeeds; returns its standard output."""

    def run(*words: object) -> str:
        assert _exit_code(words) == DONE
        return capsys.readouterr().out

    return run


@pytest.fixture
def answered(printed: Callable[..., str]) -> Callable[..., Any]:
    """Runs a command with ``--json``, which succeeds; returns its answer as plain values."""
    return lambda *words: json.loads(printed(*words, "--json"))


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Runs a command that is a usage error; returns what it says of it on standard error."""

    def run(*words: object) -> str:
        assert _exit_code(words) == USAGE
        said = capsys.readouterr().err
        assert 0 < len(said) < 12_000
        assert "Traceback" not in said or "-v" in words
        return said

    return run


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts ``nxtdrive`` in a process of its own, in the test's folder; none outlives the test."""
    processes: list[subprocess.Popen[str]] = []
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}

    def start(*words: object) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "nxtdrive", *map(str, words)]
        processes.append(subprocess.Popen(command, cwd=tmp_path, text=True, encoding="utf-8", **pipes))
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.communicate()


@pytest.fixture
def mission_for() -> Callable[..., Mission]:
    """Makes missions for some of the built-in pictures; numbers go into the profile's table."""
    from behaviors.mission import Mission
    from nxtdrive.mission.files import read_mission_file

    def make(*targets: str, profile: str = "thesis", **numbers: object) -> Mission:
        described = read_mission_file(None).target
        return Mission.model_validate(
            {
                "mission": {"name": "test", "targets": list(targets), "profile": profile},
                "target": {name: described[name].model_dump() for name in targets},
                profile: numbers,
            }
        )

    return make
