"""``nxtdrive export`` to standard output; tests of the formats are in tests/nxtdrive/recording and tests/tools/web."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from behaviors.journal import Record, RecordKind
from nxtdrive.cli.main import DONE, USAGE, main
from nxtdrive.recording.camera_folder import CameraFolder
from nxtdrive.recording.camera_index import looked
from nxtdrive.recording.run_folder import RunFolder

CLEARS_SCREEN = "a\x1b[2J"


@pytest.fixture(name="run")
def _run(tmp_path, monkeypatch):
    """A run with one record and one picture; the working folder is empty."""
    path = tmp_path / "run-001"
    path.mkdir()
    folder = RunFolder(path)
    folder(Record(0.0, RecordKind.START, "idle", CLEARS_SCREEN, {"mission": "m", "rounds": 1, "targets": []}))
    folder.close()
    camera = CameraFolder(path / "camera")
    camera.add(np.full((48, 64, 3), 120, np.uint8), 0.0, looked("a", None, []))
    camera.close()
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return path


@pytest.mark.parametrize(
    ("option", "begins"),
    [("--html", b"<!doctype html>"), ("--csv", b"t_s,"), ("--mcap", b"\x89MCAP"), ("--webm", b"\x1a\x45\xdf\xa3")],
)
def test_a_dash_is_standard_output(run, tmp_path, capsysbinary, option, begins):
    assert main(["export", str(run), option, "-"]) == DONE
    assert capsysbinary.readouterr().out.startswith(begins)
    assert list((tmp_path / "work").iterdir()) == []


def test_standard_output_gets_what_a_file_gets(run, tmp_path, capsysbinary):
    assert main(["export", str(run), "--csv", "./-"]) == DONE, "a file of this name"
    capsysbinary.readouterr()
    assert main(["export", str(run), "--csv", "-"]) == DONE
    assert capsysbinary.readouterr().out == (tmp_path / "work" / "-").read_bytes()


def test_what_is_reported_of_other_files_stays_out_of_standard_output(run, capsys):
    assert main(["export", str(run), "--csv", "-", "--html", "page.html"]) == DONE
    captured = capsys.readouterr()
    assert captured.out.startswith("t_s,")
    assert "page.html" not in captured.out
    assert captured.err.startswith("page.html: ")


@pytest.mark.parametrize("file", ["index.jsonl", "000001.jpg"])
def test_no_format_replaces_what_the_camera_saw(run, refused, file):
    recorded = run / "camera" / file
    before = recorded.read_bytes()
    assert "cannot be written: the command reads it" in refused("export", run, "--csv", recorded)
    assert recorded.read_bytes() == before


def test_standard_output_takes_one_format(run, refused):
    assert "two formats have the same file" in refused("export", run, "--csv", "-", "--html", "-")


@pytest.mark.parametrize("option", ["--mcap", "--webm"])
def test_a_terminal_gets_no_binary_data(run, monkeypatch, capsys, option):
    run = run.rename(run.with_name("my run"))
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert main(["export", str(run), option, "-"]) == USAGE
    captured = capsys.readouterr()
    assert captured.out == ""
    assert f"`nxtdrive export '{run}' {option} - > FILE`" in captured.err


def test_a_terminal_gets_a_text_escaped(run, monkeypatch, printed):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    out = printed("export", run, "--csv", "-")
    assert "start,idle" in out
    assert "\x1b" not in out


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes in the file system")
@pytest.mark.parametrize("option", ["--mcap", "--webm"])
def test_a_pipe_or_device_is_not_replaced(run, refused, option):
    os.mkfifo("pipe")
    assert "it is not a regular file" in refused("export", run, option, "pipe")
    assert Path("pipe").is_fifo()
    assert os.listdir() == ["pipe"]


@pytest.mark.parametrize("option", ["--html", "--csv", "--mcap", "--webm"])
@pytest.mark.parametrize("name", [".", os.sep])
def test_a_folder_is_not_replaced(run, refused, option, name):
    assert "cannot be written" in refused("export", run, option, name)
    assert os.listdir() == []


@pytest.mark.parametrize(
    ("option", "file", "others"),
    [("--mcap", "run.mcap", ["run.mcap.part"]), ("--webm", "film.webm", ["film.webm.mkv", "film.mkv"])],
)
def test_other_files_of_the_users_stay_as_they_are(run, option, file, others):
    for other in others:
        Path(other).write_text("mine")
    assert main(["export", str(run), option, file]) == DONE
    assert sorted(os.listdir()) == sorted([file, *others])
    assert [Path(other).read_text() for other in others] == ["mine"] * len(others)
