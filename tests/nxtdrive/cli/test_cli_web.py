"""``nxtdrive web``: mistakes are reported before anything is opened."""

from __future__ import annotations

import signal
import threading

import pytest

from nxtdrive.cli.main import main
from nxtdrive.tools.web.hub import Hub
from nxtdrive.tools.web.missions import Missions


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--classroom", "0"], "1 to 30 robots"),
        (["--classroom", "nosuch.toml"], "nosuch.toml"),
        (["--classroom", "2", "--camera", "0"], "for one robot"),
        (["--classroom", "2", "--nxt", "usb://"], "for one robot"),
        (["--classroom", "2", "--robot", "nosuch.toml"], "nosuch.toml"),
        (["--mission", "nosuch.toml"], "nosuch.toml"),
        (["--mission", ""], "is a folder"),
        (["--folder", "nosuch"], "there is no folder nosuch"),
        (["--out", f"{__file__}/runs"], "cannot keep the run there"),
        (["--classroom", "2", "--out", __file__], "cannot keep the run there"),
    ],
)
def test_mistakes_are_reported(arguments, says, refused):
    assert says in refused("web", "--port", "0", *arguments)


def test_all_mistakes_of_a_classroom_are_reported_at_once(tmp_path, refused):
    file = tmp_path / "classroom.toml"
    file.write_text('[[robot]]\nname = "Ada"\nnxt = "usv://"\n[[robot]]\nname = ""\ncolor = 3\n', encoding="utf-8")
    error = refused("web", "--port", "0", "--classroom", file)
    assert "3 mistakes" in error
    for part in ("robot[0].nxt", "robot[1].name", "robot[1].color"):
        assert part in error


def test_a_mission_is_no_classroom(tmp_path, capsys):
    file = tmp_path / "m1.toml"
    file.write_text('[mission]\ntargets = ["lena"]\n', encoding="utf-8")
    assert main(["web", "--port", "0", "--classroom", str(file)]) == 2
    assert "is a mission file, not a classroom. Choose the mission on the page" in capsys.readouterr().err


def test_the_robot_file_of_the_folder_is_used(tmp_path, refused):
    (tmp_path / "robot.toml").write_text("[robot]\nradius_mm = 1\n", encoding="utf-8")
    said = refused("web", "--port", "0", "--folder", tmp_path)
    assert "robot.radius_mm" in said
    assert "NXT_ROBOT" not in said


def test_the_robot_file_of_the_environment_comes_before_that_of_the_folder(tmp_path, monkeypatch, refused):
    (tmp_path / "robot.toml").write_text("[robot]\nradius_mm = 1\n", encoding="utf-8")
    named = tmp_path / "named.toml"
    named.write_text("[robot]\naxle_track_mm = 1\n", encoding="utf-8")
    monkeypatch.setenv("NXT_ROBOT", str(named))
    said = refused("web", "--port", "0", "--folder", tmp_path)
    assert "robot.axle_track_mm" in said
    assert "radius_mm" not in said


def test_a_missions_folder_is_that_of_its_file(tmp_path, refused):
    (tmp_path / "robot.toml").write_text("[robot]\nradius_mm = 1\n", encoding="utf-8")
    mission = tmp_path / "m1.toml"
    mission.write_text('[mission]\ntargets = ["tag"]\n[target.tag]\ndetector = "marker"\nid = 7\n', encoding="utf-8")
    assert "robot.radius_mm" in refused("web", "--port", "0", "--mission", mission)


def test_a_usual_robot_file_comes_after_that_of_the_mission(tmp_path):
    usual = tmp_path / "robot.toml"
    usual.write_text("[robot]\nwheel_diameter_mm = 43\n", encoding="utf-8")
    (tmp_path / "other.toml").write_text("[robot]\nwheel_diameter_mm = 81\n", encoding="utf-8")
    text = '[mission]\ntargets = ["tag"]\n{}[target.tag]\ndetector = "marker"\nid = 7\n'
    (tmp_path / "plain.toml").write_text(text.format(""), encoding="utf-8")
    (tmp_path / "own.toml").write_text(text.format('robot_file = "other.toml"\n'), encoding="utf-8")
    missions = Missions(tmp_path, default=usual)
    diameters = [missions.load(name).robot.wheel_diameter_mm for name in ("", "plain.toml", "own.toml")]
    assert diameters == [43, 43, 81]


@pytest.mark.parametrize("hangs", [False, True])
def test_the_end_says_whether_the_robot_has_been_closed(hangs, monkeypatch, capsys):
    released, show = threading.Event(), Hub.show

    def interrupt(hub, kind, values):
        show(hub, kind, values)
        if kind == "state" and not released.is_set():
            signal.raise_signal(signal.SIGINT)  # Ctrl-C, and the robot's thread is here meanwhile
            if hangs:
                released.wait(60)
            released.set()

    monkeypatch.setattr(Hub, "show", interrupt)
    monkeypatch.setattr("nxtdrive.tools.web.robot.CLOSE_S", 0.05 if hangs else 60)
    try:
        assert main(["web", "--port", "0", "--nxt", "sim://open?pace=fast", "--camera", "geometric"]) == 0
    finally:
        released.set()
    end = "no answer from the robot, whose brick stops its motors itself" if hangs else "motors off"
    assert capsys.readouterr().out.endswith(f"ended; {end}\n")


def test_a_room_in_which_the_robot_cannot_succeed_is_warned_of_at_the_start(tmp_path, monkeypatch, capsys):
    world = tmp_path / "odd.toml"
    world.write_text("[floor]\nsize_mm = [400, 300]\n[robot]\nstart_mm = [150, 150]\n", encoding="utf-8")
    ended, show = threading.Event(), Hub.show

    def interrupt(hub, kind, values):
        show(hub, kind, values)
        if kind == "state" and not ended.is_set():
            ended.set()
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Hub, "show", interrupt)
    assert main(["web", "--port", "0", "--nxt", f"sim://{world}?pace=fast", "--camera", "geometric"]) == 0
    assert capsys.readouterr().err.startswith(f"nxtdrive: warning: {world}: floor.size_mm: the room is tiny")


@pytest.mark.parametrize(("mission", "proposed"), [("cat.toml", "cat.toml"), ("other/cat.toml", ""), (None, "")])
def test_the_mission_is_proposed_if_it_is_in_the_folder(mission, proposed, tmp_path):
    (tmp_path / "other").mkdir()
    for each in ("cat.toml", "other/cat.toml"):
        (tmp_path / each).write_text("[mission]\n", encoding="utf-8")
    path = tmp_path / mission if mission else None
    assert Missions(tmp_path / "other" / "..", mission=path).proposed == proposed
