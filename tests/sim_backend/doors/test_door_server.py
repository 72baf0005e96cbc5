"""The real-time loop on a clock of its own: it follows the wall clock, never rushes, and renders only for viewers."""

from collections import deque

import pytest

from sim_backend.doors.server import LATE_LIMIT_MS, LONGEST_STEP_MS, RealTimeServer
from sim_backend.doors.switchboard import Switchboard
from sim_backend.link import SimLink
from sim_backend.simulation import Simulation

GET_BATTERY = bytes.fromhex("00 0b")
GET_DEVICE_INFO = bytes.fromhex("01 9b")
SET_SWITCH = bytes.fromhex("00 05 00 01 20")


class _Mailbox:
    """A program without a socket, and the door it came through."""

    address = name = "mailbox"
    bluetooth = at_end = closed = False

    def __init__(self):
        self.incoming = deque()
        self.replies = []
        self.here = False

    def accept(self):
        new, self.here = not self.here, True
        return [self] if new else []

    def receive(self):
        arrived = list(self.incoming)
        self.incoming.clear()
        return arrived

    def send(self, data):
        self.replies.append(data)

    def disconnect(self):
        self.closed = True

    def fileno(self):
        return 0


class _Audience:
    """A camera door, watched or not."""

    def __init__(self):
        self.watched = False
        self.shown = []

    def show(self, image):
        self.shown.append(image)


@pytest.fixture
def simulation():
    return Simulation("open", camera_size=(64, 48))


@pytest.fixture
def door():
    return _Mailbox()


@pytest.fixture
def audience():
    return _Audience()


@pytest.fixture
def server(simulation, door, audience, wall):
    switchboard = Switchboard([door], lambda bluetooth: SimLink(simulation, bluetooth=bluetooth))
    return RealTimeServer(simulation, switchboard, [audience], fps=10, now=wall.now, wait=wall.wait)


def _run_for(server, wall, duration_s):
    """Serve until the wall clock has gone on by this much; the statuses reported meanwhile."""
    statuses = []
    end_s = wall.now_s + duration_s
    server.run(lambda: wall.now_s >= end_s, statuses.append)
    return statuses


def test_simulated_time_follows_the_wall(server, wall, simulation):
    statuses = _run_for(server, wall, 3.0)
    assert simulation.now_ms == pytest.approx(3000, abs=20)
    assert [status.real_time_factor for status in statuses] == pytest.approx([1.0] * len(statuses), abs=0.03)
    assert len(statuses) in (2, 3)


def test_telegrams_are_answered_and_counted(server, wall, door):
    door.incoming += [GET_BATTERY] * 5
    _run_for(server, wall, 0.1)
    assert [reply[:3] for reply in door.replies] == [bytes.fromhex("02 0b 00")] * 5
    assert server.status().telegrams == 5


def test_a_slow_computer_makes_slow_motion_and_says_so(server, wall, simulation):
    wall.extra_s = 0.2
    statuses = _run_for(server, wall, 10.0)
    assert simulation.now_ms < 2000
    assert statuses[-1].real_time_factor == pytest.approx(LONGEST_STEP_MS / 1000 / 0.2, rel=0.1)


def test_lost_time_is_not_made_up_for(server, wall, simulation):
    wall.extra_s = 0.5
    _run_for(server, wall, 5.0)
    wall.extra_s = 0.0
    before_ms = simulation.now_ms
    _run_for(server, wall, 1.0)
    assert simulation.now_ms - before_ms <= 1000 + LATE_LIMIT_MS + LONGEST_STEP_MS


def test_the_brick_answers_between_the_steps_of_a_late_simulation(server, wall, door):
    wall.extra_s = 0.2
    door.incoming.append(GET_BATTERY)
    _run_for(server, wall, 0.7)
    assert len(door.replies) == 1


def test_nothing_is_filmed_without_an_audience(server, wall, audience):
    _run_for(server, wall, 2.0)
    assert audience.shown == []
    assert server.status().frames_per_s == 0


def test_an_audience_gets_the_cameras_rate_and_no_backlog(server, wall, audience):
    _run_for(server, wall, 2.0)
    audience.watched = True
    _run_for(server, wall, 1.0)
    assert len(audience.shown) in (10, 11)
    assert audience.shown[0].shape == (48, 64, 3)


def test_an_unplugged_camera_shows_nothing(server, wall, audience, simulation):
    audience.watched = True
    simulation.webcam.unplugged_ms = ((0, 10_000),)
    _run_for(server, wall, 1.0)
    assert audience.shown == []


class _DefectiveSensor:
    """An analog sensor that fails while a program asks for it."""

    defective = True

    def raw(self):
        if self.defective:
            raise ZeroDivisionError("a defect")
        return 512


def test_a_defect_of_the_brick_is_logged_once_per_telegram_and_ends_nothing(server, wall, door, simulation, caplog):
    sensor = _DefectiveSensor()
    simulation.brick.attach_sensor(1, sensor)
    door.incoming.append(SET_SWITCH)
    _run_for(server, wall, 0.5)
    assert server.failures > 1
    assert [record.getMessage() for record in caplog.records] == [
        "the simulated brick failed; its last telegram was 0005000120"
    ]
    assert simulation.now_ms == pytest.approx(500, abs=20)
    sensor.defective = False
    door.incoming.append(GET_BATTERY)
    _run_for(server, wall, 0.1)
    assert [reply[:3].hex() for reply in door.replies] == ["020500", "020b00"]


def test_a_telegram_that_fails_is_not_answered_and_the_next_one_is(server, wall, door, simulation, caplog):
    simulation.brick.radio.name = None  # no telegram does that; it stands for a defect
    door.incoming += [GET_DEVICE_INFO, GET_BATTERY]
    _run_for(server, wall, 0.1)
    assert [reply[:3].hex() for reply in door.replies] == ["020b00"]
    assert server.failures == len(caplog.records) == 1
