"""The tools of `nxtdrive mcp` by the protocol's own client, on the simulated robot."""

from __future__ import annotations

import json
import threading
from base64 import b64decode
from collections.abc import Awaitable, Callable, Iterator
from contextlib import closing, contextmanager
from itertools import cycle
from pathlib import Path
from typing import Any

import anyio
import cv2
import numpy as np
import pytest
from mcp.client.client import Client
from mcp.shared.exceptions import MCPError

from nxtdrive.mission.camera import GEOMETRIC
from nxtdrive.mission.files import read_mission_file
from nxtdrive.tools.mcp.assistant import Assistant
from nxtdrive.tools.mcp.mission_status import MissionStatusHub
from nxtdrive.tools.mcp.server import make_server
from nxtdrive.tools.web.hub import Hub
from nxtdrive.tools.web.mission_run import ShownMission
from nxtdrive.tools.web.missions import Missions
from nxtdrive.tools.web.robot import Robot
from nxtdrive.transports.address import Address

QUICK = '[mission]\nname = "quick"\ntargets = ["lena"]\n[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'

Call = Callable[..., Awaitable[Any]]


@contextmanager
def _robot(folder: Path, address: str, camera: str | None = None, mission: Path | None = None) -> Iterator[Assistant]:
    status_hub = MissionStatusHub()
    robot = Robot(Address.parse(address), camera, read_mission_file(mission), status_hub, folder / "runs")
    with closing(robot):
        robot.open()
        yield Assistant(robot, status_hub, Missions(folder), folder / "runs", max_mm=1000.0)


@pytest.fixture
def fast(tmp_path):
    with _robot(tmp_path, "sim://open?pace=fast") as assistant:
        yield assistant


@pytest.fixture
def quick(tmp_path):
    """A robot that finds its targets by geometry and renders no frames."""
    with _robot(tmp_path, "sim://open?pace=fast", GEOMETRIC) as assistant:
        yield assistant


@pytest.fixture
def slow(tmp_path):
    """A robot in real time, which a test can break in on."""
    with _robot(tmp_path, "sim://open?pace=realtime") as assistant:
        yield assistant


def _converse(assistant: Assistant, talk: Callable[[Call], Awaitable[None]], mode: str = "auto") -> None:
    """Let a client of the protocol talk with the server."""

    async def converse() -> None:
        async with Client(make_server(assistant), mode=mode) as client:

            async def call(name: str, **arguments: Any) -> Any:
                result = await client.call_tool(name, arguments)
                text = result.content[0]
                if result.is_error:
                    return text.text
                return text if text.type == "image" else json.loads(text.text)

            await talk(call)

    anyio.run(converse)


async def _moving(assistant: Assistant) -> None:
    with anyio.fail_after(30):
        while assistant.robot.state.get("doing") != "at rest":
            await anyio.sleep(0.01)
        while not assistant.robot.busy:
            await anyio.sleep(0.01)


def test_the_status_after_a_motion_is_not_that_before_it(fast):
    async def talk(call: Call) -> None:
        for angle_deg in (90, -90, 90):
            turned = await call("turn", angle_deg=angle_deg)
            status = await call("mission_status")
            assert status["robot"]["pose"]["heading_deg"] == pytest.approx(turned["pose"]["heading_deg"], abs=2)

    _converse(fast, talk)


def test_it_looks_where_targets_are_found_by_geometry(quick):
    async def talk(call: Call) -> None:
        picture = await call("look")
        assert picture.mime_type == "image/jpeg"

    _converse(quick, talk)


@pytest.mark.parametrize("mode", ["auto", "legacy"])
def test_it_looks_drives_and_reads_the_sensors(fast, mode):
    async def talk(call: Call) -> None:
        picture = await call("look")
        image = cv2.imdecode(np.frombuffer(b64decode(picture.data), np.uint8), cv2.IMREAD_COLOR)
        assert (picture.mime_type, image.shape) == ("image/jpeg", (240, 320, 3))
        driven = await call("drive_mm", distance_mm=300)
        assert driven["ended"] == "done"
        assert driven["distance_mm"] == pytest.approx(300, abs=5)
        turned = await call("turn", angle_deg=-90)
        assert turned["turned_deg"] == pytest.approx(-90, abs=2)
        assert turned["pose"]["x_mm"] == pytest.approx(300, abs=10), "the pose goes on from motion to motion"
        read = await call("range")
        assert read["range_mm"] > 100
        assert (await call("mission_status"))["robot"]["pose"].keys() == read["pose"].keys()
        assert not read["touching"]
        battery = await call("battery")
        assert 7.1 <= battery["battery_v"] < 9
        assert not battery["low"]

    _converse(fast, talk, mode)


