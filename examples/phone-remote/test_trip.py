"""A phone drives the simulated robot through the page, and the program writes the trip down."""

import asyncio
import csv
import json
import socket
from contextlib import closing

import pytest

from nxtdrive.host.environment import install_extra

try:
    import websockets
    from trip import main, session, watch

    from nxtdrive.mission.files import read_mission_file
    from nxtdrive.tools.web.access import Pin
    from nxtdrive.tools.web.app import Server, serving
    from nxtdrive.tools.web.hub import Hub
    from nxtdrive.tools.web.missions import Missions
    from nxtdrive.tools.web.robot import Robot
    from nxtdrive.tools.web.runs import Runs
    from nxtdrive.transports.address import Address
except ModuleNotFoundError as error:
    pytest.skip(f"{error}. Install what the page needs: {install_extra('web')}", allow_module_level=True)


@pytest.fixture
def page(tmp_path):
    """The address of a page with a simulated robot, and its PIN."""
    hub, pin = Hub(), Pin()
    robot = Robot(Address.parse("sim://open?pace=realtime"), None, read_mission_file(None), hub, tmp_path / "runs")
    server = Server(robot, hub, Missions(tmp_path), Runs(tmp_path / "runs"), "sim://open", pin)
    with closing(socket.create_server(("127.0.0.1", 0))) as listener, closing(robot):
        robot.open()
        with serving(server, listener):
            yield f"127.0.0.1:{listener.getsockname()[1]}", pin.digits


async def _drive_from_a_phone(address, pin):
    async with websockets.connect(
        f"ws://{address}/ws", additional_headers=session(address, pin), max_queue=None
    ) as phone:
        for ahead in (0.0, *[1.0] * 15):
            await phone.send(json.dumps({"type": "drive", "ahead": ahead, "turn": 0.0}))
            await asyncio.sleep(0.05)


def test_the_trip_of_a_phone_is_written_down(page, tmp_path):
    address, pin = page

    async def play():
        await asyncio.gather(watch(tmp_path / "trip.csv", address, pin, rows=12), _drive_from_a_phone(address, pin))

    asyncio.run(play())
    with (tmp_path / "trip.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert "driving" in {row["doing"] for row in rows}
    assert float(rows[-1]["x_mm"]) > 20


def test_a_missing_pin_and_a_missing_page_are_one_sentence(page, tmp_path, monkeypatch):
    address, _ = page
    monkeypatch.setattr("sys.argv", ["trip.py", str(tmp_path / "trip.csv")])
    with pytest.raises(SystemExit, match="needs the PIN"):
        main(address)
    with closing(socket.create_server(("127.0.0.1", 0))) as unused:
        nowhere = f"127.0.0.1:{unused.getsockname()[1]}"
    with pytest.raises(SystemExit, match="Nothing answers"):
        main(nowhere)
