"""``nxtdrive run`` when the brick goes away: suspended at once, resumed when it is back, ended when it stays away."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from nxtdrive.cli.main import LINK_LOST, NOT_ACHIEVED, main
from nxtdrive.transports.sim import SimTransport, shared
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation

MISSION = """
[mission]
name = "lena"
targets = ["lena"]
reconnect_timeout_s = {reconnect_timeout_s}
[target.lena]
detector = "picture"
pictures = ["lena.png"]
"""
FOREVER_MS = 10**9


def _mission(folder: Path, reconnect_timeout_s: float) -> str:
    path = folder / "lena.toml"
    path.write_text(MISSION.format(reconnect_timeout_s=reconnect_timeout_s), encoding="utf-8")
    return str(path)


def _serving(process: subprocess.Popen[str]) -> dict:
    assert process.stdout is not None
    return json.loads(process.stdout.readline())


def _until(process: subprocess.Popen[str], **values: object) -> dict:
    """The next record with these values."""
    assert process.stdout is not None
    records = map(json.loads, process.stdout)
    return next(each for each in records if all(each.get(key) == value for key, value in values.items()))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")
def test_a_brick_that_is_back_continues_with_the_mission(started, tmp_path):
    serve = ("sim", "serve", "--world", "open", "--json", "--size", "160x120", "--pty")
    camera = _serving(started(*serve, tmp_path / "other"))["camera"]
    brick = started(*serve, tmp_path / "nxt")
    address = _serving(brick)["nxt"]
    run = started("run", _mission(tmp_path, 60), "--nxt", address, "--camera", camera, "--no-video", "--json")
    before = _until(run, kind="transition", to="search")
    brick.terminate()
    _until(run, kind="transition", to="suspended")
    _serving(started(*serve, tmp_path / "nxt"))
    back = _until(run, kind="transition", event="link_back")
    resumed = _until(run, kind="transition", event="resume")
    assert before["t"] < back["t"] <= resumed["t"]
    assert resumed["state"] in ("search", "arrive")
    _until(run, kind="look")
    run.send_signal(signal.SIGINT)
    _until(run, kind="end", ending="interrupted")
    assert run.wait(timeout=60) == NOT_ACHIEVED


def test_a_brick_that_stays_away_ends_the_mission_with_its_own_exit_code(tmp_path, capsys):
    faults = LinkFaults(unplugged_ms=((3000, FOREVER_MS),))
    with shared("losing", lambda: SimTransport(Simulation("open"), faults=faults)) as address:
        arguments = [_mission(tmp_path, 2.5), "--nxt", address, "--out", str(tmp_path / "runs"), "--no-video"]
        assert main(["run", *arguments]) == LINK_LOST
    printed = capsys.readouterr()
    assert "link lost after" in printed.out
    assert "the link is lost" in printed.err
    (folder,) = (tmp_path / "runs").iterdir()
    records = [json.loads(line) for line in (folder / "journal.jsonl").read_text(encoding="utf-8").splitlines()]
    (suspended,) = [record["t"] for record in records if record.get("to") == "suspended"]
    assert records[-1]["ending"] == "link_lost"
    assert records[-1]["t"] - suspended == pytest.approx(2.5, abs=0.6)
