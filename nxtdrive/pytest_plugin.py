"""Fixtures for tests of robot programs; pytest finds this plugin automatically where nxtdrive is installed.

`docs/testing-your-robot.md` explains them. Driver and simulation are not imported before a test uses a fixture.
"""

from __future__ import annotations

import os
import signal
import sys
import sysconfig
import threading
from _thread import interrupt_main
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from traceback import walk_stack, walk_tb
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from types import FrameType

    from nxtdrive.brick import Brick
    from nxtdrive.testing import SimWorld

MARKERS = (
    "sim_world(world='empty', *, seed=0, firmware='1.29', latency_ms=2.0, time_limit_s=inf): "
    "the world of this test's simulated brick",
    "real_brick: needs a real brick; skipped without --nxt",
    "real_time_limit(seconds): ends the test, even in a loop that does nothing with the brick",
)
LIBRARY = {"nxtdrive", "behaviors", "sim_backend", "firmware_protocol", "input_files", *sys.stdlib_module_names}
"""Packages whose lines are not those of the program that a test runs."""
INTERRUPT_EVERY_S = 0.5
"""Time between the interrupts of a test over its limit: its program may catch everything."""
MAX_INTERRUPTS = 10
"""A program that catches this many interrupts is ended with the whole test run."""
INSTALLED = tuple(sysconfig.get_paths()[name] for name in ("purelib", "platlib"))


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare ``--nxt``."""
    group = parser.getgroup("nxtdrive", "robot programs on LEGO MINDSTORMS NXT")
    group.addoption("--nxt", metavar="ADDRESS", help="run tests that use nxt_brick on this real brick, such as usb://")


def pytest_configure(config: pytest.Config) -> None:
    """Declare the markers."""
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip tests that need a real brick when there is none."""
    if item.get_closest_marker("real_brick") and not item.config.getoption("--nxt"):
        pytest.skip("needs a real brick: --nxt=ADDRESS")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """End a test at its `real_time_limit`, and say in one sentence where a program exceeded a limit of time."""
    marker = item.get_closest_marker("real_time_limit")
    try:
        with _ended_after(item.config, _limit_s(marker)) if marker else nullcontext():
            return (yield)
    finally:
        world: SimWorld | None = getattr(item, "funcargs", {}).get("sim_world")
        if world and (error := world.overrun) and not _ending():  # even if the program has caught it
            # without its cause, whose sentence pytest would print a second time
            raise pytest.fail.Exception(f"{_place(walk_tb(error.__traceback__))}{error}", pytrace=False) from None


def _limit_s(marker: pytest.Mark) -> float:
    """Return the seconds of a marker `real_time_limit`."""
    given = [*marker.args, *marker.kwargs.values()]
    if len(given) == 1 and marker.kwargs.keys() <= {"seconds"} and isinstance(given[0], int | float) and given[0] > 0:
        return given[0]
    text = "the marker real_time_limit needs a number of seconds above 0, as in real_time_limit(30)."
    raise pytest.fail.Exception(text, pytrace=False)


