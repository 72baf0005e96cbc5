"""The server by its test client: the page, the WebSocket, the guard, driving, a mission on a simulated robot."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from itertools import chain, repeat
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from behaviors.journal import Record, RecordKind
from behaviors.profiles import registry
from nxtdrive import run_mission
from nxtdrive.mission.files import read_mission_file
from nxtdrive.recording.run_folder import RunFolder
from nxtdrive.tools.web.app import Server
from nxtdrive.tools.web.hub import Hub
from nxtdrive.tools.web.mission_run import ShownMission, doing
from nxtdrive.tools.web.missions import Missions
from nxtdrive.tools.web.page_socket import MAX_CLIENTS
from nxtdrive.tools.web.robot import Robot
from nxtdrive.tools.web.runs import Runs
from nxtdrive.transports.address import Address

HOST = {"host": "127.0.0.1:7080"}
QUICK = '[mission]\nname = "quick"\ntargets = ["lena"]\n[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'


def _server(folder: Path, address: str = "sim://open?pace=realtime", camera: str | None = None) -> Server:
    hub = Hub()
    robot = Robot(Address.parse(address), camera, read_mission_file(None), hub, folder / "runs")
    return Server(robot, hub, Missions(folder), Runs(folder / "runs"), address)


def _client(server: Server) -> TestClient:
    return TestClient(server.app(), headers=HOST)


def _quick(folder: Path) -> Path:
    (folder / "quick.toml").write_text(QUICK, encoding="utf-8")
    return folder / "quick.toml"


def _journal(folder: Path) -> RunFolder:
    folder.mkdir(parents=True)
    return RunFolder(folder)


@contextmanager
def _running(
    folder: Path, address: str = "sim://open?pace=realtime", camera: str | None = None
) -> Iterator[TestClient]:
    server = _server(folder, address, camera)
    server.robot.open()
    try:
        yield _client(server)
    finally:
        server.robot.close()


def _until(page: WebSocketTestSession, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Return the next JSON message that is wanted."""
    while True:
        text = page.receive().get("text")
        if text and wanted(message := json.loads(text)):
            return message


def test_the_page_and_its_parts_are_served_and_need_nothing_from_elsewhere(tmp_path):
    client = _client(_server(tmp_path))
    page = client.get("/")
    assert page.status_code == 200
    assert "http" not in page.text.replace("http-equiv", "")
    for name in ("app.js", "style.css", "connection.js"):
        assert client.get(f"/{name}").status_code == 200
    assert client.get("/../pyproject.toml").status_code == 404


@pytest.mark.parametrize(
    "headers",
    [
        {"host": "evil.example"},
        {"host": "127.0.0.1:7080", "origin": "http://evil.example"},
        {"host": "127.0.0.1:7080", "origin": "http://127.0.0.1:8000"},
        {"host": "192.168.0.7:7080"},
        {"host": "127.0.0.1:7080", "origin": "null"},
    ],
)
def test_other_web_sites_and_other_names_are_refused(tmp_path, headers):
    client = _client(_server(tmp_path))
    assert client.get("/", headers=headers).status_code == 403
    with pytest.raises(WebSocketDisconnect), client.websocket_connect("/ws", headers=headers):
        pass


@pytest.mark.parametrize("path", ["/", "/missions.html", "/api/missions", "/nothing"])
def test_no_page_is_shown_in_a_frame_of_another_site(tmp_path, path):
    policy = _client(_server(tmp_path)).get(path).headers["content-security-policy"]
    assert policy == "frame-ancestors 'none'"


@pytest.mark.parametrize("path", ["/", "/app.js", "/api/runs"])
def test_browsers_ask_again_for_what_another_version_may_have_changed(tmp_path, path):
    assert _client(_server(tmp_path)).get(path).headers["cache-control"] == "no-cache"


def test_a_page_is_greeted_with_what_it_draws(tmp_path):
    (tmp_path / "cat.toml").write_text(QUICK, encoding="utf-8")
    (tmp_path / "room.toml").write_text("[world]\n", encoding="utf-8")
    (tmp_path / os.fsdecode(b"caf\xe9.toml")).write_text(QUICK, encoding="utf-8")  # a name that JSON cannot say
    with _client(_server(tmp_path)).websocket_connect("/ws") as page:
        hello = page.receive_json()
    assert hello["version"] == 1
    assert hello["missions"] == ["cat.toml"]
    assert hello["proposed"] == ""
    assert hello["profiles"] == ["thesis", "adaptive"]
    regions = {region["state"]: {each["state"] for each in region["inner"]} for region in hello["chart"]["regions"]}
    assert {"mission", "equipment", "safety", "camera", "floor_map"} == set(regions)
    assert all(first in states for first, states in zip(hello["chart"]["initial"], regions.values(), strict=True))
    assert hello["chart"]["words"].keys() >= set().union(regions, *regions.values())
    assert set(hello["recoveries"]) >= {"wait", "detour"}


