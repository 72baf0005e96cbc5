"""The server of a classroom by its test client: tiles, a stop for all, handing out, collecting, a robot that fails."""

from __future__ import annotations

import io
import os
import re
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import cv2
import numpy as np
import pytest
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from nxtdrive.mission.files import read_mission_file
from nxtdrive.tools.web.access import Pin
from nxtdrive.tools.web.classroom.app import ClassroomServer
from nxtdrive.tools.web.classroom.classroom import TILE_PICTURE, Classroom
from nxtdrive.tools.web.classroom.config import ClassroomConfig, RobotEntry
from nxtdrive.tools.web.classroom.messages import ClassroomMessage, read_message, schema
from nxtdrive.tools.web.classroom.station import Station
from nxtdrive.transports.address import Address
from tests.tools.web.pages import HOST, next_message, refusal
from tests.waiting import until

from .conftest import simulated

ROOT = Path(__file__).parents[4]
QUICK = '[mission]\nname = "=quick"\ntargets = ["lena"]\n[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'


def _client(classroom: Classroom, pin: Pin | None = None) -> TestClient:
    return TestClient(ClassroomServer(classroom, pin).app(), headers=HOST)


def _closed(folder: Path, *names: str, mission: str = "") -> Classroom:
    """A class whose robots are not opened."""
    robots = tuple(
        RobotEntry(name, "#c4161c", Address("sim", "open", {"pace": "realtime"}), mission=mission) for name in names
    )
    return Classroom(ClassroomConfig("7b", robots, folder / "runs", folder), read_mission_file(None))


def _tiles(page: WebSocketTestSession, wanted: Callable[[dict[str, Any]], bool]) -> list[dict[str, Any]]:
    """Return the tiles as soon as all of them are as wanted."""
    message = next_message(page, lambda each: each["type"] == "robots" and all(map(wanted, each["robots"])))
    return list(message["robots"])


def test_the_page_of_the_class_and_the_pages_of_its_robots_are_served(tmp_path):
    client = _client(_closed(tmp_path, "Ada", "Zoë 2"))
    assert "STOP ALL" in client.get("/").text
    for path in (
        "/robot/Ada/",
        "/robot/Ada",
        "/robot/Zoë 2/",
        "/robot/Ada/runs.html",
        "/classroom.js",
        "/robot/Ada/app.js",
    ):
        assert client.get(path).status_code == 200
    assert client.get("/robot/Ada/api/runs").json() == []
    assert client.get("/robot/Eve/").status_code == 404
    assert client.get("/", headers={"host": "evil.example"}).status_code == 403
    with client.websocket_connect("/robot/Ada/ws") as page:
        assert "Ada" in page.receive_json()["address"]


def test_the_robot_file_is_that_of_all_missions(tmp_path):
    (tmp_path / "robot.toml").write_text("[robot]\nwheel_diameter_mm = 43\n", encoding="utf-8")
    config = ClassroomConfig("7b", (), tmp_path / "runs", tmp_path)
    classroom = Classroom(config, read_mission_file(None), tmp_path / "robot.toml")
    assert classroom.missions.load("").robot.wheel_diameter_mm == 43


@pytest.mark.parametrize("path", ["/robot/Robot 9/", "/robot/Robot 9", "/robot/<b>/x"])
def test_an_unknown_robot_is_reported_with_a_link_back(tmp_path, path):
    answer = _client(_closed(tmp_path, "Ada")).get(path)
    assert answer.status_code == 404
    assert 'There is no robot "' in answer.text
    assert '<a href="/">Back to 7b</a>' in answer.text
    assert "<b>" not in answer.text


def test_a_page_is_greeted_with_the_robots_and_missions(tmp_path):
    (tmp_path / "quick.toml").write_text(QUICK, encoding="utf-8")
    with _client(_closed(tmp_path, "Ada", mission="quick.toml")).websocket_connect("/ws") as page:
        hello = page.receive_json()
    assert (hello["type"], hello["version"], hello["name"], hello["missions"]) == ("hello", 1, "7b", ["quick.toml"])
    assert hello["profiles"] == ["thesis", "adaptive"]
    assert hello["robots"] == [
        {"name": "Ada", "color": "#c4161c", "address": "sim://open?pace=realtime", "mission": "quick.toml"}
    ]


