"""``nxtdrive run``, as a user runs it."""

from __future__ import annotations

import json
import os
import pty
import signal
import sys
import time
from pathlib import Path

import cv2
import pytest

import nxtdrive
from behaviors.mission import MissionTable
from behaviors.profile_names import BUILT_IN_PROFILES
from behaviors.profiles.registry import PROFILES
from nxtdrive.cli.main import main
from nxtdrive.recording.camera_index import read_frames
from tests.small_mission import MISSION

FILES = ["camera", "camera.webm", "journal.jsonl", "map.png", "mission.json", "summary.json"]

UNSEEN = "--camera", "geometric", "--no-video"
"""Where what the robot sees does not matter."""


def _run(*arguments: str) -> tuple[int, Path]:
    """Run a mission into ``runs`` of the present folder; the exit code and the run folder."""
    code = main(["run", *arguments])
    return code, next(Path("runs").iterdir())


def _journal(folder: Path) -> list[dict]:
    return [json.loads(line) for line in (folder / "journal.jsonl").read_text(encoding="utf-8").splitlines()]


pytestmark = pytest.mark.usefixtures("here")


@pytest.fixture
def small(tmp_path) -> str:
    """A mission that ends soon in world open."""
    path = tmp_path / "small.toml"
    path.write_text(MISSION, encoding="utf-8")
    return str(path)


@pytest.mark.slow
def test_the_built_in_mission_shows_every_behaviour_in_one_go(capsys):
    code, folder = _run("--console", "thesis", "--no-video")
    assert code == 0
    lines = capsys.readouterr().out.splitlines()
    said = [line for line in lines if line.startswith("[client2] ")]
    assert said[:3] == ["[client2] Connecting to NXT", "[client2] Arriving at lena", "[client2] Failed"]
    assert "[client2] change target!" in said
    entered = [record["to"] for record in _journal(folder) if record["kind"] == "transition"]
    assert {"move_to", "wait", "left", "reached"} <= set(entered)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["achieved"] is True
    assert summary["nxtdrive"] == nxtdrive.__version__
    assert [target["outcome"] for target in summary["targets"]] == ["reached", "reached"]
    assert cv2.imread(str(folder / "map.png")) is not None


@pytest.mark.slow
def test_a_run_leaves_its_pictures_and_a_video_of_its_length(capsys, small):
    code, folder = _run(small, "--nxt", "sim://open")
    assert code == 0
    assert sorted(path.name for path in folder.iterdir()) == FILES
    assert [str(folder / name) for name in FILES] == capsys.readouterr().out.splitlines()[-6:]
    duration_s = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["duration_s"]
    film = cv2.VideoCapture(str(folder / "camera.webm"))
    shown_s = film.get(cv2.CAP_PROP_FRAME_COUNT) / film.get(cv2.CAP_PROP_FPS)
    film.release()
    assert shown_s == pytest.approx(duration_s, abs=0.5)
    recorded = read_frames(folder)
    assert len(recorded.frames) == pytest.approx(duration_s * 5, rel=0.05)
    sightings = [(each.t, look.sighting.box) for each in recorded.frames for look in each.looks if look.sighting]
    looks = [record for record in _journal(folder) if record["kind"] == "look" and record["sighting"]]
    assert looks
    for record in looks:
        near = [box for t, box in sightings if abs(record["t"] - t) < 0.3]
        assert near, f"no picture shows the sighting at {record['t']}"


@pytest.mark.slow
def test_json_is_one_record_a_line_and_a_summary_at_the_end(capsys, small):
    code, folder = _run(small, "--nxt", "sim://open", *UNSEEN, "--json")
    assert code == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[:-1] == _journal(folder)
    assert lines[-1]["kind"] == "summary"
    assert lines[-1]["folder"] == str(folder)
    assert not [path for path in folder.iterdir() if path.name.startswith("camera")]


@pytest.mark.slow
def test_a_mission_that_is_not_achieved_ends_with_one(small):
    mission = Path(small)
    mission.write_text(MISSION.replace("lena", "rilakkuma") + "[thesis]\nmax_researches = 0\n", encoding="utf-8")
    code, folder = _run(small, "--nxt", "sim://open", *UNSEEN, "--profile", "thesis")
    assert code == 1
    assert _journal(folder)[-1]["ending"] == "given_up"


def test_a_target_that_is_pending_at_the_end_is_not_reached(capsys, small):
    mission = Path(small)
    mission.write_text(MISSION.replace("[target", "time_limit_s = 1\n\n[target", 1), encoding="utf-8")
    code, _ = _run(small, "--nxt", "sim://open", *UNSEEN)
    assert code == 1
    assert "lena: not reached, searches: 1" in capsys.readouterr().out


