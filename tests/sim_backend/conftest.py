"""Worlds from a few lines of TOML, wheels driven by hand, and a brick that is read in each pass."""

import itertools
import tomllib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from sim_backend.world.loading import parse_world
from sim_backend.world.world import STEP_MS, World
from sim_backend.world.world_file import WorldFile

EMPTY_ROOM = """
[floor]
size_mm = [4000, 3000]
[robot]
start_mm = [1000, 1500]
motor_mismatch_percent = 0
slip = { jitter_percent = 0 }
"""


@pytest.fixture
def world_file(tmp_path: Path) -> Callable[..., WorldFile]:
    """Makes a world file: an empty room of 4 x 3 m with an exact robot at (1000, 1500), and what `extra` adds."""

    def make(extra: str = "", base: str = EMPTY_ROOM) -> WorldFile:
        return parse_world(tomllib.loads(base + extra), tmp_path / "test.toml")

    return make


@pytest.fixture
def world(world_file: Callable[..., WorldFile]) -> Callable[..., World]:
    """Makes a world in the same way."""

    def make(extra: str = "", base: str = EMPTY_ROOM, seed: int = 0) -> World:
        return World(world_file(extra, base), seed)

    return make


@pytest.fixture(scope="session")
def red(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The path of a picture that is all red, which can be found again in a frame."""
    path = str(tmp_path_factory.mktemp("colors") / "red.png")
    cv2.imwrite(path, np.full((64, 64, 3), (0, 0, 255), np.uint8))
    return path


@pytest.fixture
def drive() -> Callable[..., None]:
    """Runs a world for some time with given PWM on the wheels, brakes on."""

    def run(world: World, duration_ms: int, left: int = 0, right: int = 0) -> None:
        for ms in range(1, duration_ms + 1):
            world.robot.left.step(left, True)
            world.robot.right.step(right, True)
            if ms % STEP_MS == 0:
                world.step()

    return run


@pytest.fixture
def seen_in_passes() -> Callable[..., str]:
    """Tells what is read in each pass, like `expected`: `60*2 8007` means 60 in two passes, and then 8007 in one.

    The lines of `then`, by their passes, come in front of the reading; `setup` comes before all.
    """

    def see(setup: list[str], then: dict[int, str], read: str, expected: str, firmware: str = "1.29") -> str:
        bench = Bench(SimBrick(firmware=firmware))
        for line in setup:
            bench.answer(line)
        seen = []
        for number in range(sum(int(run.partition("*")[2] or 1) for run in expected.split())):
            if number in then:
                bench.answer(then[number])
            seen.append(bench.answer(read)[18:])
        runs = [(value, len(list(group))) for value, group in itertools.groupby(seen)]
        return " ".join(value + f"*{times}" * (times > 1) for value, times in runs)

    return see
