"""Two guests for the stage, for USB and for Bluetooth; each test gets one, everything plugged in, in a fresh world.

A guest whose kernel has failed, or that does not answer, is replaced before the next test.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from xdist.scheduler import LoadScopeScheduling

from nxtdrive.tools.rig import kernel
from nxtdrive.tools.rig.errors import RigError
from nxtdrive.tools.rig.rig import Done, Rig

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MISSION = HERE / "red-mission.toml"
WORLD = str(HERE / "red.toml")
STOP_MM = 700
"""Where the profiles stop before a target at most, from the middle of the axle."""

BRICK = "00:16:53:01:02:03"
BT = f"bt://{BRICK}"
NOBODY = 65534
"""An ordinary user's number."""

COMMAND_S, MISSION_S, WAIT_S = 200.0, 400.0, 120.0
"""Limits: some times what an idle computer of two cores takes that emulates the guest's processor."""

COMMAND = "python -m pytest tests/hil --hil -n 2"

USB, BLUETOOTH = "usb", "bluetooth"
"""The guests: the first has the newest kernel, the second one that bears Bluetooth connections that fail."""

GUEST = {
    "test_commands": USB,
    "test_missions": USB,
    "test_bluetooth": BLUETOOTH,
    "test_pairing": BLUETOOTH,
}
"""The guest that the tests of a file need. Those of other files take the one that is there, so that of two processes
the one that is done first goes on with them."""

LOSES_BLUETOOTH = "loses_bluetooth"
"""Mark of tests in which a Bluetooth connection fails, which may break the kernel: they come last."""


def pytest_configure(config: pytest.Config) -> None:
    """Show each test's name as it runs."""
    config.addinivalue_line("markers", f"{LOSES_BLUETOOTH}: a Bluetooth connection fails, which may break the kernel")
    if config.getoption("--hil"):
        config.option.verbose = max(1, config.option.verbose)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Skip the stage unless it is asked for and this computer can run it; say how."""
    reason = kernel.missing() if config.getoption("--hil") else f"hardware in the loop: {COMMAND}"
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.slow)
            if reason:
                item.add_marker(pytest.mark.skip(reason=reason))
    items.sort(key=lambda item: item.get_closest_marker(LOSES_BLUETOOTH) is not None)


class ByGuest(LoadScopeScheduling):
    """Gives each process the tests of one guest, then files of tests that run on either."""

    def _split_scope(self, nodeid: str) -> str:
        return GUEST.get(_file(nodeid), _file(nodeid))


def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> ByGuest | None:
    """Share the tests out by guest."""
    return ByGuest(config, log) if config.getoption("--hil") else None


def _file(nodeid: str) -> str:
    return Path(nodeid.split("::")[0]).stem


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print how long each test took, with what it waited for its guest."""
    if not config.getoption("--hil"):
        return
    times: dict[str, dict[str, float]] = defaultdict(dict)
    for reports in terminalreporter.stats.values():
        for report in reports:
            if isinstance(report, pytest.TestReport) and report.nodeid.startswith("tests/hil/"):
                times[report.nodeid][report.when] = report.duration
    terminalreporter.section("seconds: guest and world, test")
    for name, phases in sorted(times.items(), key=lambda item: -sum(item[1].values())):
        terminalreporter.line(f"{phases.get('setup', 0):6.1f} {phases.get('call', 0):6.1f}  {name[10:]}")