@pytest.mark.parametrize(
    ("message", "says"),
    [
        ('{"type": "fly"}', "fly"),
        ('{"type": "start_mission", "mission": "nosuch.toml"}', "nosuch.toml"),
        ('{"type": "start_mission", "mission": "../secret.toml"}', "secret"),
    ],
)
def test_what_cannot_be_done_is_refused_with_a_sentence(tmp_path, message, says):
    with _client(_server(tmp_path)).websocket_connect("/ws") as page:
        page.send_text(message)
        assert says in _until(page, lambda each: each["type"] == "refused")["text"]


def test_the_mistakes_of_a_mission_are_reported(tmp_path):
    (tmp_path / "bad.toml").write_text(QUICK.replace("lena.png", "nosuch.png"), encoding="utf-8")
    with _client(_server(tmp_path)).websocket_connect("/ws") as page:
        page.send_text('{"type": "start_mission", "mission": "bad.toml"}')
        assert "nosuch.png" in _until(page, lambda each: each["type"] == "refused")["text"]


def test_a_sensor_that_does_not_answer_is_named_and_tried_again(tmp_path):
    server = _server(tmp_path)
    built = read_mission_file(None)
    wrong = built.model_copy(update={"robot": built.robot.model_copy(update={"ultrasonic": 3})})  # it is on 4
    server.robot.rebuild(wrong)
    server.robot.open()
    try:
        with _client(server).websocket_connect("/ws") as page:
            assert "cable" in _until(page, lambda each: each["type"] == "link" and each["lost"])["lost"]
            server.robot.rebuild(built)
            _until(page, lambda each: each["type"] == "state" and each["range_mm"] is not None)
        assert server.robot.alive
    finally:
        server.robot.close()


def test_there_is_a_limit_to_the_number_of_pages(tmp_path):
    server = _server(tmp_path)
    client = _client(server)
    pages = [client.websocket_connect("/ws") for _ in range(MAX_CLIENTS)]
    try:
        for page in pages:
            page.__enter__().receive_json()
        with client.websocket_connect("/ws") as one_more, pytest.raises(WebSocketDisconnect):
            one_more.receive_json()
    finally:
        for page in pages:
            page.__exit__(None, None, None)


@pytest.mark.slow
def test_one_page_drives_and_the_robot_stops_when_no_more_requests_come(tmp_path):
    with (
        _running(tmp_path) as client,
        client.websocket_connect("/ws") as page,
        client.websocket_connect("/ws") as other,
    ):
        for ahead in (0, 1):
            page.send_json({"type": "drive", "ahead": ahead, "turn": 0})
        assert _until(page, lambda each: each.get("doing") == "driving")
        other.send_json({"type": "drive", "ahead": -1, "turn": 0})
        assert "(page 1) drives" in _until(other, lambda each: each["type"] == "refused")["text"]
        # no further sign of the driver: the dead-man switch stops
        stopped = _until(page, lambda each: each.get("doing") == "at rest")
        assert 20 < stopped["pose"][0] < 400


def test_a_driver_is_asked_to_begin_at_the_centre(tmp_path):
    with _client(_server(tmp_path)).websocket_connect("/ws") as page:
        page.send_json({"type": "drive", "ahead": 1, "turn": 0})
        assert "sends zeros once" in _until(page, lambda each: each["type"] == "refused")["text"]


def test_a_driver_that_leaves_stops_the_robot_at_once(tmp_path):
    server = _server(tmp_path)
    with _client(server).websocket_connect("/ws") as page:
        for ahead in (0, 1):
            page.send_json({"type": "drive", "ahead": ahead, "turn": 0})
        page.send_text("no message")
        _until(page, lambda each: each["type"] == "refused")
        assert server.robot.controls.wanted(0.0)[0] > 0
    assert server.robot.controls.wanted(0.0) == (0.0, 0.0)


