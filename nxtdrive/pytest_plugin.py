"""Fixtures for tests of robot programs; pytest finds this plugin by itself where nxtdrive is installed.

`docs/testing-your-robot.md` explains them. Driver and simulation are not imported before a test uses a fixture.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.testing import SimWorld

MARKERS = (
    "sim_world(world='empty', *, seed=0, firmware='1.29', latency_ms=2.0, time_limit_s=inf): "
    "the world of this test's simulated brick",
    "real_brick: needs a real brick; skipped without --nxt",
)


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


def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> None:
    """End the test run if SIGTERM or SIGHUP has ended a test: pytest takes its `SystemExit` for a failure."""
    if call.excinfo is not None and call.excinfo.errisinstance(SystemExit):
        from nxtdrive.signals import Terminated

        if call.excinfo.errisinstance(Terminated):
            item.session.shouldstop = "a signal has ended the program"


@pytest.fixture
def sim_world(request: pytest.FixtureRequest) -> Iterator[SimWorld]:
    """Provide a simulated robot in its own world, which the test arranges and inspects.

    ``$NXT`` leads to its brick, so that a program that opens its brick by itself finds this one. A link that the test
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
        pytest.fail(f"the marker sim_world {error}; it is sim_world({', '.join(arguments.parameters)}).", pytrace=False)
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
