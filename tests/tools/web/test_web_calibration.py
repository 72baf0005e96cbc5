"""Calibrations from the page: progress, questions, end, STOP, and the robot file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from starlette.testclient import WebSocketTestSession

from behaviors.mission.robot import load_robot_file
from nxtdrive.tools.web import calibration
from nxtdrive.tools.web.calibration import Calibrations
from tests.tools.web.pages import client_of, refusal, server_of, told

FAST = "sim://calibration?pace=fast"
MOTORS = {"type": "start_calibration", "what": ["motors"]}
RULER = {"type": "start_calibration", "how": "ruler"}


@contextmanager
def _page(folder: Path, address: str = FAST) -> Iterator[WebSocketTestSession]:
    server = server_of(folder, address)
    server.calibrations = Calibrations(server.hub, folder / "robot.toml", server.missions.use)
    with closing(server.robot):
        server.robot.open()
        with client_of(server).websocket_connect("/ws") as page:
            yield page


@pytest.mark.slow
def test_motors_are_calibrated_and_saved(tmp_path):
    with _page(tmp_path) as page:
        assert "none yet" in told(page, "calibration")["known"]
        page.send_json({"type": "save_calibration"})
        assert "Nothing has been measured" in refusal(page)
        page.send_json(MOTORS)
        found = told(page, "calibration", running=False, values=True)
        assert found["lines"] == ["turning each wheel"]
        assert {each["key"]: each["after"] for each in found["values"]} == {
            "robot.left_reversed": False,
            "robot.right_reversed": False,
            "motors.dead_zone_percent": 8.0,
        }
        assert not (tmp_path / "robot.toml").exists()
        page.send_json({"type": "save_calibration"})
        assert "motors 20" in told(page, "calibration", saved=True)["known"]
    assert load_robot_file(tmp_path / "robot.toml").calibration.motors is not None


@pytest.mark.slow
def test_a_ruler_asks_on_the_page(tmp_path):
    answers = iter([0.0, 1030.0, 0.0, 12.0, 0.0])
    with _page(tmp_path, "sim://open?pace=fast") as page:
        page.send_json(RULER)
        asked = 0
        for answer in answers:
            question = told(page, "calibration", running=True, question=True)["question"]
            while question["question"] == asked:
                question = told(page, "calibration", running=True, question=True)["question"]
            asked = question["question"]
            page.send_json({"type": "answer_calibration", "question": asked, "value": answer})
        found = told(page, "calibration", running=False, values=True)
    after = {each["key"]: each["after"] for each in found["values"]}
    assert after["robot.wheel_diameter_mm"] == pytest.approx(56 * 1.03, rel=0.01)


def test_a_colour_is_learned(tmp_path):
    with _page(tmp_path, "sim://colors?pace=fast") as page:
        page.send_json({"type": "start_calibration", "how": "color", "color": "red"})
        assert "not red" in told(page, "calibration", running=False, problem=True)["problem"]
        page.send_json({"type": "start_calibration", "how": "color"})
        assert "100% now" in told(page, "calibration", running=False, values=True)["remark"]
        page.send_json({"type": "save_calibration"})
        told(page, "calibration", saved=True)
    assert load_robot_file(tmp_path / "robot.toml").color["green"].hue_deg == pytest.approx(127, abs=8)


@pytest.mark.parametrize("ending", ["stop", "stop_mission"])
def test_a_calibration_is_ended_while_the_robot_moves(tmp_path, ending):
    with _page(tmp_path, "sim://calibration?pace=realtime") as page:
        page.send_json({"type": "start_calibration", "what": ["camera"]})
        told(page, "calibration", running=True, lines=True)
        page.send_json({"type": "start_mission"})
        assert "A calibration is running" in refusal(page)
        page.send_json({"type": ending})
        assert "ended" in told(page, "calibration", running=False, problem=True)["problem"]
        assert told(page, "state", doing="stopped until released" if ending == "stop" else "at rest")
    assert not (tmp_path / "robot.toml").exists()


def test_what_is_refused_is_reported(tmp_path):
    with _page(tmp_path, "sim://open?pace=fast") as page:
        page.send_json(MOTORS)
        assert "sees no marker" in told(page, "calibration", running=False, problem=True)["problem"]


def test_a_defect_of_a_calibration_is_reported_and_the_page_continues(tmp_path, monkeypatch):
    monkeypatch.setattr(calibration, "calibrate", lambda *_: 1 / 0)
    with _page(tmp_path) as page:
        for _ in range(2):
            page.send_json(MOTORS)
            problem = told(page, "calibration", running=False, problem=True)["problem"]
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
        assert said in refusal(page)


def test_the_sheet_can_be_fetched(tmp_path):
    got = client_of(server_of(tmp_path)).get("/api/sheet.pdf")
    assert got.content.startswith(b"%PDF")
    assert got.headers["content-type"] == "application/pdf"