def test_a_driver_that_hands_over_stops_the_robot_and_a_pad_held_meanwhile_does_not_drive(tmp_path):
    server = _server(tmp_path)
    with _client(server) as client, client.websocket_connect("/ws") as page, client.websocket_connect("/ws") as other:

        def drive(which: WebSocketTestSession, ahead: float) -> float:
            which.send_json({"type": "drive", "ahead": ahead, "turn": 0})
            which.send_text("no message")
            _until(which, lambda each: each["type"] == "refused" and "drives;" not in each["text"])
            return server.robot.controls.wanted(0.0)[0]

        drive(page, 0)
        assert drive(page, 1) > 0
        assert drive(other, -1) > 0, "it only asks for control"
        page.send_json({"type": "give_control"})
        _until(other, lambda each: each["type"] == "control" and each["driver"] == "page 2")
        assert server.robot.controls.wanted(0.0) == (0.0, 0.0)
        assert drive(other, -1) == 0
        drive(other, 0)
        assert drive(other, -1) < 0


@pytest.mark.slow
def test_anyone_may_stop_and_nothing_drives_until_the_stop_is_released(tmp_path):
    with (
        _running(tmp_path) as client,
        client.websocket_connect("/ws") as page,
        client.websocket_connect("/ws") as other,
    ):
        for ahead in (0, 1):
            page.send_json({"type": "drive", "ahead": ahead, "turn": 0})
        other.send_json({"type": "stop"})
        _until(page, lambda each: each.get("stopped") is True)
        for asked in ({"type": "drive", "ahead": 1, "turn": 0}, {"type": "start_mission"}):
            page.send_json(asked)
            assert "stopped" in _until(page, lambda each: each["type"] == "refused")["text"]
        other.send_json({"type": "release"})
        _until(page, lambda each: each.get("stopped") is False)


@pytest.mark.slow
def test_who_drives_during_a_mission_gets_the_reason_why_the_robot_does_not_move(tmp_path):
    with _running(tmp_path) as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission"})
        _until(page, lambda each: each["type"] == "run")
        for ahead in (0, 1):
            page.send_json({"type": "drive", "ahead": ahead, "turn": 0})
        assert "A mission is running" in _until(page, lambda each: each["type"] == "refused")["text"]


@pytest.mark.slow
def test_a_mission_started_on_the_page_publishes_its_records_and_leaves_a_run_folder(tmp_path):
    _quick(tmp_path)
    with _running(tmp_path, "sim://open?pace=fast", "geometric") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission", "mission": "quick.toml"})
        assert _until(page, lambda each: each["type"] == "run")["name"] == "quick"
        assert _until(page, lambda each: each["type"] == "record")["record"]["kind"] == "start"
        ended = _until(page, lambda each: each["type"] == "ended")
    assert ended["achieved"]
    assert {"journal.jsonl", "summary.json", "map.png"} <= {
        path.name for path in (tmp_path / "runs" / ended["folder"]).iterdir()
    }


@pytest.mark.slow
def test_a_page_that_comes_during_a_mission_gets_the_whole_state(tmp_path):
    with _running(tmp_path, "sim://?pace=fast", "geometric") as client, client.websocket_connect("/ws") as page:
        before = _until(page, lambda each: each["type"] == "state" and each["battery_mv"])
        page.send_json({"type": "start_mission", "profile": "adaptive", "confirm": True})
        _until(page, lambda each: each["type"] == "question" and each["open"])
        with client.websocket_connect("/ws") as late:
            _until(late, lambda each: each["type"] == "run")
            status = _until(late, lambda each: each["type"] == "status")
        assert status.keys() == before.keys() - {"pose", "touching"}
        assert status["doing"] == "waiting for your choice: lena"
        assert [each["ending"] for each in client.get("/api/runs").json()] == ["running"]
        page.send_json({"type": "speed_limit", "percent": 40})
        page.send_json({"type": "answer", "question": 1, "choice": 0})
        assert _until(page, lambda each: each["type"] == "status" and each["speed_limit"] == 40)
        page.send_json({"type": "stop_mission"})


def test_what_the_robot_does_is_reported_in_the_words_of_the_terminal():
    assert doing(Record(0.0, RecordKind.STEP, "move_to", "lena")) == "look elsewhere: lena"
    assert doing(Record(0.0, RecordKind.STEP, "gave_up", "lena")) == "gave up: lena"
    assert doing(Record(0.0, RecordKind.TRANSITION, "finished", "lena", {"to": "done"})) == "finished"
    assert doing(Record(0.0, RecordKind.END, "finished", "lena", {"ending": "time_limit"})) == "ended: time limit"


