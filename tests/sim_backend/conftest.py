"""Worlds from a few lines of TOML, and wheels driven by hand."""

import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

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
