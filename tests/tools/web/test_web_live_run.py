"""``nxtdrive run --web``: the page of one run, which nothing on the page changes."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

from nxtdrive.cli.main import DONE, NOT_ACHIEVED, USAGE, main
from tests.small_mission import MISSION

Start = Callable[..., tuple[subprocess.Popen[str], str]]


@pytest.fixture(name="start")
def _start(started, tmp_path) -> Start:
    """Starts a run with a page; gives the process and the WebSocket's address."""
    (tmp_path / "small.toml").write_text(MISSION, encoding="utf-8")

    def begin(*words: str) -> tuple[subprocess.Popen[str], str]:
        process = started("run", *words, "--web", "--port", "0", "--no-video")
        said = next(line for line in process.stdout if "watch the run" in line)
        return process, re.findall(r"http(://\S+)", said)[0]

    return begin


def _watch(address: str) -> ClientConnection:
    """Connect as soon as the page is served."""
    return connect(f"ws{address}ws", open_timeout=60, max_size=None)


def _messages(page: ClientConnection) -> Iterator[dict[str, Any]]:
    for message in page:
        if isinstance(message, str):
            yield json.loads(message)


def _until(page: ClientConnection, kind: str, **values: object) -> dict[str, Any]:
    return next(
        each for each in _messages(page) if each["type"] == kind and values.items() <= each.get("record", each).items()
    )


def _journal(folder: Path) -> bytes:
    (journal,) = folder.glob("*/journal.jsonl")
    return journal.read_bytes()


@pytest.mark.nightly
def test_watchers_do_not_change_the_journal_and_get_the_end(start, tmp_path, capsys):
    mission = str(tmp_path / "small.toml")
    alone = ["run", mission, "--nxt", "sim://figure6", "--no-video", "--out", str(tmp_path / "alone")]
    assert main(alone) == DONE
    process, address = start(mission, "--nxt", "sim://figure6?pace=fast", "--out", "watched")
    with ExitStack() as pages:
        reader, _never_reads = (pages.enter_context(_watch(address)) for _ in range(2))
        hello = next(_messages(reader))
        assert not hello["drives"]
        reader.send('{"type": "drive", "ahead": 1, "turn": 0}')
        assert "one run" in _until(reader, "refused")["text"]
        ended = _until(reader, "ended")
    assert ended["achieved"]
    assert process.wait(30) == DONE
    assert _journal(tmp_path / "watched") == _journal(tmp_path / "alone")


@pytest.mark.slow
def test_a_page_pauses_answers_and_stops_the_run(start):
    process, address = start(
        "--nxt", "sim://?pace=fast", "--profile", "adaptive", "--confirm-recovery", "--camera", "geometric"
    )
    with _watch(address) as page:
        page.send('{"type": "pause"}')
        _until(page, "record", reason="operator_pause")
        page.send('{"type": "resume"}')
        question = _until(page, "question", open=True)
        page.send(json.dumps({"type": "answer", "question": question["number"], "choice": 0}))
        assert _until(page, "decision")["operator"]
        page.send('{"type": "stop"}')
        assert _until(page, "ended")["ending"] == "interrupted"
    assert process.wait(30) == NOT_ACHIEVED


def test_a_port_that_is_taken_is_a_usage_error_before_anything_moves(here, capsys):
    import socket

    with socket.create_server(("127.0.0.1", 0)) as taken:
        assert main(["run", "--web", "--port", str(taken.getsockname()[1])]) == USAGE
    assert "--port" in capsys.readouterr().err
    assert not Path("runs").exists()