def test_an_assistant_learns_which_sensors_the_robot_does_not_have(tmp_path):
    mission = tmp_path / "blind.toml"
    mission.write_text(QUICK + "[robot]\nultrasonic = 0\ntouch = 0\n", encoding="utf-8")
    with _robot(tmp_path, "sim://open?pace=fast", GEOMETRIC, mission) as assistant:
        told = make_server(assistant).instructions

        async def talk(call: Call) -> None:
            assert (await call("range"))["lacking"] == ["sonar", "bumper"]

        _converse(assistant, talk)
    assert "a sonar" not in told
    assert "Driving forward ends before" not in told


@pytest.mark.parametrize(
    ("tool", "arguments", "said"),
    [
        ("drive_mm", {"distance_mm": 100, "speed": 3}, "drive_mm has no argument 'speed': drive_mm needs"),
        ("drive_mm", {}, "distance_mm is missing: drive_mm needs distance_mm, a number of millimetres."),
        ("turn", {"angle_deg": "left"}, "angle_deg must be a number: turn needs angle_deg, a number of degrees."),
        ("drive_mm", {"distance_mm": "100"}, "distance_mm must be a number without quotation marks: drive_mm needs"),
        ("turn", {"angle_deg": True}, "angle_deg must be a number: turn needs"),
        ("mission_choose", {"number": True}, "number must be a whole number: mission_choose needs"),
        ("mission_run", {"decide": "false"}, "decide must be true or false: mission_run takes"),
        ("mission_status", {"wait_s": -1}, "wait_s must be 0 or more: mission_status takes"),
        ("mission_status", {"wait_s": 61}, "wait_s must be 60 or less: mission_status takes"),
        ("look", {"at": "lena"}, "look has no argument 'at': look takes no arguments."),
        ("mission_status", {"wait": 3}, "mission_status takes wait_s, a number of seconds."),
    ],
)
def test_arguments_that_a_tool_does_not_have_are_refused_and_move_nothing(fast, tool, arguments, said):
    async def talk(call: Call) -> None:
        before = await call("range")
        refused = await call(tool, **arguments)
        assert said in refused
        assert "validation" not in refused
        assert (await call("range"))["pose"] == before["pose"]

    _converse(fast, talk)


def test_a_prompt_is_refused_without_a_traceback(quick, caplog):
    async def ask() -> None:
        async with Client(make_server(quick)) as client:
            with pytest.raises(MCPError, match="there is no prompt 'x'"):
                await client.get_prompt("x")

    anyio.run(ask)
    assert not [record.message for record in caplog.records if record.exc_info]


@pytest.mark.parametrize(
    ("tool", "argument", "value", "limit"),
    [
        ("drive_mm", "distance_mm", 1001, "1000"),
        ("drive_mm", "distance_mm", -1e9, "1000"),
        ("turn", "angle_deg", 361, "360"),
    ],
)
def test_a_motion_that_is_too_long_for_one_call_is_refused(fast, tool, argument, value, limit):
    async def talk(call: Call) -> None:
        assert f"from -{limit} to {limit} in one call" in await call(tool, **{argument: value})
        assert (await call("range"))["pose"] == {"x_mm": 0.0, "y_mm": 0.0, "heading_deg": 0.0}

    _converse(fast, talk)


@pytest.mark.slow
def test_anything_that_is_not_a_number_never_reaches_the_motors(fast):
    async def talk(call: Call) -> None:
        for value in ("far", None, "nan", "inf"):
            assert isinstance(await call("drive_mm", distance_mm=value), str)

    _converse(fast, talk)


@pytest.mark.slow
def test_driving_ends_before_an_obstacle(fast):
    async def talk(call: Call) -> None:
        for _ in range(5):
            driven = await call("drive_mm", distance_mm=1000)
        assert driven["ended"] == "obstacle"
        assert not driven["touching"]

    _converse(fast, talk)


@pytest.mark.slow
def test_stop_breaks_off_a_motion_that_another_call_waits_for(slow):
    ended: dict[str, Any] = {}

    async def talk(call: Call) -> None:
        async def drive() -> None:
            ended.update(await call("drive_mm", distance_mm=1000))

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(drive)
            await _moving(slow)
            assert "A motion is running" in await call("turn", angle_deg=10)
            assert await call("stop") == {"stopped": True}

    _converse(slow, talk)
    assert ended["ended"] == "cancelled"
    assert ended["distance_mm"] < 500


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["auto", "legacy"])
def test_a_call_that_is_cancelled_stops_the_robot(slow, mode):
    async def talk(call: Call) -> None:
        with anyio.move_on_after(0.5):
            await call("drive_mm", distance_mm=1000)
        with anyio.fail_after(5):
            while slow.robot.busy:
                await anyio.sleep(0.01)
        assert (await call("range"))["pose"]["x_mm"] < 500

    _converse(slow, talk, mode)


@pytest.mark.slow
def test_the_assistant_does_not_drive_while_a_person_does(slow):
    async def talk(call: Call) -> None:
        for tool, arguments in (("drive_mm", {"distance_mm": 100}), ("turn", {"angle_deg": 10}), ("mission_run", {})):
            slow.robot.drive(0.0, 0.0)  # the pad has been let go
            slow.robot.drive(0.0, 0.3)
            assert "A person is driving the robot by hand." in await call(tool, **arguments)
        assert not (await call("mission_status"))["running"]

    _converse(slow, talk)


