"""Files and output that cannot be written: a sentence and an exit code, and nothing half written is left behind."""

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from nxtdrive.cli.main import DONE, INCOMPLETE, USAGE, main
from nxtdrive.transports.trace_file import read_trace

TRACE = Path(__file__).parents[2] / "traces" / "info.nxttrace"

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs limits of the operating system")


@contextlib.contextmanager
def _small_files(size):
    """Let no file get more than `size` bytes, as on a full disk.

    Python would cut short the bytecode of what is imported meanwhile, too, and could not import it any more.
    """
    import resource

    limits, unwritten = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        sys.dont_write_bytecode = unwritten


WRITERS = {
    "get": ["files", "get", "NVConfig.sys", "--to", "out"],
    "screenshot": ["screenshot", "out.png"],
    "mission": ["mission", "new", "out.toml"],
    "trace": ["info", "--trace", "out.nxttrace"],
    "picture": ["detect", "try", "picture.png", "--color", "red", "--out", "out.png"],
    "video": ["detect", "try", "picture.png", "--color", "red", "--out", "out.webm"],
    "sweep": ["sweep", "--classes", "open", "--seeds", "100", "--profiles", "oracle", "--out", "out.jsonl"],
}


@pytest.fixture(name="folder")
def _folder(here):
    cv2.imwrite(str(here / "picture.png"), np.zeros((48, 64, 3), np.uint8))
    return here


@pytest.mark.parametrize(
    "command",
    [pytest.param(words, id=name, marks=[pytest.mark.slow] * (name == "sweep")) for name, words in WRITERS.items()],
)
def test_a_file_that_cannot_be_written_is_a_sentence(folder, capsys, command):
    with _small_files(3):
        assert main(command) == USAGE
    said = capsys.readouterr().err
    assert "cannot be written" in said
    assert "Traceback" not in said
    left = [path for path in folder.iterdir() if path.name.startswith("out")]
    assert [path.suffix for path in left] in ([], [".nxttrace"], [".jsonl"])


def test_a_full_disk_is_noticed_before_a_robot_is_calibrated(folder, capsys):
    with _small_files(3):
        assert main(["calibrate", "motors"]) == USAGE
    said = capsys.readouterr()
    assert "robot.toml cannot be written" in said.err
    assert "turning each wheel" not in said.out + said.err


def test_what_was_measured_is_shown_even_if_the_robot_file_cannot_be_written(folder, capsys, mocker):
    mocker.patch(
        "nxtdrive.tools.calibrate.verdict.write_robot_file", side_effect=OSError(28, "No space left on device")
    )
    assert main(["calibrate", "motors"]) == USAGE
    said = capsys.readouterr()
    assert "motors.dead_zone_percent" in said.out
    assert "Written" not in said.out
    assert "robot.toml cannot be written (No space left on device)" in said.err


@pytest.mark.parametrize("command", WRITERS.values(), ids=WRITERS.keys())
def test_a_folder_that_is_not_there_is_a_sentence(folder, refused, command):
    if command[0] == "sweep":
        (folder / "gone").touch()  # a sweep makes its folders
    command = [f"gone/{word}" if word.startswith("out") else word for word in command]
    if command[-1] != "gone/out.nxttrace":
        assert "gone/out" in refused(*command)


def test_a_trace_that_cannot_be_written_to_its_end_does_not_end_the_program(folder, capsys, caplog):
    with _small_files(300):
        assert main(["info", "--json", "--trace", "out.nxttrace"]) == INCOMPLETE
    assert json.loads(capsys.readouterr().out)["name"]
    assert "out.nxttrace is incomplete" in caplog.text
    assert read_trace(folder / "out.nxttrace").entries, "what was written can be read"
    assert main(["info", "--trace", "out.nxttrace"]) == DONE


def test_a_trace_that_is_removed_is_reported(folder, caplog):
    from nxtdrive.brick import open_brick

    with open_brick("record://out.nxttrace?nxt=sim://open") as brick:
        (folder / "out.nxttrace").unlink()
        assert brick.battery_v > 0
    assert "it was removed" in caplog.text


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize(
    "command",
    [
        ["--help"],
        ["--version"],
        pytest.param(["info", "--json"], marks=pytest.mark.slow),
        ["trace", "show", str(TRACE)],
    ],
    ids=lambda words: words[0] + words[-1],
)
@pytest.mark.parametrize("buffered", [True, False], ids=["buffered", "unbuffered"])
def test_output_that_cannot_be_written_is_a_sentence(command, buffered):
    if command == ["--help"] and not buffered:
        pytest.skip("argparse ignores the error")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    program = [sys.executable, *([] if buffered else ["-u"]), "-m", "nxtdrive"]
    with open("/dev/full", "w") as full:
        ran = subprocess.run(
            [*program, *command], stdout=full, stderr=subprocess.PIPE, text=True, check=False, env=environment
        )
    assert ran.returncode == USAGE
    assert ran.stderr.count("\n") == 1
    assert "standard output" in ran.stderr
    assert "No space left" in ran.stderr


@pytest.mark.slow
def test_a_closed_output_is_not_a_mistake():
    ran = subprocess.run(
        ["sh", "-c", '"$0" -m nxtdrive files ls >&-', sys.executable], capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stderr) == (DONE, "")


def test_a_table_whose_reader_has_left_is_not_a_mistake(monkeypatch):
    """As of `nxtdrive monitor --once | true`."""
    reader, writer = os.pipe()
    os.close(reader)
    with contextlib.suppress(BrokenPipeError), open(writer, "w") as left:
        monkeypatch.setattr("sys.stdout", left)
        assert main(["monitor", "--once"]) == DONE
