"""Calibrations from the page: progress, questions, end, STOP, and the robot file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient, WebSocketTestSession

from behaviors.mission.robot import load_robot_file
from nxtdrive.mission.files import read_mission_file
from nxtdrive.tools.web import calibration
from nxtdrive.tools.web.app import Server
from nxtdrive.tools.web.calibration import Calibrations
from nxtdrive.tools.web.hub import Hub
from nxtdrive.tools.web.missions import Missions
from nxtdrive.tools.web.robot import Robot
from nxtdrive.tools.web.runs import Runs
from nxtdrive.transports.address import Address

FAST = "sim://calibration?pace=fast"
MOTORS = {"type": "start_calibration", "what": ["motors"]}
RULER = {"type": "start_calibration", "how": "ruler"}


@contextmanager
def _page(folder: Path, address: str = FAST) -> Iterator[WebSocketTestSession]:
    hub, missions = Hub(), Missions(folder)
    robot = Robot(Address.parse(address), None, read_mission_file(None), hub, folder / "runs")
    calibrations = Calibrations(hub, folder / "robot.toml", missions.use)
    server = Server(robot, hub, missions, Runs(folder / "runs"), address, calibrations=calibrations)
    robot.open()
    try:
        with TestClient(server.app(), headers={"host": "127.0.0.1:7080"}).websocket_connect("/ws") as page:
            yield page
    finally:
        robot.close()


def _until(page: WebSocketTestSession, kind: str, **wanted: object) -> dict[str, Any]:
    """Return the next message of a kind with these values; those that are true stand for any true one."""
    while True:
        text = page.receive().get("text")
        message = json.loads(text) if text else {}
        if message.get("type") == kind and all(
            bool(message[key]) if value is True else message[key] == value for key, value in wanted.items()
        ):
            return message


@pytest.mark.slow
def test_motors_are_calibrated_and_saved(tmp_path):
    with _page(tmp_path) as page:
        assert "none yet" in _until(page, "calibration")["known"]
        page.send_json({"type": "save_calibration"})
        assert "Nothing has been measured" in _until(page, "refused")["text"]
        page.send_json(MOTORS)
        found = _until(page, "calibration", running=False, values=True)
        assert found["lines"] == ["turning each wheel"]
        assert {each["key"]: each["after"] for each in found["values"]} == {
            "robot.left_reversed": False,
            "robot.right_reversed": False,
            "motors.dead_zone_percent": 8.0,
        }
        assert not (tmp_path / "robot.toml").exists()
        page.send_json({"type": "save_calibration"})
        assert "motors 20" in _until(page, "calibration", saved=True)["known"]
    assert load_robot_file(tmp_path / "robot.toml").calibration.motors is not None


@pytest.mark.slow
def test_a_ruler_asks_on_the_page(tmp_path):
    answers = iter([0.0, 1030.0, 0.0, 12.0, 0.0])
    with _page(tmp_path, "sim://open?pace=fast") as page:
        page.send_json(RULER)
        asked = 0
        for answer in answers:
            question = _until(page, "calibration", running=True, question=True)["question"]
            while question["question"] == asked:
                question = _until(page, "calibration", running=True, question=True)["question"]
            asked = question["question"]
            page.send_json({"type": "answer_calibration", "question": asked, "value": answer})
        found = _until(page, "calibration", running=False, values=True)
    after = {each["key"]: each["after"] for each in found["values"]}
    assert after["robot.wheel_diameter_mm"] == pytest.approx(56 * 1.03, rel=0.01)


def test_a_colour_is_learned(tmp_path):
    with _page(tmp_path, "sim://colors?pace=fast") as page:
        page.send_json({"type": "start_calibration", "how": "color", "color": "red"})
        assert "not red" in _until(page, "calibration", running=False, problem=True)["problem"]
        page.send_json({"type": "start_calibration", "how": "color"})
        assert "100% now" in _until(page, "calibration", running=False, values=True)["remark"]
        page.send_json({"type": "save_calibration"})
        _until(page, "calibration", saved=True)
    assert load_robot_file(tmp_path / "robot.toml").color["green"].hue_deg == pytest.approx(127, abs=8)


@pytest.mark.parametrize("ending", ["stop", "stop_mission"])
def test_a_calibration_is_ended_while_the_robot_moves(tmp_path, ending):
    with _page(tmp_path, "sim://calibration?pace=realtime") as page:
        page.send_json({"type": "start_calibration", "what": ["camera"]})
        _until(page, "calibration", running=True, lines=True)
        page.send_json({"type": "start_mission"})
        assert "A calibration is running" in _until(page, "refused")["text"]
        page.send_json({"type": ending})
        assert "ended" in _until(page, "calibration", running=False, problem=True)["problem"]
        assert _until(page, "state", doing="stopped until released" if ending == "stop" else "at rest")
    assert not (tmp_path / "robot.toml").exists()


def test_what_is_refused_is_reported(tmp_path):
    with _page(tmp_path, "sim://open?pace=fast") as page:
        page.send_json(MOTORS)
        assert "sees no marker" in _until(page, "calibration", running=False, problem=True)["problem"]


def test_a_defect_of_a_calibration_is_reported_and_the_page_continues(tmp_path, monkeypatch):
    monkeypatch.setattr(calibration, "calibrate", lambda *_: 1 / 0)
    with _page(tmp_path) as page:
        for _ in range(2):
            page.send_json(MOTORS)
            problem = _until(page, "calibration", running=False, problem=True)["problem"]
            assert "ZeroDivisionError: division by zero. This is a bug in nxtdrive. Please report it" in problem


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({**MOTORS, "what": []}, "what"),
        ({**MOTORS, "what": ["windows"]}, "what"),
        ({**MOTORS, "sheet_height_mm": -1}, "sheet_height_mm"),
        ({"type": "start_calibration", "how": "color", "color": "mauve"}, "color"),
        (MOTORS, "robot.radius_mm"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, message, said):
    (tmp_path / "robot.toml").write_text("[robot]\nradius_mm = -1\n")
    with _page(tmp_path) as page:
        page.send_json(message)
        assert said in _until(page, "refused")["text"]


def test_the_sheet_can_be_fetched(tmp_path):
    server = Server(
        Robot(Address.parse(FAST), None, read_mission_file(None), Hub(), tmp_path),
        Hub(),
        Missions(tmp_path),
        Runs(tmp_path),
        FAST,
    )
    got = TestClient(server.app(), headers={"host": "127.0.0.1:7080"}).get("/api/sheet.pdf")
    assert got.content.startswith(b"%PDF")
    assert got.headers["content-type"] == "application/pdf"