@pytest.mark.slow
def test_a_persons_stop_is_not_released_by_the_assistant(slow):
    async def talk(call: Call) -> None:
        slow.robot.stop()
        for tool, arguments in (("drive_mm", {"distance_mm": 100}), ("turn", {"angle_deg": 10}), ("mission_run", {})):
            assert "A person must release the stop on the page first." in await call(tool, **arguments)
            assert (await call("stop"))["stopped"]
        assert (await call("range"))["battery_mv"], "the sensors can be read"
        slow.robot.release()
        assert (await call("drive_mm", distance_mm=50))["ended"] == "done"

    _converse(slow, talk)


@pytest.mark.slow
def test_a_mission_is_run_followed_and_explained(quick):
    (quick.missions.folder / "quick.toml").write_text(QUICK, encoding="utf-8")

    async def talk(call: Call) -> None:
        assert (await call("missions"))["missions"] == ["", "quick.toml"]
        assert "There is no mission 'slow'" in await call("mission_run", mission="slow")
        assert "There is no profile 'this:Profile'" in await call("mission_run", profile="this:Profile")
        assert (await call("mission_run", mission="quick.toml"))["running"]
        status = await call("mission_status", wait_s=60)
        assert not status["running"]
        assert status["mission"]["result"]["achieved"]
        assert any("lena" in line for line in status["mission"]["lines"])
        explained = await call("explain")
        assert explained == await call("explain", run=explained["run"])
        assert "There is no run" in await call("explain", run="../elsewhere")

    _converse(quick, talk)


@pytest.mark.slow
def test_the_assistant_may_decide_each_recovery(tmp_path):
    with _robot(tmp_path, "sim://?pace=fast", GEOMETRIC) as assistant:

        async def talk(call: Call) -> None:
            assert "No mission" in await call("mission_choose", number=0)
            await call("mission_run", profile="adaptive", decide=True)
            status = await call("mission_status", wait_s=60)
            assert status["running"]
            assert status["question"]["open"]
            for wrong in (99, -1):
                assert "numbered" in await call("mission_choose", number=wrong)
            assert await call("mission_choose", number=1) == {"chosen": 1}
            assert not (await call("mission_status"))["question"]["open"], "it is answered"
            await call("stop")
            decision = (await call("explain"))["decisions"][0]
            assert decision["operator"]
            assert decision["choice"] == status["question"]["candidates"][1]["does"]

        _converse(assistant, talk)


def test_a_mission_may_end_while_the_assistant_decides(fast, monkeypatch):
    looks = cycle([ShownMission(read_mission_file(None), Hub(), confirm=True), None])  # ended at every second look
    monkeypatch.setattr(Robot, "mission", property(lambda _: next(looks)))
    assert fast.status()["question"] == {"open": False}
    with pytest.raises(ValueError, match="No mission is under way"):
        fast.choose(0)
    with pytest.raises(ValueError, match="No decision is open"):
        fast.choose(0)


@pytest.mark.slow
def test_stop_ends_a_mission(slow):
    (slow.missions.folder / "quick.toml").write_text(QUICK, encoding="utf-8")

    async def talk(call: Call) -> None:
        await call("mission_run", mission="quick.toml")
        await anyio.sleep(0.5)
        assert "A mission is running" in await call("range")
        assert (await call("stop"))["stopped"]
        status = await call("mission_status")
        assert not status["running"]
        assert not status["mission"]["result"]["achieved"]

    _converse(slow, talk)


def test_stop_needs_no_thread_that_other_calls_have_taken(quick):
    async def talk(call: Call) -> None:
        limiter = anyio.to_thread.current_default_thread_limiter()
        while limiter.available_tokens:
            await limiter.acquire_on_behalf_of(object())
        with anyio.fail_after(10):
            assert (await call("stop"))["stopped"]

    _converse(quick, talk)


@pytest.mark.slow
def test_the_start_of_a_mission_whose_detectors_take_long_describes_that_mission(slow, monkeypatch):
    assemble = ShownMission.assemble

    def assemble_late(*args: Any) -> Any:
        threading.Event().wait(1.5)
        return assemble(*args)

    monkeypatch.setattr(ShownMission, "assemble", assemble_late)

    async def talk(call: Call) -> None:
        assert (await call("mission_run"))["mission"]["run"].endswith("-001")

    _converse(slow, talk)


def test_the_start_of_a_mission_does_not_return_the_result_of_the_one_before(slow):
    async def talk(call: Call) -> None:
        for number in (1, 2):
            started = await call("mission_run")
            assert started["running"]
            assert started["mission"]["run"].endswith(f"-00{number}")
            assert "result" not in started["mission"]
            assert (await call("stop"))["stopped"]

    _converse(slow, talk)
