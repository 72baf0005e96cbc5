"""``nxtdrive run --confirm-recovery``: the operator at the terminal has the last word."""

from __future__ import annotations

import _thread
import gc
import io
import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console

from behaviors.events import Reason
from behaviors.evidence import Evidence
from behaviors.operator import question
from behaviors.recoveries import CHANGE_TARGET, MOVE_TO, WAIT
from behaviors.thesis.policy import ThesisPolicy
from nxtdrive.cli.main import NOT_ACHIEVED
from nxtdrive.cli.terminal_operator import TerminalOperator
from nxtdrive.recording.status_line import StatusLine

MISSION = """
[mission]
name = "corner"
targets = ["lena"]
profile = "thesis"
[target.lena]
detector = "picture"
pictures = ["lena.png"]
"""
PROMPT = b"stop the mission > "
DUE = question(ThesisPolicy(), Evidence("lena", Reason.TARGET_LOST, seen_since_search=True, researches=0))


@pytest.fixture
def asked(monkeypatch):
    """Asks an operator who types these lines, and then no more; gives the choice, and what was shown."""

    def ask(*lines: str):
        typed: Iterator[str] = iter(lines)

        def read(*_: object) -> str:
            for line in typed:
                return line
            raise EOFError

        monkeypatch.setattr("builtins.input", read)
        screen = io.StringIO()
        console = Console(file=screen, width=100)
        return TerminalOperator(StatusLine(console), console)(DUE), screen.getvalue()

    return ask


def test_enter_confirms_what_is_proposed(asked):
    choice, shown = asked("")
    assert choice == DUE.proposed
    assert "lena: it went out of view on the way there" in shown
    assert "proposed: 1, the target was recognised but not reached" in shown
    for candidate in ("wait up to 15.0 s", "turn +90° and move off", "leave this target"):
        assert candidate in shown


@pytest.mark.parametrize(("typed", "kind"), [("1", WAIT), (" 3 ", CHANGE_TARGET)])
def test_a_number_chooses(asked, typed, kind):
    choice, _ = asked(typed)
    assert choice.kind is kind


@pytest.mark.parametrize("wrong", ["0", "4", "-1", "yes", "²", "[bold]"])
def test_an_invalid_answer_is_asked_for_again(asked, wrong):
    choice, shown = asked(wrong, "2")
    assert choice.kind is MOVE_TO
    assert f"There is no {wrong!r}." in shown


@pytest.mark.parametrize("lines", [["s"], ["S"], []], ids=["s", "S", "end of input"])
def test_the_operator_stops_the_mission(asked, lines):
    with pytest.raises(KeyboardInterrupt):
        asked(*lines)


def test_without_a_terminal_it_is_a_usage_error(refused, monkeypatch, here):
    monkeypatch.setattr("sys.stdin", io.StringIO("1\n"))
    assert "needs a terminal" in refused("run", "--confirm-recovery")
    assert not Path("runs").exists()


TERMINALS = pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")


@TERMINALS
def test_a_signal_that_comes_just_before_the_read_is_noticed(monkeypatch):
    """Such a signal does not interrupt the read: its handler runs when the read is over."""
    gc.collect()  # Python drops an interrupt that comes while C code frees what earlier tests left
    main_end, its_end = os.openpty()
    with open(its_end, encoding="utf-8") as typed, open(main_end, "wb", buffering=0) as keyboard:
        monkeypatch.setattr("sys.stdin", typed)
        monkeypatch.setattr("builtins.input", typed.readline)
        console = Console(file=io.StringIO(), width=100)
        late = threading.Timer(5.0, keyboard.write, [b"s\n"])
        threading.Timer(0.05, _thread.interrupt_main).start()
        late.start()
        with pytest.raises(KeyboardInterrupt):
            TerminalOperator(StatusLine(console), console)(DUE)
        assert late.is_alive(), "it did not wait for the line"
        late.cancel()


IN_A_TERMINAL = "import os, pty, sys; sys.exit(os.waitstatus_to_exitcode(pty.spawn(sys.argv[1:])))"


def _at_a_terminal(folder: Path, *answers: bytes) -> int:
    """Run the mission in a terminal of its own; answers each question with the next answer."""
    command = [sys.executable, "-m", "nxtdrive", "run", "corner.toml", "--nxt", "sim://figure5"]
    process = subprocess.Popen(
        [sys.executable, "-c", IN_A_TERMINAL, *command, "--camera", "geometric", "--no-video", "--confirm-recovery"],
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        bufsize=0,
    )
    left, received = list(answers), b""
    while True:
        if not (said := process.stdout.read(4096)):
            break
        received += said
        if left and PROMPT in received:
            received = b""
            process.stdin.write(left.pop(0))
    process.stdin.close()
    process.stdout.close()
    return process.wait()


LAST = [
    pytest.param(b"\x03", id="Ctrl-C"),
    pytest.param(b"\x04", id="Ctrl-D", marks=pytest.mark.nightly),
    pytest.param(b"s\n", id="s", marks=pytest.mark.nightly),
]


@pytest.mark.slow
@TERMINALS
@pytest.mark.parametrize("last", LAST)
def test_at_a_real_terminal_one_answer_is_obeyed_and_another_ends_the_mission(tmp_path, last):
    (tmp_path / "corner.toml").write_text(MISSION, encoding="utf-8")
    assert _at_a_terminal(tmp_path, b"2\n", last) == NOT_ACHIEVED
    (folder,) = (tmp_path / "runs").iterdir()
    records = [json.loads(line) for line in (folder / "journal.jsonl").read_text(encoding="utf-8").splitlines()]
    (choice,) = [record for record in records if record["kind"] == "choice"]
    assert (choice["choice"], choice["operator"], choice["proposed"]["choice"]) == ("wait", True, "move_to")
    assert records[-1]["ending"] == "interrupted"
    assert json.loads((folder / "summary.json").read_text(encoding="utf-8"))["ending"] == "interrupted"