def test_nothing_is_shown_without_the_pin(tmp_path):
    pin = Pin()
    client = _client(_closed(tmp_path, "Ada"), pin)
    for path in ("/", "/robot/Ada/"):
        assert client.get(path, follow_redirects=False).headers["location"] == "/pin.html"
    for path in ("/runs.zip", "/results.csv", "/api/results", "/robot/Ada/api/runs"):
        assert client.get(path).status_code == 401
    for path in ("/ws", "/robot/Ada/ws"):
        with pytest.raises(WebSocketDisconnect), client.websocket_connect(path):
            pass
    assert client.post("/api/session", content=pin.digits).status_code == 204
    assert client.get("/robot/Ada/").status_code == 200


@pytest.mark.parametrize(
    ("message", "says"),
    [
        ({"type": "fly"}, "fly"),
        ({"type": "start", "robots": ["Ada", "Eve"]}, "Eve: There is no robot"),
        ({"type": "start", "robots": ["Ada"]}, "Ada: The robot is not open yet."),
        ({"type": "beep", "robot": "Ada"}, "not open"),
        ({"type": "return_to_brick", "robot": "Ada"}, "No simulated robot"),
    ],
)
def test_what_cannot_be_done_is_refused_with_a_sentence(tmp_path, message, says):
    with _client(_closed(tmp_path, "Ada")).websocket_connect("/ws") as page:
        page.send_json(message)
        assert says in refusal(page)


def test_anyone_stops_all_robots_also_those_that_are_not_open(tmp_path):
    with _client(_closed(tmp_path, "Ada", "Grace")).websocket_connect("/ws") as page:
        page.send_json({"type": "stop_all"})
        _tiles(page, lambda tile: tile["stopped"])
        page.send_json({"type": "release_all"})
        _tiles(page, lambda tile: not tile["stopped"])


@pytest.mark.slow
def test_one_robot_that_cannot_be_opened_says_why_and_the_others_run(running):
    nobody = RobotEntry("Eve", "#c4161c", Address("sim", "@nosuch"))
    robots = simulated("Ada"), nobody, simulated("Grace")
    with running(*robots) as classroom, _client(classroom).websocket_connect("/ws") as page:
        page.send_json({"type": "visible", "robots": ["Grace"]})
        tiles = _tiles(page, lambda tile: tile["open"] or tile["trouble"])
        assert [tile["open"] for tile in tiles] == [True, False, True]
        assert "nosuch" in tiles[1]["trouble"]
        while not (picture := page.receive().get("bytes")):
            pass
        assert (picture[0], picture[4], picture[16:18]) == (TILE_PICTURE, 2, b"\xff\xd8")


@pytest.mark.slow
def test_a_tile_shows_a_wide_picture_undistorted(running, monkeypatch):
    monkeypatch.setattr(Station, "picture", lambda _: np.zeros((360, 640, 3), np.uint8))
    with running(simulated("Ada")) as classroom, _client(classroom).websocket_connect("/ws") as page:
        page.send_json({"type": "visible", "robots": ["Ada"]})
        while not (picture := page.receive().get("bytes")):
            pass
    assert cv2.imdecode(np.frombuffer(picture[16:], np.uint8), cv2.IMREAD_COLOR).shape == (120, 213, 3)


@pytest.mark.slow
def test_missions_are_handed_out_to_some_and_their_runs_are_collected(running, tmp_path):
    (tmp_path / "quick.toml").write_text(QUICK, encoding="utf-8")
    with running(*(simulated(name, "fast") for name in ("Ada", "Eve", "Grace"))) as classroom:
        client = _client(classroom)
        with client.websocket_connect("/ws") as page:
            _tiles(page, lambda tile: tile["open"])
            page.send_json({"type": "start", "robots": ["Ada", "Grace"], "mission": "quick.toml"})
            tiles = _tiles(page, lambda tile: tile["name"] == "Eve" or tile["last"])
            assert [tile["ended"] for tile in tiles] == [1, 0, 1]
        rows = client.get("/api/results").json()
        assert [(row["robot"], row["reached"], row["targets"], row["ending"]) for row in rows] == [
            ("Ada", 1, 1, "achieved"),
            ("Grace", 1, 1, "achieved"),
        ]
        header, *lines = client.get("/results.csv").text.splitlines()
        assert header.startswith("robot,run,mission,ending")
        assert "'=quick" in lines[0]
        names = zipfile.ZipFile(io.BytesIO(client.get("/runs.zip").content)).namelist()
    assert {"runs/Ada/quick-001/journal.jsonl", "runs/Grace/quick-001/summary.json"} <= set(names)
    assert not [name for name in names if "Eve" in name]


