"""``nxtdrive run`` when an observer fails: the robot goes on, and the exit code and the summary report it."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

from nxtdrive.cli.main import DONE, INCOMPLETE, LINK_LOST, NOT_ACHIEVED, REFUSED, main
from nxtdrive.transports.sim import SimTransport, shared
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation

MISSION = """
[mission]
name = "small"
targets = ["{target}"]
time_limit_s = 60
reconnect_timeout_s = 5
[target.{target}]
detector = "picture"
pictures = ["{target}.png"]
"""
FILE_LIMIT = 4096
"""Bytes a file may have; a journal has more, a summary less."""


@pytest.fixture(name="small")
def _small(tmp_path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(MISSION.format(target="lena"), encoding="utf-8")
    return path


def _command(mission: Path, *words: str) -> list[str]:
    """A run without pictures: what it tells is observed all the same."""
    command = [sys.executable, "-m", "nxtdrive", "run", str(mission), "--nxt", "sim://open"]
    return [*command, "--camera", "geometric", "--no-video", *words]


def _run(command: list[str], **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, check=False, stderr=subprocess.PIPE, text=True, timeout=60, **options)


def _run_with_small_files(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    # -B: bytecode that was cut short could not be imported any more
    program, *words = command
    return _run([program, "-B", *words], cwd=folder, stdout=subprocess.PIPE, preexec_fn=_limit_files)


def _summary(folder: Path) -> dict:
    return json.loads((_folder(folder) / "summary.json").read_text(encoding="utf-8"))


def _folder(folder: Path) -> Path:
    (run,) = (folder / "runs").iterdir()
    return run


def _limit_files() -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_LIMIT, FILE_LIMIT))


@pytest.mark.slow
@pytest.mark.parametrize("words", [pytest.param((), marks=pytest.mark.nightly), ("--json",)], ids=["text", "json"])
def test_a_reader_that_leaves_changes_nothing(tmp_path, small, words):
    run = subprocess.Popen(
        _command(small, *words), cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert run.stdout is not None
    assert run.stdout.readline()
    run.stdout.close()
    assert run.stderr is not None
    said = run.stderr.read()
    run.stderr.close()
    assert run.wait(timeout=60) == DONE
    assert said == ""
    assert _summary(tmp_path)["achieved"]
    assert "observer_failures" not in _summary(tmp_path)
    assert "suspended" not in _summary(tmp_path)["path"]


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("words", [(), pytest.param(("--json",), marks=pytest.mark.nightly)], ids=["text", "json"])
def test_output_that_cannot_be_written_is_reported_once(tmp_path, small, words):
    with open("/dev/full", "w") as full:
        run = _run(_command(small, *words), cwd=tmp_path, stdout=full)
    assert run.returncode == INCOMPLETE
    assert run.stderr.count("\n") == 1
    assert "standard output failed" in run.stderr
    assert _summary(tmp_path)["achieved"]
    assert list(_summary(tmp_path)["observer_failures"]) == ["standard output"]


@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of the operating system")
def test_a_full_disk_does_not_end_the_mission(tmp_path, small):
    run = _run_with_small_files(_command(small), tmp_path)
    assert run.returncode == INCOMPLETE
    assert "achieved after" in run.stdout
    assert run.stderr.count("journal.jsonl failed") == 1
    summary = _summary(tmp_path)
    assert summary["achieved"]
    assert "journal.jsonl" in summary["observer_failures"]
    assert (_folder(tmp_path) / "journal.jsonl").stat().st_size == FILE_LIMIT
    assert main(["explain-run", str(_folder(tmp_path))]) == DONE, "a journal that was cut short is still read"


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of the operating system")
def test_pictures_that_cannot_be_written_are_reported(tmp_path, small):
    without = "--camera", "geometric", "--no-video"
    run = _run_with_small_files([word for word in _command(small) if word not in without], tmp_path)
    assert run.returncode == INCOMPLETE
    assert "camera/" in _summary(tmp_path)["observer_failures"]
    assert run.stderr.count("camera/ failed and is incomplete or missing; the mission does not need it") == 1
    assert not (_folder(tmp_path) / "camera.webm").exists()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of the operating system")
def test_a_mission_that_is_not_achieved_keeps_its_exit_code(tmp_path, small):
    small.write_text(MISSION.format(target="rilakkuma").replace("60", "5"), encoding="utf-8")
    run = _run_with_small_files(_command(small), tmp_path)
    assert run.returncode == NOT_ACHIEVED
    assert _summary(tmp_path)["observer_failures"]


def _losing(simulation: Simulation, **away: tuple[tuple[int, int], ...]) -> SimTransport:
    simulation.webcam.unplugged_ms = away.get("camera_ms", ())
    return SimTransport(simulation, faults=LinkFaults(silent_ms=away.get("link_ms", ())))


@pytest.mark.parametrize("part", ["camera", "link"])
def test_what_stays_away_ends_the_mission_with_a_sentence(here, small, capsys, part):
    away = {f"{part}_ms": ((3000, 10**9),)}
    with shared(f"without{part}", partial(_losing, Simulation("open"), **away)) as address:
        assert main(["run", str(small), "--nxt", address, "--no-video"]) == LINK_LOST
    printed = capsys.readouterr()
    assert f"{part} lost after" in printed.out
    assert printed.err.startswith("nxtdrive: ")
    assert printed.err.count("\n") == 1
    assert _summary(here)["ending"] == f"{part}_lost"


class Refusing(SimTransport):
    """A simulated brick that refuses everything from the third second on."""

    def receive(self, timeout_s: float) -> bytes | None:
        reply = super().receive(timeout_s)
        return reply if reply is None or self.now() < 3.0 else bytes([*reply[:2], 0xDD, *reply[3:]])


@pytest.mark.slow
def test_a_brick_that_keeps_refusing_ends_the_mission_with_the_exit_code_of_a_refusal(here, small, capsys):
    with shared("refusing", partial(Refusing, Simulation("open"))) as address:
        assert main(["run", str(small), "--nxt", address, "--no-video"]) == REFUSED
    assert "the brick refused" in capsys.readouterr().err
    assert _summary(here)["ending"] == "link_lost"


def test_a_recording_as_camera_that_is_at_its_end_is_not_waited_for(here, small, capsys):
    images = here / "images"
    images.mkdir()
    for i in range(3):
        cv2.imwrite(str(images / f"{i}.png"), np.full((48, 64, 3), 128, np.uint8))
    arguments = ["run", str(small), "--nxt", "sim://open", "--camera", str(images), "--no-video"]
    assert main(arguments) == LINK_LOST
    assert "is at its end" in capsys.readouterr().err
    assert _summary(here)["ending"] == "camera_lost"
    assert _summary(here)["duration_s"] < 5.0
