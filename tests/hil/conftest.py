"""One guest for the whole stage; each test gets it with brick and webcam plugged in, and the robot at rest."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from nxtdrive.tools.rig import kernel
from nxtdrive.tools.rig.rig import Done, Rig

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MISSION = HERE / "red-mission.toml"
STOP_MM = 700
"""Where the profiles stop before a target at most, from the middle of the axle."""

COMMAND = "python -m pytest tests/hil --hil -n 0"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Skip the stage unless it is asked for and this computer can run it; say how."""
    reason = kernel.missing() if config.getoption("--hil") else f"hardware in the loop: {COMMAND}"
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.slow)
            item.add_marker(pytest.mark.xdist_group("hil"))
            if reason:
                item.add_marker(pytest.mark.skip(reason=reason))


class Bench:
    """The rig, with what tests need of it."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig

    def run(self, command: str, *, timeout_s: float = 60.0, user: int | None = None) -> Done:
        """Run a command in the guest."""
        return self.rig.run(command, timeout_s=timeout_s, user=user)

    @contextlib.contextmanager
    def during(self, command: str, timeout_s: float = 120.0, *, interrupt: bool = False) -> Iterator[list[Done]]:
        """Run a command in the guest while the block does something else; the list has the result after the block.

        With `interrupt`, the command gets a Ctrl-C at the end of the block.
        """
        done: list[Done] = []
        thread = threading.Thread(target=lambda: done.append(self.run(command, timeout_s=timeout_s)))
        thread.start()
        try:
            yield done
        finally:
            if interrupt:
                self.run("pkill -INT nxtdrive")
            thread.join()

    def until(self, condition: Callable[[dict[str, object]], bool], limit_s: float = 60.0) -> None:
        """Wait until the world's truth fulfils the condition."""
        until = time.monotonic() + limit_s
        while not condition(self.rig.truth()):
            assert time.monotonic() < until, f"not after {limit_s:g} s: {self.rig.truth()}"
            time.sleep(0.1)

    def mission(self, profile: str = "adaptive", nxt: str = "usb://", file: str | Path = MISSION) -> str:
        """The command that runs the mission with the webcam."""
        return f"rm -rf runs; nxtdrive run {file} --profile {profile} --nxt {nxt} --camera 0 --no-video --out runs"

    def reached(self) -> bool:
        """Whether the robot stands before the sheet."""
        truth = self.rig.truth()
        return bool(truth["distances_mm"]["red"] < STOP_MM and truth["speed_mm_s"] < 1)

    def moving(self) -> None:
        """Wait until the robot drives."""
        self.until(lambda truth: truth["speed_mm_s"] > 20)

    def at_rest(self, limit_s: float = 3.0) -> None:
        """Wait until the robot stands still; by default within the time of a lease and coasting."""
        self.until(lambda truth: truth["speed_mm_s"] < 1, limit_s)


@pytest.fixture(scope="session")
def rig() -> Iterator[Rig]:
    """The running rig."""
    rig = Rig.start(str(HERE / "red.toml"))
    yield rig
    rig.stop()


@pytest.fixture
def own_bench() -> Iterator[Bench]:
    """A rig of its own, for what may break the guest's kernel."""
    rig = Rig.start(str(HERE / "red.toml"))
    yield Bench(rig)
    rig.stop()


@pytest.fixture
def bench(rig: Rig) -> Bench:
    """The rig with everything plugged in, in a fresh world."""
    rig.reset()
    return Bench(rig)