@pytest.mark.slow
def test_stop_all_ends_every_mission(running):
    robots = simulated("Ada"), simulated("Grace")
    with running(*robots) as classroom, _client(classroom).websocket_connect("/ws") as page:
        _tiles(page, lambda tile: tile["open"])
        page.send_json({"type": "start", "robots": ["Ada", "Grace"]})
        _tiles(page, lambda tile: tile["running"])
        page.send_json({"type": "stop_all"})
        tiles = _tiles(page, lambda tile: tile["last"])
        assert {(tile["last"]["ending"], tile["stopped"]) for tile in tiles} == {("interrupted", True)}


@pytest.mark.slow
def test_one_page_drives_a_robot_and_another_page_another(running):
    with running(simulated("Ada"), simulated("Grace")) as classroom:
        until(lambda: all(station.is_open for station in classroom.stations))
        client = _client(classroom)
        with client.websocket_connect("/robot/Ada/ws") as one, client.websocket_connect("/robot/Grace/ws") as other:
            for page in (one, other):
                page.send_json({"type": "drive", "ahead": 0, "turn": 0})
                # more than once: on a busy computer the dead-man switch may act before the page hears that it drives
                while next_message(page, lambda each: "doing" in each)["doing"] != "driving":
                    page.send_json({"type": "drive", "ahead": 1, "turn": 0})
                assert next_message(page, lambda each: each.get("doing") == "at rest")  # the dead-man switch


def test_runs_whose_names_are_not_utf_8_are_collected(tmp_path):
    folder = tmp_path / "runs" / "Ada" / os.fsdecode(b"x-\xff")
    try:
        folder.mkdir(parents=True)
    except OSError:
        pytest.skip("this system has no such names")
    (folder / "journal.jsonl").write_text("{}\n", encoding="utf-8")
    content = _client(_closed(tmp_path, "Ada")).get("/runs.zip").content
    assert zipfile.ZipFile(io.BytesIO(content)).namelist() == ["runs/Ada/x-?/journal.jsonl"]


def test_symbolic_links_are_not_collected(tmp_path):
    folder = tmp_path / "runs" / "Ada" / "x-001"
    folder.mkdir(parents=True)
    (tmp_path / "secret").write_text("secret", encoding="utf-8")
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "journal.jsonl").write_text("{}\n", encoding="utf-8")
    content = _client(_closed(tmp_path, "Ada")).get("/runs.zip").content
    assert zipfile.ZipFile(io.BytesIO(content)).namelist() == ["runs/Ada/x-001/journal.jsonl"]


@pytest.mark.parametrize("wanted", [{}, {"range": "bytes=0-99"}, {"range": "bytes=999999999-"}, {"range": "bytes=x"}])
def test_the_runs_leave_no_temporary_file_whatever_part_is_asked_for(tmp_path, monkeypatch, wanted):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    answer = _client(_closed(tmp_path, "Ada")).get("/runs.zip", headers=wanted)
    assert zipfile.ZipFile(io.BytesIO(answer.content)).namelist() == []
    assert answer.headers["content-length"] == str(len(answer.content))
    assert os.listdir(temporary) == []


def test_runs_that_cannot_be_collected_are_reported(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    answer = _client(_closed(tmp_path, "Ada")).get("/runs.zip")
    assert (answer.status_code, answer.text) == (500, "The runs cannot be collected (No such file or directory).\n")


@pytest.mark.parametrize("text", ["", "[]", '{"type": "start"}', '{"type": "stop_all", "more": 1}', "[" * 100_000])
def test_anything_else_than_a_message_is_refused_with_a_sentence(text):
    with pytest.raises(ValueError, match=r"\w"):
        read_message(text)


@pytest.mark.parametrize("message", get_args(ClassroomMessage), ids=lambda each: each.__name__)
def test_every_message_and_key_is_explained(message):
    document = (ROOT / "docs" / "web-protocol.md").read_text(encoding="utf-8")
    fields = dict(message.model_fields)
    (name,) = get_args(fields.pop("type").annotation)
    (row,) = re.findall(rf"^\| `{name}` \|.*$", document, flags=re.MULTILINE)
    assert all(f"`{key}`" in row for key in fields)


def test_the_schema_has_every_message():
    assert len(schema()["oneOf"]) == len(get_args(ClassroomMessage))
