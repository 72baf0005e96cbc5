"""`nxtdrive mcp` as an assistant starts it: a process with the protocol on standard input and output."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import anyio
import pytest
from mcp import StdioServerParameters
from mcp.client.client import Client

from tests.small_mission import MISSION

COMMAND = ("-m", "nxtdrive", "mcp", "--nxt", "sim://open")
HELLO = {
    "jsonrpc": "2.0",
    "id": 1,
    "method": "initialize",
    "params": {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "test", "version": "1"}},
}


@contextmanager
def _started(folder, *options: str) -> Iterator[tuple[subprocess.Popen[str], dict[str, Any]]]:
    """Start the command; yields it and the server's first answer."""
    command = [sys.executable, *COMMAND, *options]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=folder, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            process.stdin.write(json.dumps(HELLO) + "\n")
            process.stdin.flush()
            yield process, json.loads(process.stdout.readline())
        finally:
            process.kill()


@pytest.mark.slow
def test_a_client_that_starts_the_command_drives_the_robot(tmp_path):
    async def converse() -> None:
        parameters = StdioServerParameters(command=sys.executable, args=list(COMMAND), cwd=str(tmp_path))
        async with Client(parameters) as client:
            assert len((await client.list_tools()).tools) == 11
            result = await client.call_tool("drive_mm", {"distance_mm": 100})
            assert json.loads(result.content[0].text)["ended"] == "done"

    anyio.run(converse)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a terminal of POSIX")
def test_a_person_who_starts_it_in_a_terminal_is_told_what_it_waits_for(tmp_path):
    ours, theirs = os.openpty()
    try:
        os.write(ours, b"\x04")  # Ctrl-D
        done = subprocess.run(
            [sys.executable, *COMMAND],
            cwd=tmp_path,
            stdin=theirs,
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
    finally:
        os.close(theirs)
        os.close(ours)
    assert done.stderr.startswith("nxtdrive: waiting for an assistant, which starts this command itself: ")
    assert done.stdout == ""


@pytest.mark.slow
def test_the_mission_of_the_command_is_proposed(tmp_path):
    (tmp_path / "mine.toml").write_text(MISSION, encoding="utf-8")

    async def converse() -> None:
        words = [*COMMAND, "--mission", "mine.toml"]
        async with Client(StdioServerParameters(command=sys.executable, args=words, cwd=str(tmp_path))) as client:
            result = await client.call_tool("missions", {})
            assert json.loads(result.content[0].text) == {"missions": ["", "mine.toml"], "proposed": "mine.toml"}

    anyio.run(converse)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_signal_ends_it_while_the_assistant_is_silent(tmp_path):
    with _started(tmp_path, "--web", "--port", "0", "--max-mm", "250") as (process, answer):
        assert "at most 250 mm" in answer["result"]["instructions"]
        process.send_signal(signal.SIGTERM)
        assert process.wait(20) == 128 + signal.SIGTERM
        told = process.stderr.read().splitlines()
        assert [line.rpartition(":")[0] for line in told] == ["nxtdrive: the page is http://127.0.0.1"]
        assert process.stdout.read() == "", "standard output belongs to the protocol"


@pytest.mark.slow
def test_it_ends_when_the_assistant_leaves(tmp_path):
    with _started(tmp_path) as (process, _):
        process.stdin.close()
        assert process.wait(20) == 0


@pytest.mark.slow
def test_it_ends_silently_when_the_assistant_is_killed_in_mid_motion(tmp_path):
    calls = [("drive_mm", {"distance_mm": 900}), ("range", {})]
    with _started(tmp_path) as (process, _):
        process.stdin.write(json.dumps({"jsonrpc": "2.0", "method": "notifications/initialized"}) + "\n")
        for number, (name, arguments) in enumerate(calls):
            params = {"name": name, "arguments": arguments}
            call = {"jsonrpc": "2.0", "id": 2 + number, "method": "tools/call", "params": params}
            process.stdin.write(json.dumps(call) + "\n")
        process.stdin.flush()
        assert json.loads(process.stdout.readline())["id"] == 3, "the drive is under way"
        process.stdout.close()
        process.stdin.close()
        assert process.wait(20) == 0
        assert process.stderr.read() == ""


@pytest.mark.slow
def test_a_brick_that_is_not_there_is_reported(refused, tmp_path):
    assert "nowhere.toml" in refused("mcp", "--nxt", f"sim://{tmp_path}/nowhere.toml")


def test_the_robot_file_of_the_folder_is_used(tmp_path, refused):
    (tmp_path / "robot.toml").write_text("[robot]\nradius_mm = 1\n", encoding="utf-8")
    assert "robot.radius_mm" in refused("mcp", "--folder", tmp_path)


def test_a_folder_that_cannot_keep_runs_is_reported(refused):
    assert "cannot keep the run there" in refused("mcp", "--out", f"{__file__}/runs")