class Bench:
    """The rig, with what tests need of it."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig

    def run(self, command: str, *, timeout_s: float = COMMAND_S, user: int | None = None) -> Done:
        """Run a command in the guest."""
        return self.rig.run(command, timeout_s=timeout_s, user=user)

    @contextlib.contextmanager
    def during(self, command: str, timeout_s: float = MISSION_S, *, interrupt: bool = False) -> Iterator[list[Done]]:
        """Run a command in the guest while the block does something else; the list has the result after the block.

        With `interrupt`, the command gets a Ctrl-C at the end of the block.
        """
        done: list[Done] = []
        with ThreadPoolExecutor(1) as executor:
            running = executor.submit(self.run, command, timeout_s=timeout_s)
            try:
                yield done
            except AssertionError as error:
                self.run("pkill -INT nxtdrive")
                raise AssertionError(f"{error}\n{running.result()}") from error
            if interrupt:
                self.run("pkill -INT nxtdrive")
            done.append(running.result())

    def until(self, condition: Callable[[dict[str, object]], bool], limit_s: float = WAIT_S) -> None:
        """Wait until the world's truth fulfils the condition."""
        until = time.monotonic() + limit_s
        while not condition(self.rig.truth()):
            assert time.monotonic() < until, f"not after {limit_s:g} s: {self.rig.truth()}"
            time.sleep(0.1)

    def mission(self, profile: str = "adaptive", nxt: str = "usb://", file: str | Path = MISSION) -> str:
        """The command that runs the mission with the webcam, and prints the last record of its journal."""
        run = f"rm -rf runs; nxtdrive run {file} --profile {profile} --nxt {nxt} --camera 0 --no-video --out runs"
        return f"{run}; code=$?; tail -n 1 runs/*/journal.jsonl; exit $code"

    def reached(self) -> bool:
        """Whether the robot stands before what it was to find."""
        truth = self.rig.truth()
        return bool(min(truth["distances_mm"].values()) < STOP_MM and truth["speed_mm_s"] < 1)

    def achieved(self, done: Done) -> None:
        """Check that a mission has succeeded: by exit code, message, journal, and where the robot stands."""
        assert done.code == 0, done.err + done.out
        assert "achieved after" in done.out
        assert json.loads(done.out.splitlines()[-1])["ending"] == "achieved"
        assert self.reached()

    def moving(self) -> None:
        """Wait until the robot drives."""
        self.until(lambda truth: truth["speed_mm_s"] > 20)

    def at_rest(self, limit_s: float = 3.0) -> None:
        """Wait until the robot stands still; by default within the time of a lease and coasting."""
        self.until(lambda truth: truth["speed_mm_s"] < 1, limit_s)

    def lose_brick_and_camera(self) -> None:
        """Unplug the brick from the driving robot, then the camera; plug in each when the robot stands."""
        for device, limit_s in (("usb", 3.0), ("camera", 6.0)):
            self.moving()
            self.rig.fault(unplug=device)
            self.at_rest(limit_s)
            self.rig.plug(device)


class Guests:
    """The rigs that run, by name."""

    def __init__(self) -> None:
        self._rigs: dict[str, Rig] = {}

    def get(self, name: str | None) -> Rig:
        """A rig with everything plugged in, in a fresh world: the one of this name, unless it is broken.

        Without a name any that is there.
        """
        name = name or next(iter(self._rigs), USB)
        if name in self._rigs:
            with contextlib.suppress(RigError):
                if not self._rigs[name].broken:
                    self._rigs[name].reset(WORLD)
                    return self._rigs[name]
            self.end(name)
        avoid = kernel.BROKEN_RFCOMM if name == BLUETOOTH else ()
        self._rigs[name] = Rig.start(WORLD, name=f"hil-{name}", avoid=avoid)
        return self._rigs[name]

    def end(self, name: str) -> None:
        """End a rig."""
        self._rigs.pop(name).stop()

    def end_all(self) -> None:
        """End all."""
        for name in list(self._rigs):
            self.end(name)


@pytest.fixture(scope="session")
def guests() -> Iterator[Guests]:
    """The guests of the stage."""
    guests = Guests()
    yield guests
    guests.end_all()


@pytest.fixture
def bench(request: pytest.FixtureRequest, guests: Guests) -> Iterator[Bench]:
    """The guest of this test."""
    rig = guests.get(GUEST.get(_file(request.node.nodeid)))
    yield Bench(rig)
    if request.node.get_closest_marker(LOSES_BLUETOOTH) and rig.linux in kernel.BROKEN_RFCOMM:
        guests.end(BLUETOOTH)  # no other kernel is to be had, so each such test has a guest of its own


@pytest.fixture
def radio(bench: Bench) -> Bench:
    """The bench with a Bluetooth adapter and the brick in its air."""
    if not bench.rig.bluetooth:
        pytest.skip("no bumble: pip install nxtdrive[hil]")
    return bench