@pytest.mark.slow
@pytest.mark.parametrize("by_program", [pytest.param(False, marks=pytest.mark.nightly), True])
def test_a_mission_waits_for_the_answer_to_its_question_and_can_be_ended(by_program, tmp_path):
    with _running(tmp_path, "sim://?pace=fast", "geometric") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission", "profile": "adaptive", "confirm": True})
        question = _until(page, lambda each: each["type"] == "question" and each["open"])
        assert len(question["candidates"]) > 1
        taken = 0
        page.send_json({"type": "answer", "question": question["number"], "choice": len(question["candidates"])})
        assert "numbered from 0" in _until(page, lambda each: each["type"] == "refused")["text"]
        if by_program:
            page.send_json({"type": "evidence"})
            told = _until(page, lambda each: each["type"] == "open_decision")
            assert (told["open"], told["question"]) == (True, question["number"])
            assert [each["does"] for each in told["candidates"]] == [each["text"] for each in question["candidates"]]
            page.send_json({"type": "choose", "number": len(told["candidates"])})
            assert "numbered from 0" in _until(page, lambda each: each["type"] == "refused")["text"]
            taken = len(told["candidates"]) - 1
            page.send_json({"type": "choose", "number": taken})
        else:
            page.send_json({"type": "answer", "question": question["number"], "choice": 0})
        choice = _until(page, lambda each: each["type"] == "record" and each["record"]["kind"] == "choice")
        assert choice["record"]["operator"] is True
        assert not by_program or choice["record"]["choice"] == told["candidates"][taken]["choice"]
        page.send_json({"type": "stop_mission"})
        assert _until(page, lambda each: each["type"] == "ended")["ending"] == "interrupted"


def test_without_a_mission_no_decision_is_open(tmp_path):
    with _running(tmp_path, "sim://?pace=fast") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "evidence"})
        assert _until(page, lambda each: each["type"] == "open_decision")["open"] is False
        page.send_json({"type": "choose", "number": 0})
        assert "No mission" in _until(page, lambda each: each["type"] == "refused")["text"]


@pytest.mark.parametrize(
    ("message", "says"), [({"type": "evidence"}, "open"), ({"type": "choose", "number": 0}, "text")]
)
def test_a_mission_may_end_while_a_message_about_its_decision_is_obeyed(tmp_path, monkeypatch, message, says):
    looks = chain(
        [ShownMission(read_mission_file(None), Hub(), confirm=True)], repeat(None)
    )  # ended at the second look
    monkeypatch.setattr(Robot, "mission", property(lambda _: next(looks)))
    with _client(_server(tmp_path)).websocket_connect("/ws") as page:
        page.send_json(message)
        assert _until(page, lambda each: says in each)[says] in (False, "No decision is open.")


@pytest.mark.slow
def test_a_mission_is_paused_resumed_and_ended_while_it_is_paused(tmp_path):
    with _running(tmp_path, "sim://?pace=fast") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "pause"})
        assert "No mission" in _until(page, lambda each: each["type"] == "refused")["text"]
        page.send_json({"type": "start_mission"})
        for ends in ("resume", "stop_mission"):
            _until(page, lambda each: each["type"] == "record" and each["record"]["kind"] == "look")
            page.send_json({"type": "pause"})
            paused = _until(page, lambda each: each["type"] == "record" and each["record"].get("to") == "suspended")
            assert paused["record"]["reason"] == "operator_pause"
            page.send_json({"type": ends})
        assert _until(page, lambda each: each["type"] == "ended")["ending"] == "interrupted"


def test_runs_are_listed_and_replayed(tmp_path):
    client = _client(_server(tmp_path))
    assert client.get("/api/runs").json() == []
    with closing(_journal(tmp_path / "runs" / "quick-001")) as journal:
        run_mission(str(_quick(tmp_path)), nxt="sim://open", camera="geometric", observers=[journal])
    (listed,) = client.get("/api/runs").json()
    assert (listed["name"], listed["ending"], listed["map"]) == ("quick-001", "achieved", False)
    replay = client.get("/api/runs/quick-001").json()
    assert [each["kind"] for each in replay["records"]][:2] == ["start", "transition"]
    assert "lena reached" in replay["lines"][-2]["text"]
    assert replay["lines"][-1]["text"] == "achieved"
    assert replay["decisions"] == []
    assert client.get("/runs/quick-001/journal.jsonl").status_code == 200
    for path in (
        "/api/runs/nosuch",
        "/runs/quick-001/map.png",
        "/runs/quick-001/secret",
        "/runs/../quick.toml/journal.jsonl",
    ):
        assert client.get(path).status_code == 404


