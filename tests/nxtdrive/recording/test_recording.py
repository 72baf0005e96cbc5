"""The files of a run, from records alone."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest

from behaviors.executive import Ending, Report
from behaviors.journal import Record, RecordKind
from behaviors.observers import Observers
from behaviors.target_queue import TargetOutcome, TargetProgress
from firmware_protocol.errors import ConfigError
from nxtdrive.mission.files import read_mission_file
from nxtdrive.recording.camera_index import read_frames
from nxtdrive.recording.recording import Recording
from nxtdrive.recording.run_folder import new_run_folder
from nxtdrive.vision.camera import Frame


class _Clock:
    """Mission time began at 100 s."""

    def now(self):
        return 100.0

    def sleep(self, duration_s):
        raise AssertionError


START = Record(0.0, RecordKind.START, "idle", "lena", {"mission": "x"})


def _picture(time_s, value=0):
    """A frame of one colour, taken at a mission time."""
    return Frame(np.full((48, 64, 3), value, np.uint8), 100.0 + time_s, 0)


def _look(time_s, state, pose, range_mm=None):
    return Record(time_s, RecordKind.LOOK, state, "lena", {"pose": pose, "range_mm": range_mm, "sighting": None})


RECORDS = [
    _look(0.5, "search", [0.0, 0.0, 0.0], range_mm=500.0),
    _look(1.0, "arrive", [300.0, 0.0, 0.0]),
]


def _made(parent, mission):
    folder = new_run_folder(parent, mission)
    folder.close()
    return folder.path.name


@pytest.mark.parametrize(
    ("mission", "folder"),
    [
        ("Bär", "bär-001"),
        ("Αθήνα & Σπάρτη", "αθήνα-σπάρτη-001"),
        ("猫/../犬", "猫-犬-001"),
        ("हिन्दी", "हिन्दी-001"),
        ("Ba\u0308r", "bär-001"),
        ("a\u202e\x1b[31m\ud800b", "a-31m-b-001"),
        ("猫" * 100, "猫" * 26 + "-001"),
        ("...", "mission-001"),
        ("x" * 300, "x" * 80 + "-001"),
    ],
    ids=range(9),
)
def test_a_folder_is_named_by_the_letters_and_digits_of_the_mission(tmp_path, mission, folder):
    assert _made(tmp_path, mission) == folder


def test_a_file_system_without_a_letter_gets_a_name_without_it(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "getfilesystemencoding", lambda: "ascii")
    assert _made(tmp_path, "Bär und Löwe 2") == "b-r-und-l-we-2-001"


def test_run_folders_are_numbered_and_never_overwritten(tmp_path):
    first = new_run_folder(tmp_path, "Lena, then Rilakkuma!")
    second = new_run_folder(tmp_path, "Lena, then Rilakkuma!")
    first.close(), second.close()
    assert [first.path.name, second.path.name] == ["lena-then-rilakkuma-001", "lena-then-rilakkuma-002"]


def test_a_run_has_a_higher_number_than_all_before_it_also_where_some_were_removed(tmp_path):
    for name in ("x-002", "x-007", "other-009", "x-y-011"):
        (tmp_path / name).mkdir()
    assert _made(tmp_path, "x") == "x-008"


def test_runs_that_begin_at_once_get_folders_of_their_own(tmp_path):
    with ThreadPoolExecutor(8) as pool:
        folders = list(pool.map(lambda _: new_run_folder(tmp_path, "x"), range(60)))
    for folder in folders:
        folder.close()
    assert sorted(folder.path.name for folder in folders) == [f"x-{number:03d}" for number in range(1, 61)]


def _recorded(folder, **options):
    """A recording of a short run, not finished yet."""
    recording = Recording(new_run_folder(folder, "x"), _Clock(), **options)
    recording.folder.write_mission(read_mission_file(None))
    recording(START)
    for record in RECORDS:
        recording(record)
    recording.frame(_picture(0.5))
    recording.frame(_picture(1.0))
    return recording


@pytest.mark.parametrize("video", [True, False])
def test_a_folder_that_is_removed_with_all_runs_during_the_run_is_made_again(tmp_path, video):
    recording, observers = _recorded(tmp_path / "runs", video=video), Observers(on_failure=lambda *_: None)
    shutil.rmtree(tmp_path / "runs")
    recording.finish(None, "", {}, observers)
    assert [path.name for path in recording.files()] == ["journal.jsonl", "map.png", "mission.json", "summary.json"]
    assert (tmp_path / "runs" / "x-001" / "journal.jsonl").read_text().count("\n") == len(RECORDS) + 1
    assert list(observers.failures) == ["camera/"] * video


def test_a_folder_that_cannot_be_made_again_is_reported_for_each_file(tmp_path):
    recording, observers = _recorded(tmp_path), Observers(on_failure=lambda *_: None)
    shutil.rmtree(tmp_path / "x-001")
    (tmp_path / "x-001").touch()
    recording.finish(None, "", {}, observers)
    assert list(observers.failures) == ["journal.jsonl", "camera/", "map.png", "summary.json"]
    assert recording.files() == []


@pytest.fixture(name="small_disk")
def _small_disk(tmp_path):
    """A disk of 64 kB."""
    if sys.platform != "linux" or os.geteuid() != 0:
        pytest.skip("only root may mount a small disk")
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk], check=False)
    if mounted.returncode:
        pytest.skip("nothing can be mounted here")
    yield disk
    subprocess.run(["umount", "-l", disk], check=True)


def test_a_full_disk_has_room_for_the_summary(small_disk):
    recording, observers = _recorded(small_disk, video=False), Observers(on_failure=lambda *_: None)
    journal = observers.guarded("journal.jsonl", recording)
    for _ in range(1000):
        journal(RECORDS[0])
    recording.finish(None, "", {}, observers)
    assert list(observers.failures) == ["journal.jsonl", "map.png"]
    assert [path.name for path in recording.files()] == ["journal.jsonl", "mission.json", "summary.json"]
    summary = json.loads((small_disk / "x-001" / "summary.json").read_text(encoding="utf-8"))
    assert "No space left" in summary["observer_failures"]["journal.jsonl"]


def test_a_full_disk_has_room_for_the_summary_of_a_long_mission(small_disk):
    recording, observers = _recorded(small_disk, video=False), Observers(on_failure=lambda *_: None)
    journal = observers.guarded("journal.jsonl", recording)
    for _ in range(1000):
        journal(RECORDS[0])
    targets = [TargetProgress("lena", TargetOutcome.PENDING, None, 300)]
    recording.finish(Report(Ending.TIME_UP, targets, ["search", "select"] * 300, 600.0), "", {}, observers)
    assert list(observers.failures) == ["journal.jsonl", "map.png"]
    summary = json.loads((small_disk / "x-001" / "summary.json").read_text(encoding="utf-8"))
    assert summary["ending"] == "time_up"
    assert "path" not in summary, "it does not fit"


def test_a_full_disk_has_room_for_the_summary_of_a_run_with_pictures(small_disk):
    recording, observers = _recorded(small_disk), Observers(on_failure=lambda *_: None)
    keep = observers.guarded("camera/", recording.frame)
    noise = np.random.default_rng(1).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    for number in range(100):
        keep(Frame(noise, 102.0 + number, number))
    recording.finish(None, "", {}, observers)
    assert list(observers.failures) == ["camera/", "map.png"]
    names = ["camera", "journal.jsonl", "mission.json", "summary.json"]
    assert [path.name for path in recording.files()] == names
    recorded = read_frames(small_disk / "x-001")
    assert all(recorded.drawn(each) is not None for each in recorded.frames), "no picture is cut short"


def test_a_video_that_does_not_fit_is_removed_and_reported_in_one_sentence(small_disk, capfd):
    recording, observers = Recording(new_run_folder(small_disk, "x"), _Clock()), Observers()
    recording(START)
    noise = np.random.default_rng(1).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    for number in range(6):
        recording.frame(Frame(noise, 100.0 + number, number))
    recording.finish(None, "", {}, observers)
    with pytest.raises(OSError, match="incomplete"):
        recording.write_video(lambda pictures: pictures * 4)
    assert [path.name for path in recording.files()] == ["camera", "journal.jsonl", "map.png", "summary.json"]
    assert capfd.readouterr() == ("", "")


def test_a_folder_that_cannot_be_made_is_refused_with_advice(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="--out"):
        new_run_folder(tmp_path / "file", "x")


def test_the_journal_is_complete_at_every_moment(tmp_path):
    folder = new_run_folder(tmp_path, "x")
    folder(RECORDS[0])
    lines = (folder.path / "journal.jsonl").read_text(encoding="utf-8").splitlines()
    folder.close()
    assert json.loads(lines[0]) == {
        "t": 0.5,
        "kind": "look",
        "state": "search",
        "target": "lena",
        "pose": [0.0, 0.0, 0.0],
        "range_mm": 500.0,
        "sighting": None,
    }


def test_the_video_keeps_the_missions_time(tmp_path):
    recording, observers = Recording(new_run_folder(tmp_path, "x"), _Clock()), Observers()
    recording(START)
    for time_s, value in [(0.5, 50), (0.55, 60), (0.7, 100), (2.5, 250)]:  # a webcam that stalls
        recording.frame(_picture(time_s, value))
    recording.finish(None, "", {}, observers)
    recording.write_video(iter)
    assert observers.failures == {}
    fps, frames = _film(tmp_path / "x-001" / "camera.webm")
    assert fps == 5
    # one each 0.2 s, from the mission's start to the last picture
    assert [round(float(frame[:30].mean()) / 50) for frame in frames] == [1, 1, 1, *[2] * 9, 5]
    assert sorted(path.name for path in (tmp_path / "x-001").iterdir())[:2] == ["camera", "camera.webm"]


def test_pictures_have_the_journals_time_also_of_a_mission_that_began_a_moment_before_its_first_record(tmp_path):
    recording = Recording(new_run_folder(tmp_path, "x"), _Clock())
    recording(Record(0.25, RecordKind.START, "idle", "lena", {"mission": "x"}))
    for time_s in (-0.5, 0.5):
        recording.frame(_picture(time_s))
    recording.finish(None, "", {}, Observers())
    assert [each.t for each in read_frames(tmp_path / "x-001").frames] == [0.75]


def _film(path):
    """Frames per second and frames of a video."""
    film = cv2.VideoCapture(str(path))
    frames = []
    while (each := film.read())[0]:
        frames.append(each[1])
    fps = film.get(cv2.CAP_PROP_FPS)
    film.release()
    return fps, frames


@pytest.mark.parametrize(
    "report", [None, Report(Ending.ACHIEVED, [TargetProgress("lena", TargetOutcome.REACHED, 3.0, 1)], ["search"], 3.0)]
)
def test_a_finished_recording_is_complete_even_when_the_run_broke(tmp_path, report):
    recording = Recording(new_run_folder(tmp_path, "x"), _Clock())
    for record in [START, *RECORDS]:
        recording(record)
    recording.frame(_picture(0.5))
    recording.finish(report, "" if report else "broken", {"nxt": "sim://"}, Observers())
    assert [path.name for path in recording.files()] == ["camera", "journal.jsonl", "map.png", "summary.json"]
    summary = json.loads((recording.folder.path / "summary.json").read_text(encoding="utf-8"))
    assert summary["achieved"] is (report is not None)
    assert summary["nxt"] == "sim://"


def test_the_map_of_a_simulated_run_gets_the_room_of_start_and_end(tmp_path):
    rooms = iter([[(500.0, -500.0, 500.0, 500.0)], [(700.0, -500.0, 700.0, 500.0)]])
    recording = Recording(new_run_folder(tmp_path, "x"), _Clock(), video=False, room=lambda: next(rooms))
    for record in RECORDS:
        recording(record)
    recording.finish(None, "", {}, Observers())
    plain = Recording(new_run_folder(tmp_path, "x"), _Clock(), video=False)
    plain.finish(None, "", {}, Observers())
    with_room, without = (cv2.imread(str(tmp_path / name / "map.png")) for name in ("x-001", "x-002"))
    assert list(rooms) == []
    assert with_room.shape != without.shape or np.any(with_room != without)
