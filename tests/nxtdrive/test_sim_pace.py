"""A simulation in real time, on a wall clock of the test's own."""

from types import SimpleNamespace

import pytest

from nxtdrive.cli.pace import in_real_time
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation


@pytest.fixture
def wall(monkeypatch):
    """The wall clock; `wall.s` is its time, and sleeping only moves its hands."""
    clock = SimpleNamespace(s=100.0)

    def sleep(duration_s):
        clock.s += duration_s

    monkeypatch.setattr("nxtdrive.transports.sim.time", SimpleNamespace(monotonic=lambda: clock.s, sleep=sleep))
    return clock


def test_a_simulated_second_takes_a_real_one(wall):
    transport = SimTransport(Simulation("empty"), realtime=True)
    for _ in range(5):
        transport.sleep(1.0)
    assert wall.s == pytest.approx(105.0)


def test_a_short_delay_is_made_up_for(wall):
    transport = SimTransport(Simulation("empty"), realtime=True)
    wall.s += 0.5
    transport.sleep(1.0)
    assert wall.s == pytest.approx(101.0)


def test_after_a_long_absence_the_simulation_makes_no_haste(wall):
    transport = SimTransport(Simulation("empty"), realtime=True)
    wall.s += 60.0  # the operator thinks
    transport.sleep(0.1)
    began_s = wall.s
    transport.sleep(2.0)
    assert wall.s - began_s == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("address", "paced"),
    [
        ("sim://", "sim://?pace=realtime"),
        ("sim://open?seed=7", "sim://open?seed=7&pace=realtime"),
        ("sim://open?pace=fast", "sim://open?pace=fast"),
        ("usb://", "usb://"),
        ("record://t.nxttrace?nxt=sim%3A//open", "record://t.nxttrace?nxt=sim%3A%2F%2Fopen%3Fpace%3Drealtime"),
    ],
)
def test_commands_that_drive_by_hand_watch_or_serve_have_real_time_unless_a_pace_is_named_traced_or_not(address, paced):
    assert str(in_real_time(address)) == paced