def test_a_damaged_run_is_listed_and_its_replay_says_why_not(tmp_path):
    folder = tmp_path / "runs" / "broken-001"
    folder.mkdir(parents=True)
    (folder / "journal.jsonl").write_text("nonsense\n", encoding="utf-8")
    (folder / "summary.json").write_text("[]", encoding="utf-8")
    client = _client(_server(tmp_path))
    assert [each["ending"] for each in client.get("/api/runs").json()] == ["unreadable"]
    answer = client.get("/api/runs/broken-001")
    assert answer.status_code == 422
    assert "not a journal" in answer.text


@pytest.mark.slow
@pytest.mark.parametrize("end", ["stop", "end_task"])
def test_a_mission_that_has_not_begun_can_be_ended(tmp_path, end):
    server = _server(tmp_path, "sim://open?pace=fast")
    with _client(server).websocket_connect("/ws") as page:
        server.robot.start_mission(read_mission_file(_quick(tmp_path)), confirm=False)
        getattr(server.robot, end)()
        server.robot.open()
        try:
            assert _until(page, lambda each: each["type"] == "ended")["ending"] == "interrupted"
        finally:
            server.robot.close()


@pytest.mark.nightly
def test_a_mission_of_the_page_leaves_arrivals_and_hints(tmp_path):
    text = QUICK.replace("\n[target.lena]", "\ntime_limit_s = 20\n[target.lena]").replace("lena", "rilakkuma")
    (tmp_path / "other.toml").write_text(text, encoding="utf-8")
    _quick(tmp_path)
    with _running(tmp_path, "sim://open?pace=fast") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission", "mission": "quick.toml"})
        (arrival,) = _until(page, lambda each: each["type"] == "ended")["arrivals"]
        assert (arrival["target"], arrival["there"]) == ("lena", True)
        page.send_json({"type": "start_mission", "mission": "other.toml", "profile": "thesis"})
        hint = _until(page, lambda each: "hint: " in each.get("text", "") or each["type"] == "ended")
        assert "It has lena." in hint["text"]


@pytest.mark.slow
def test_a_run_that_cannot_be_recorded_is_reported_and_the_page_continues(tmp_path):
    _quick(tmp_path)
    (tmp_path / "runs").write_text("a file, no folder", encoding="utf-8")
    with _running(tmp_path, "sim://open?pace=fast") as client, client.websocket_connect("/ws") as page:
        for _ in range(2):
            page.send_json({"type": "start_mission", "mission": "quick.toml"})
            told = _until(page, lambda each: each["type"] in ("problem", "refused"))
            assert "cannot keep the run" in told["text"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("does", "error"), [("return {}['lamp']", "KeyError: 'lamp'"), ("raise SystemExit(3)", "SystemExit: 3")]
)
def test_an_exception_in_your_own_profile_is_reported_and_the_page_continues(does, error, tmp_path, monkeypatch):
    broken = "from behaviors.profiles.adaptive import AdaptiveProfile\nclass Odd(AdaptiveProfile):\n"
    (tmp_path / "odd_on_page.py").write_text(f"{broken}    def skill(self, *_): {does}\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "odd_on_page", raising=False)
    monkeypatch.setattr(registry, "external_profiles", {})
    text = QUICK.replace("[target.lena]", 'profile = "odd_on_page:Odd"\n[target.lena]')
    (tmp_path / "quick.toml").write_text(text, encoding="utf-8")
    with _running(tmp_path, "sim://open?pace=fast") as client, client.websocket_connect("/ws") as page:
        for _ in range(2):
            page.send_json({"type": "start_mission", "mission": "quick.toml"})
            told = _until(page, lambda each: each["type"] in ("problem", "refused"))
            assert f"failed at {tmp_path / 'odd_on_page.py'}:3: {error}" in told["text"]


@pytest.mark.slow
def test_a_paused_mission_that_is_ended_does_not_continue_first(tmp_path):
    with _running(tmp_path, "sim://?pace=fast") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission"})
        _until(page, lambda each: each["type"] == "record" and each["record"]["kind"] == "look")
        page.send_json({"type": "pause"})
        _until(page, lambda each: each["type"] == "line" and each["text"].endswith("paused"))
        page.send_json({"type": "stop_mission"})
        seen: list[str] = []
        ended = _until(page, lambda each: seen.append(each.get("text", "")) or each["type"] == "ended")
    assert ended["ending"] == "interrupted"
    assert not [text for text in seen if "resumed" in text]
