"""One robot of a classroom: it is opened again, replaced while its brick is lost, and stays stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from firmware_protocol.errors import BrickNotFound
from nxtdrive.mission.files import read_mission_file
from nxtdrive.tools.web.classroom.config import RobotEntry
from nxtdrive.tools.web.classroom.station import Station
from nxtdrive.tools.web.missions import Missions
from nxtdrive.transports.address import Address
from nxtdrive.transports.sim import SimTransport, shared
from tests.waiting import until

SIMULATED = Address("sim", "open", {"pace": "realtime"})


class Cable:
    """Where a brick is plugged in or not."""

    def __init__(self) -> None:
        self.plugged = False
        self.broken = False
        self.transport: SimTransport | None = None

    def open(self) -> SimTransport:
        if self.broken:
            raise RuntimeError("a defect")
        if not self.plugged:
            raise BrickNotFound("no brick answers there.", remedy="Plug it in.")
        self.transport = SimTransport.open(SIMULATED)
        return self.transport


@pytest.fixture
def cable() -> Iterator[Cable]:
    cable = Cable()
    with shared("ada", cable.open):
        yield cable


@pytest.fixture
def station_for(tmp_path) -> Iterator[Callable[[RobotEntry], Station]]:
    opened = []

    def make(entry: RobotEntry) -> Station:
        folder = Path(tmp_path)
        station = Station(
            entry, read_mission_file(None), Missions(folder), folder / entry.name, retry_s=0.01, fall_back_after_s=0.0
        )
        opened.append(station)
        station.open()
        return station

    yield make
    for station in opened:
        station.close()


def _real(*, stand_in: Address | None = None) -> RobotEntry:
    return RobotEntry("Ada", "#c4161c", Address("sim", "@ada"), "sim", stand_in=stand_in)


def test_a_robot_that_cannot_be_opened_says_why_and_is_opened_when_it_can_be(cable, station_for):
    station = station_for(_real())
    until(lambda: "Plug it in" in station.tile()["trouble"])
    with pytest.raises(ValueError, match="Plug it in"):
        station.start("", None)
    cable.plugged = True
    until(lambda: station.tile()["open"])
    assert not station.tile()["trouble"]


def test_a_defect_while_it_is_opened_is_shown_and_the_robot_is_opened_again(cable, station_for):
    cable.plugged = cable.broken = True
    station = station_for(_real())
    until(lambda: "a defect" in station.tile()["trouble"])
    cable.broken = False
    until(lambda: station.tile()["open"])


def test_a_simulated_robot_replaces_a_brick_until_a_person_reconnects_it(cable, station_for):
    station = station_for(_real(stand_in=SIMULATED))
    until(lambda: station.tile()["open"])
    assert station.tile()["brick"] == "stand-in"
    assert "Plug it in" in station.tile()["trouble"]
    station.return_to_brick()
    until(lambda: not station.tile()["open"])
    until(lambda: station.tile()["open"])
    assert station.tile()["brick"] == "stand-in"
    cable.plugged = True
    station.return_to_brick()
    until(lambda: station.tile()["brick"] == "sim" and station.tile()["open"])
    assert not station.tile()["trouble"]
    with pytest.raises(ValueError, match="No simulated robot"):
        station.return_to_brick()


@pytest.mark.slow
def test_a_brick_that_is_lost_is_replaced(cable, station_for):
    cable.plugged = True
    station = station_for(_real(stand_in=SIMULATED))
    until(lambda: station.tile()["open"] and cable.transport)
    cable.plugged = False
    cable.transport.close()
    until(lambda: station.tile()["brick"] == "stand-in" and station.tile()["open"])
    assert station.tile()["trouble"]


def test_a_stop_holds_while_it_is_opened_replaced_and_brought_back(cable, station_for):
    station = station_for(_real(stand_in=SIMULATED))
    station.stop()
    until(lambda: station.tile()["open"])
    assert station.stopped
    with pytest.raises(ValueError, match="stopped"):
        station.start("", None)
    cable.plugged = True
    station.return_to_brick()
    until(lambda: station.tile()["brick"] == "sim" and station.tile()["open"])
    assert station.stopped
    station.release()
    assert not station.tile()["stopped"]


def test_it_beeps_when_it_is_open(cable, station_for):
    station = station_for(_real())
    with pytest.raises(ValueError, match="not open"):
        station.beep()
    cable.plugged = True
    until(lambda: station.tile()["open"])
    sound = cable.transport.simulation.brick.sound
    station.beep()
    until(lambda: sound.tone)
