"""A program that sleeps on the wall clock while its simulated robot moves is warned once, any other is not."""

import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from nxtdrive.brick import Brick
from nxtdrive.transports.sim import SimTransport
from nxtdrive.transports.sleep_warning import SleepWarning, Usage
from sim_backend.simulation import Simulation

SLEEP = Usage(wall_s=0.15, busy_s=0.001, waits=1, preempted=0)


class _Program:
    """A program that calls the simulation, and what it uses in between."""

    def __init__(self):
        self._total = Usage(100.0, 10.0, 500, 20)
        self._warning = SleepWarning(lambda: self._total)

    def warnings_of(self, pauses, *, moving=True):
        """Return the texts of the warnings while the program pauses as given between its calls."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            for pause in pauses:
                self._warning.leave()
                self._total = Usage(*(total + part for total, part in zip(self._total, pause, strict=True)))
                self._warning.enter(lambda: moving)
        return [str(warning.message) for warning in caught]


def test_a_program_that_sleeps_while_the_robot_moves_is_warned_once():
    program = _Program()
    assert program.warnings_of([SLEEP]) == [], "one short sleep does no harm"
    (text,) = program.warnings_of([SLEEP] * 9)
    assert "use brick.sleep() instead of time.sleep()" in text
    assert program.warnings_of([SLEEP] * 9) == []


def test_a_sleep_while_the_robot_stands_is_no_mistake():
    program = _Program()
    assert program.warnings_of([SLEEP] * 9, moving=False) == []
    assert len(program.warnings_of([SLEEP] * 9)) == 1


@pytest.mark.parametrize(
    "pause",
    [
        pytest.param(SLEEP._replace(busy_s=0.1), id="computes"),
        pytest.param(SLEEP._replace(waits=0), id="computes in C"),
        pytest.param(SLEEP._replace(waits=12), id="waits for a library's threads"),
        pytest.param(SLEEP._replace(preempted=1), id="loaded machine"),
        pytest.param(SLEEP._replace(wall_s=0.01, busy_s=0.0), id="calls at once"),
        pytest.param(Usage(0.0, 0.0, 0, 0), id="system without the counters"),
    ],
)
def test_a_pause_that_need_not_be_a_sleep_is_not_warned_of(pause):
    assert _Program().warnings_of([pause] * 99) == []


def test_a_motor_moves_from_its_command_on():
    """A program that sleeps right after `run` is warned, although the regulator gives no power for 100 ms."""
    simulation = Simulation("open")
    with Brick(SimTransport(simulation)) as brick:
        motor = brick.motor("A")
        motor.run(300)
        assert simulation.motors_turn()
        motor.stop()
        brick.sleep(0.1)
        assert not simulation.motors_turn()


# Another program can take the processor during a sleep, which then does not count: it sleeps until it is warned.
SLEEPER = """
import time
from nxtdrive.brick import Brick
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation

with Brick({transport}) as brick:
    brick.motor("A").run(300)
    brick.sleep(0.5)
    for _ in range({sleeps}):
        time.sleep(0.15)
        assert brick.battery_v
"""


def _run(transport, sleeps):
    program = SLEEPER.format(transport=transport, sleeps=sleeps)
    arguments = [sys.executable, "-W", "error:the program sleeps", "-c", program]
    checkout = Path(__file__).parents[2]
    return subprocess.run(arguments, cwd=checkout, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="no other system counts a thread's waits")
def test_a_real_program_is_warned():
    ended = _run('SimTransport(Simulation("open"))', 100)
    assert "use brick.sleep() instead of time.sleep()" in ended.stderr


@pytest.mark.slow
def test_a_real_program_that_disabled_warnings_gets_none_after_a_reconnection_either():
    ended = _run('SimTransport(Simulation("open"), warn_of_sleep=False).reopen()', 5)
    assert (ended.returncode, ended.stderr) == (0, "")