@contextmanager
def _ended_after(config: pytest.Config, seconds: float) -> Iterator[None]:
    """Fail the test in the main thread if it takes longer in real time; in another thread there is no limit."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    over, done = threading.Event(), threading.Event()
    places: list[str] = []
    still_runs = f"The program still runs after {seconds:g} s"

    def failed() -> BaseException:
        return pytest.fail.Exception(f"{places[0]}{still_runs}. Does your loop ever end?", pytrace=False)

    def interrupted(number: int, frame: FrameType | None) -> None:
        if over.is_set():
            places.append(_place(reversed(list(walk_stack(frame)))))
            raise failed()
        if callable(before):  # Ctrl-C
            before(number, frame)

    def end() -> None:
        wait_s = min(seconds, threading.TIMEOUT_MAX)
        while not done.wait(wait_s):
            over.set()
            if len(places) >= MAX_INTERRUPTS:
                _end_run(config, f"{places[0]}{still_runs} and catches what should end it")
            interrupt_main()
            wait_s = INTERRUPT_EVERY_S

    before = signal.signal(signal.SIGINT, interrupted)
    timer = threading.Thread(target=end, daemon=True)
    timer.start()
    try:
        yield
    finally:
        done.set()
        try:
            timer.join()  # the last interrupt may come here
        finally:
            signal.signal(signal.SIGINT, before)
            if places and not _ending():  # the program may have caught it
                raise failed() from None


def _ending() -> bool:
    """Return whether Ctrl-C or a signal is ending the test run."""
    return isinstance(sys.exc_info()[1], (KeyboardInterrupt, SystemExit))


def _end_run(config: pytest.Config, reason: str) -> None:
    """End this process: a loop that catches every exception cannot be ended otherwise."""
    if capture := config.pluginmanager.getplugin("capturemanager"):
        capture.suspend_global_capture(in_=True)
    print(f"\n{reason}, as `except:` does. The test run ends here.", flush=True)  # noqa: T201
    os._exit(pytest.ExitCode.TESTS_FAILED)


def _place(frames: Iterable[tuple[FrameType, int]]) -> str:
    """Return the innermost line of the tested program or of the test itself, of frames in the order of the calls."""
    place = ""
    for frame, line in frames:
        file = frame.f_code.co_filename
        if frame.f_globals.get("__name__", "").partition(".")[0] not in LIBRARY and not file.startswith(INSTALLED):
            place = f"{Path(file).name}, line {line}: "
    return place


def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> None:
    """End the test run if SIGTERM or SIGHUP has ended a test: pytest takes its `SystemExit` for a failure."""
    if call.excinfo is not None and call.excinfo.errisinstance(SystemExit):
        from nxtdrive.signals import Terminated

        if call.excinfo.errisinstance(Terminated):
            item.session.shouldstop = "a signal has ended the program"


@pytest.fixture
def sim_world(request: pytest.FixtureRequest) -> Iterator[SimWorld]:
    """Provide a simulated robot in its own world, which the test arranges and inspects.

    ``$NXT`` is the address of its brick, so that a program that opens its own brick gets this one. A link that the test
    or the program leaves open is an error.
    """
    from nxtdrive.testing import SimWorld

    marker = request.node.get_closest_marker("sim_world")
    made = _marked(marker) if marker else SimWorld()
    with made, pytest.MonkeyPatch.context() as environment:
        environment.setenv("NXT", made.address)
        yield made
        left_open = made.left_open
        for link in left_open:
            link.close()
    if left_open:
        pytest.fail(
            f"{len(left_open)} link(s) to the simulated brick were left open: close the brick, or use `with`.",
            pytrace=False,
        )


def _marked(marker: pytest.Mark) -> SimWorld:
    """Make the world that a marker describes."""
    from inspect import signature

    from nxtdrive.testing import SimWorld

    arguments = signature(SimWorld)
    try:
        arguments.bind(*marker.args, **marker.kwargs)
    except TypeError as error:
        text = f"the marker sim_world {error}; it is sim_world({', '.join(arguments.parameters)})."
        raise pytest.fail.Exception(text, pytrace=False) from None
    return SimWorld(*marker.args, **marker.kwargs)


@pytest.fixture
def sim_brick(sim_world: SimWorld) -> Iterator[Brick]:
    """Provide the open brick of `sim_world`; afterwards its motors are stopped and it is closed."""
    from nxtdrive.brick import open_brick

    with open_brick(sim_world.address) as brick:
        yield brick


@pytest.fixture
def nxt_brick(request: pytest.FixtureRequest) -> Iterator[Brick]:
    """Provide the simulated brick, or with ``--nxt=ADDRESS`` that real one, for tests that apply to both."""
    from nxtdrive.brick import open_brick

    address = request.config.getoption("--nxt")
    if not address:
        yield request.getfixturevalue("sim_brick")
        return
    if "sim_world" in request.fixturenames:
        pytest.skip("arranges a simulated world, which a real brick is not in")
    with open_brick(address) as brick:
        yield brick