@pytest.mark.slow
def test_the_policy_can_be_chosen_whatever_the_mission_says(capsys, small):
    hard = Path(small)
    hard.write_text(MISSION.replace("targets", 'profile = "thesis"\ntargets'), encoding="utf-8")
    code, folder = _run(small, "--nxt", "sim://figure6", *UNSEEN, "--policy", "adaptive")
    assert code == 0
    assert json.loads((folder / "mission.json").read_text(encoding="utf-8"))["mission"]["profile"] == "adaptive"
    first = next(record for record in _journal(folder) if record["kind"] == "choice")
    assert "spent_s" in first["evidence"]
    assert f": {first['why']}" in capsys.readouterr().out


def test_a_run_that_is_recorded_names_the_brick_it_connects_to(capsys, small):
    _run(small, "--nxt", "sim://open", *UNSEEN, "--trace", "run.nxttrace")
    assert capsys.readouterr().out.splitlines()[0] == "connecting to sim://open"


def test_mission_files_may_name_every_profile_there_is():
    for profile in PROFILES:
        assert MissionTable(targets=["tag"], profile=profile).profile == profile
    assert tuple(PROFILES) == BUILT_IN_PROFILES


@pytest.mark.slow
def test_a_mission_that_names_no_profile_is_pursued_adaptively(small):
    _, folder = _run(small, "--nxt", "sim://open", *UNSEEN)
    assert json.loads((folder / "mission.json").read_text(encoding="utf-8"))["mission"]["profile"] == "adaptive"


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (["nowhere.toml"], 2, "nowhere.toml: cannot be read"),
        (["--nxt", "usbb://"], 2, "usb"),
        (["--nxt", "sim://nowhere"], 2, "nowhere"),
        (["--nxt", "sim://?sede=7"], 2, "sede"),
        (["--camera", "nowhere.mp4"], 2, "nowhere.mp4"),
        (["--nxt", "serial:///dev/nowhere", "--camera", "sim"], 3, "/dev/nowhere"),
        (["--nxt", "tcp://127.0.0.1:9", "--camera", "sim"], 3, "127.0.0.1"),
    ],
)
def test_bad_input_is_one_sentence_and_nothing_moves(capsys, arguments, code, sentence):
    assert main(["run", *arguments]) == code
    printed = capsys.readouterr()
    assert sentence in printed.err
    assert printed.err.startswith("nxtdrive: ")
    assert "Traceback" not in printed.err
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("addition", "sentence"),
    [
        ("[robot]\nleft = 'B'\nright = 'B'\n", "left and right both use port B"),
        ("[thesis]\nwait = 15\n", "did you mean 'wait_s'"),
        ("[thesis]\nadvance_mm = 0.15\n", "advance_mm is a number in millimetres"),
    ],
)
def test_mistakes_in_a_mission_file_are_reported_before_anything_moves(refused, small, addition, sentence):
    Path(small).write_text(MISSION + addition, encoding="utf-8")
    assert sentence in refused("run", small)
    assert not Path("runs").exists()


@pytest.mark.slow
def test_a_brick_that_says_nothing_is_reported_after_two_seconds(capsys):
    master, slave = pty.openpty()
    try:
        code = main(["run", "--nxt", f"serial://{os.ttyname(slave)}", "--camera", "sim"])
    finally:
        os.close(master)
        os.close(slave)
    assert code == 4
    assert "was not answered within 2 s" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_ctrl_c_leaves_a_complete_folder(started, tmp_path, number):
    process = started("run", "--nxt", "sim://?pace=realtime")
    assert process.stdout.readline() == "connecting to sim://?pace=realtime\n"
    assert process.stdout.readline() == "    0.0 s  searching for lena\n"
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "Traceback" not in errors
    folder = next((tmp_path / "runs").iterdir())
    left = {path.name for path in folder.iterdir()}
    assert set(FILES) - {"camera", "camera.webm"} == left - {"camera"}, "it may end before the first picture"
    assert _journal(folder)[-1]["ending"] == "interrupted"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs signals")
def test_ctrl_c_while_the_video_is_made_leaves_only_the_video_out(started, tmp_path, small):
    process = started("run", small, "--nxt", "sim://open", "--camera", "geometric")
    while not list(tmp_path.glob("runs/*/.draft-*.mkv")):
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    said, errors = process.communicate(timeout=60)
    assert process.returncode == 0, "the mission was achieved"
    assert "achieved after" in said
    (folder,) = (tmp_path / "runs").iterdir()
    assert set(FILES) - {"camera.webm"} == {path.name for path in folder.iterdir()}
    assert errors == f"nxtdrive: camera.webm is left out; `nxtdrive export runs/{folder.name} --webm` makes it.\n"
