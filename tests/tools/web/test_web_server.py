"""The server by its test client: the page, the WebSocket, the guard, driving, a mission on a simulated robot."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from itertools import chain, repeat
from pathlib import Path

import pytest
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from behaviors.journal import Record, RecordKind
from behaviors.profiles import registry
from nxtdrive import run_mission
from nxtdrive.mission.files import read_mission_file
from nxtdrive.recording.run_folder import RunFolder
from nxtdrive.tools.web.hub import Hub
from nxtdrive.tools.web.mission_run import ShownMission, doing
from nxtdrive.tools.web.page_socket import MAX_CLIENTS
from nxtdrive.tools.web.robot import Robot
from tests.small_mission import with_table
from tests.tools.web.pages import client_of, next_message, refusal, server_of, told

REALTIME = "sim://open?pace=realtime"
QUICK = '[mission]\nname = "quick"\ntargets = ["lena"]\n[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'


def _quick(folder: Path) -> Path:
    (folder / "quick.toml").write_text(QUICK, encoding="utf-8")
    return folder / "quick.toml"


def _journal(folder: Path) -> RunFolder:
    folder.mkdir(parents=True)
    return RunFolder(folder)


@contextmanager
def _running(folder: Path, address: str = REALTIME, camera: str | None = None) -> Iterator[TestClient]:
    server = server_of(folder, address, camera)
    with closing(server.robot):
        server.robot.open()
        yield client_of(server)


def _drive(page: WebSocketTestSession) -> None:
    """Drive ahead, from the centre."""
    for ahead in (0, 1):
        page.send_json({"type": "drive", "ahead": ahead, "turn": 0})


def test_the_page_and_its_parts_are_served_and_need_nothing_from_elsewhere(tmp_path):
    client = client_of(server_of(tmp_path))
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
    client = client_of(server_of(tmp_path))
    assert client.get("/", headers=headers).status_code == 403
    with pytest.raises(WebSocketDisconnect), client.websocket_connect("/ws", headers=headers):
        pass


@pytest.mark.parametrize("path", ["/", "/missions.html", "/api/missions", "/nothing"])
def test_no_page_is_shown_in_a_frame_of_another_site(tmp_path, path):
    policy = client_of(server_of(tmp_path)).get(path).headers["content-security-policy"]
    assert policy == "frame-ancestors 'none'"


@pytest.mark.parametrize("path", ["/", "/app.js", "/api/runs"])
def test_browsers_ask_again_for_what_another_version_may_have_changed(tmp_path, path):
    assert client_of(server_of(tmp_path)).get(path).headers["cache-control"] == "no-cache"


def test_a_page_is_greeted_with_what_it_draws(tmp_path):
    (tmp_path / "cat.toml").write_text(QUICK, encoding="utf-8")
    (tmp_path / "room.toml").write_text("[world]\n", encoding="utf-8")
    (tmp_path / os.fsdecode(b"caf\xe9.toml")).write_text(QUICK, encoding="utf-8")  # a name that JSON cannot say
    with client_of(server_of(tmp_path)).websocket_connect("/ws") as page:
        hello = page.receive_json()
    assert hello["version"] == 1
    assert hello["missions"] == ["cat.toml"]
    assert hello["proposed"] == ""
    assert hello["profiles"] == ["thesis", "adaptive"]
    regions = {region["state"]: {each["state"] for each in region["inner"]} for region in hello["chart"]["regions"]}
    assert {"mission", "equipment", "safety", "camera", "floor_map", "wheels"} == set(regions)
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
    with client_of(server_of(tmp_path)).websocket_connect("/ws") as page:
        page.send_text(message)
        assert says in refusal(page)


def test_the_mistakes_of_a_mission_are_reported(tmp_path):
    (tmp_path / "bad.toml").write_text(QUICK.replace("lena.png", "nosuch.png"), encoding="utf-8")
    with client_of(server_of(tmp_path)).websocket_connect("/ws") as page:
        page.send_text('{"type": "start_mission", "mission": "bad.toml"}')
        assert "nosuch.png" in refusal(page)


def test_a_sensor_that_does_not_answer_is_named_and_tried_again(tmp_path):
    server = server_of(tmp_path, REALTIME)
    built = read_mission_file(None)
    server.robot.rebuild(with_table(built, "robot", ultrasonic=3))  # it is on 4
    with closing(server.robot):
        server.robot.open()
        with client_of(server).websocket_connect("/ws") as page:
            assert "cable" in told(page, "link", lost=True)["lost"]
            server.robot.rebuild(built)
            told(page, "state", range_mm=True)
        assert server.robot.alive


def test_there_is_a_limit_to_the_number_of_pages(tmp_path):
    server = server_of(tmp_path)
    client = client_of(server)
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
        _drive(page)
        assert told(page, "state", doing="driving")
        other.send_json({"type": "drive", "ahead": -1, "turn": 0})
        assert "(page 1) drives" in refusal(other)
        # no further sign of the driver: the dead-man switch stops
        stopped = told(page, "state", doing="at rest")
        assert 20 < stopped["pose"][0] < 400


def test_a_driver_is_asked_to_begin_at_the_centre(tmp_path):
    with client_of(server_of(tmp_path)).websocket_connect("/ws") as page:
        page.send_json({"type": "drive", "ahead": 1, "turn": 0})
        assert "sends zeros once" in refusal(page)


def test_a_driver_that_leaves_stops_the_robot_at_once(tmp_path):
    server = server_of(tmp_path)
    with client_of(server).websocket_connect("/ws") as page:
        _drive(page)
        page.send_text("no message")
        refusal(page)
        assert server.robot.controls.wanted(0.0)[0] > 0
    assert server.robot.controls.wanted(0.0) == (0.0, 0.0)


def test_a_driver_that_hands_over_stops_the_robot_and_a_pad_held_meanwhile_does_not_drive(tmp_path):
    server = server_of(tmp_path)
    with client_of(server) as client, client.websocket_connect("/ws") as page, client.websocket_connect("/ws") as other:

        def drive(which: WebSocketTestSession, ahead: float) -> float:
            which.send_json({"type": "drive", "ahead": ahead, "turn": 0})
            which.send_text("no message")
            next_message(which, lambda each: "Invalid JSON" in each.get("text", ""))
            return server.robot.controls.wanted(0.0)[0]

        drive(page, 0)
        assert drive(page, 1) > 0
        assert drive(other, -1) > 0, "it only asks for control"
        page.send_json({"type": "give_control"})
        told(other, "control", driver="page 2")
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
        _drive(page)
        other.send_json({"type": "stop"})
        told(page, "state", stopped=True)
        for asked in ({"type": "drive", "ahead": 1, "turn": 0}, {"type": "start_mission"}):
            page.send_json(asked)
            assert "stopped" in refusal(page)
        other.send_json({"type": "release"})
        told(page, "state", stopped=False)


@pytest.mark.slow
def test_who_drives_during_a_mission_gets_the_reason_why_the_robot_does_not_move(tmp_path):
    with _running(tmp_path) as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission"})
        told(page, "run")
        _drive(page)
        assert "A mission is running" in refusal(page)


@pytest.mark.slow
def test_a_mission_started_on_the_page_publishes_its_records_and_leaves_a_run_folder(tmp_path):
    _quick(tmp_path)
    with _running(tmp_path, "sim://open?pace=fast", "geometric") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission", "mission": "quick.toml"})
        assert told(page, "run")["name"] == "quick"
        assert told(page, "record")["record"]["kind"] == "start"
        ended = told(page, "ended")
    assert ended["achieved"]
    assert {"journal.jsonl", "summary.json", "map.png"} <= {
        path.name for path in (tmp_path / "runs" / ended["folder"]).iterdir()
    }


@pytest.mark.slow
def test_a_page_that_comes_during_a_mission_gets_the_whole_state(tmp_path):
    with _running(tmp_path, "sim://?pace=fast", "geometric") as client, client.websocket_connect("/ws") as page:
        before = told(page, "state", battery_mv=True)
        page.send_json({"type": "start_mission", "profile": "adaptive", "confirm": True})
        told(page, "question", open=True)
        with client.websocket_connect("/ws") as late:
            told(late, "run")
            status = told(late, "status")
        assert status.keys() == before.keys() - {"pose", "touching"}
        assert status["doing"] == "waiting for your choice: lena"
        assert [each["ending"] for each in client.get("/api/runs").json()] == ["running"]
        page.send_json({"type": "speed_limit", "percent": 40})
        page.send_json({"type": "answer", "question": 1, "choice": 0})
        assert told(page, "status", speed_limit=40)
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
        question = told(page, "question", open=True)
        assert len(question["candidates"]) > 1
        taken = 0
        page.send_json({"type": "answer", "question": question["number"], "choice": len(question["candidates"])})
        assert "numbered from 0" in refusal(page)
        if by_program:
            page.send_json({"type": "evidence"})
            said = told(page, "open_decision")
            assert (said["open"], said["question"]) == (True, question["number"])
            assert [each["does"] for each in said["candidates"]] == [each["text"] for each in question["candidates"]]
            page.send_json({"type": "choose", "number": len(said["candidates"])})
            assert "numbered from 0" in refusal(page)
            taken = len(said["candidates"]) - 1
            page.send_json({"type": "choose", "number": taken})
        else:
            page.send_json({"type": "answer", "question": question["number"], "choice": 0})
        choice = told(page, "record", kind="choice")
        assert choice["record"]["operator"] is True
        assert not by_program or choice["record"]["choice"] == said["candidates"][taken]["choice"]
        page.send_json({"type": "stop_mission"})
        assert told(page, "ended")["ending"] == "interrupted"


def test_without_a_mission_no_decision_is_open(tmp_path):
    with _running(tmp_path, "sim://?pace=fast") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "evidence"})
        assert told(page, "open_decision")["open"] is False
        page.send_json({"type": "choose", "number": 0})
        assert "No mission" in refusal(page)


@pytest.mark.parametrize(
    ("message", "says"), [({"type": "evidence"}, "open"), ({"type": "choose", "number": 0}, "text")]
)
def test_a_mission_may_end_while_a_message_about_its_decision_is_obeyed(tmp_path, monkeypatch, message, says):
    looks = chain(
        [ShownMission(read_mission_file(None), Hub(), confirm=True)], repeat(None)
    )  # ended at the second look
    monkeypatch.setattr(Robot, "mission", property(lambda _: next(looks)))
    with client_of(server_of(tmp_path)).websocket_connect("/ws") as page:
        page.send_json(message)
        assert next_message(page, lambda each: says in each)[says] in (False, "No decision is open.")


@pytest.mark.slow
def test_a_mission_is_paused_resumed_and_ended_while_it_is_paused(tmp_path):
    with _running(tmp_path, "sim://?pace=fast") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "pause"})
        assert "No mission" in refusal(page)
        page.send_json({"type": "start_mission"})
        for ends in ("resume", "stop_mission"):
            told(page, "record", kind="look")
            page.send_json({"type": "pause"})
            paused = told(page, "record", to="suspended")
            assert paused["record"]["reason"] == "operator_pause"
            page.send_json({"type": ends})
        assert told(page, "ended")["ending"] == "interrupted"


def test_runs_are_listed_and_replayed(tmp_path):
    client = client_of(server_of(tmp_path))
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
    client = client_of(server_of(tmp_path))
    assert [each["ending"] for each in client.get("/api/runs").json()] == ["unreadable"]
    answer = client.get("/api/runs/broken-001")
    assert answer.status_code == 422
    assert "not a journal" in answer.text


@pytest.mark.slow
@pytest.mark.parametrize("end", ["stop", "end_task"])
def test_a_mission_that_has_not_begun_can_be_ended(tmp_path, end):
    server = server_of(tmp_path, "sim://open?pace=fast")
    with client_of(server).websocket_connect("/ws") as page:
        server.robot.start_mission(read_mission_file(_quick(tmp_path)), confirm=False)
        getattr(server.robot, end)()
        with closing(server.robot):
            server.robot.open()
            assert told(page, "ended")["ending"] == "interrupted"


@pytest.mark.nightly
def test_a_mission_of_the_page_leaves_arrivals_and_hints(tmp_path):
    text = QUICK.replace("\n[target.lena]", "\ntime_limit_s = 20\n[target.lena]").replace("lena", "rilakkuma")
    (tmp_path / "other.toml").write_text(text, encoding="utf-8")
    _quick(tmp_path)
    with _running(tmp_path, "sim://open?pace=fast") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission", "mission": "quick.toml"})
        (arrival,) = told(page, "ended")["arrivals"]
        assert (arrival["target"], arrival["there"]) == ("lena", True)
        page.send_json({"type": "start_mission", "mission": "other.toml", "profile": "thesis"})
        hint = next_message(page, lambda each: "hint: " in each.get("text", "") or each["type"] == "ended")
        assert "It has lena." in hint["text"]


@pytest.mark.slow
def test_a_run_that_cannot_be_recorded_is_reported_and_the_page_continues(tmp_path):
    _quick(tmp_path)
    (tmp_path / "runs").write_text("a file, no folder", encoding="utf-8")
    with _running(tmp_path, "sim://open?pace=fast") as client, client.websocket_connect("/ws") as page:
        for _ in range(2):
            page.send_json({"type": "start_mission", "mission": "quick.toml"})
            said = next_message(page, lambda each: each["type"] in ("problem", "refused"))
            assert "cannot keep the run" in said["text"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("does", "error"), [("return {}['lamp']", "KeyError: 'lamp'"), ("raise SystemExit(3)", "SystemExit: 3")]
)
def test_an_exception_in_your_own_profile_is_reported_and_the_page_continues(does, error, here, monkeypatch):
    broken = "from behaviors.profiles.adaptive import AdaptiveProfile\nclass Odd(AdaptiveProfile):\n"
    (here / "odd_on_page.py").write_text(f"{broken}    def skill(self, *_): {does}\n", encoding="utf-8")
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "odd_on_page", raising=False)
    monkeypatch.setattr(registry, "external_profiles", {})
    text = QUICK.replace("[target.lena]", 'profile = "odd_on_page:Odd"\n[target.lena]')
    (here / "quick.toml").write_text(text, encoding="utf-8")
    with _running(here, "sim://open?pace=fast") as client, client.websocket_connect("/ws") as page:
        for _ in range(2):
            page.send_json({"type": "start_mission", "mission": "quick.toml"})
            said = next_message(page, lambda each: each["type"] in ("problem", "refused"))
            assert f"failed at {here / 'odd_on_page.py'}:3: {error}" in said["text"]


@pytest.mark.slow
def test_a_paused_mission_that_is_ended_does_not_continue_first(tmp_path):
    with _running(tmp_path, "sim://?pace=fast") as client, client.websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission"})
        told(page, "record", kind="look")
        page.send_json({"type": "pause"})
        next_message(page, lambda each: each["type"] == "line" and each["text"].endswith("paused"))
        page.send_json({"type": "stop_mission"})
        seen: list[str] = []
        ended = next_message(page, lambda each: seen.append(each.get("text", "")) or each["type"] == "ended")
    assert ended["ending"] == "interrupted"
    assert not [text for text in seen if "resumed" in text]
