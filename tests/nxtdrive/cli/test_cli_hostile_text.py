"""Names and texts from outside never reach the terminal unescaped and cannot forge a line, whatever prints them."""

from __future__ import annotations

import json
import re
import socket
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
import serial.tools.list_ports
from rich.text import Text
from serial.tools.list_ports_common import ListPortInfo

from behaviors.executive import Ending
from firmware_protocol.direct import GetCurrentProgramName, KeepAlive, MessageRead
from nxtdrive.cli.main import DONE, USAGE, main
from nxtdrive.cli.output import guarded_output, make_console
from nxtdrive.tools.sweep.runner import plan
from nxtdrive.tools.sweep.tables import print_tables
from nxtdrive.tools.sweep.task import evaluate
from nxtdrive.transports.sim import SimTransport, shared
from sim_backend.simulation import Simulation

HOSTILE = "a\x1b[2J\x9b\x7f[/]\nforged"
SHOWN = r"a\x1b[2J\x9b\x7f[/]\nforged"
SHORT = "\x1b[2J\x9b\n[/]x"
UNICODE = HOSTILE + "\u202e\ud800"
JOURNAL = Path(__file__).parent / "journals" / "format-1.jsonl"

FORBIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


@pytest.fixture(name="run")
def _run(capsys):
    """Runs a command; returns its exit code and its output, without control characters and forged lines."""

    def run(*words: str) -> tuple[int, str]:
        code = main([*words])
        captured = capsys.readouterr()
        for text in (captured.out, captured.err):
            assert not FORBIDDEN.search(text), text
            assert not re.search("^forged", text, re.MULTILINE), text
        return code, captured.out + captured.err

    return run


@pytest.fixture(name="brick")
def _brick():
    """Address of a simulated brick with hostile names."""
    simulation = Simulation("open")
    simulation.brick.radio.rename(SHORT.encode("latin-1"))
    name = "a\x1b[2J\nforged.rxe"
    simulation.brick.loader.create(name, 0, appendable=True)
    with shared("hostile", partial(SimTransport, simulation)) as address:
        yield address


@pytest.fixture(name="replay")
def _replay(tmp_path):
    """Address of a recorded brick that answers with these replies."""

    def replay(*exchanges: tuple[bytes, bytes]) -> str:
        alive = (KeepAlive().encode(), KeepAlive.encode_reply(KeepAlive.reply_type(sleep_ms=0)))
        lines = [{"nxttrace": 1, "address": UNICODE, "max_telegram": 64, "command": [UNICODE]}]
        for sent, received in (alive, *exchanges):
            lines += [{"t": 0.0, "to": sent.hex()}, {"t": 0.0, "from": received.hex()}]
        lines += [{"t": 0.0, "error": "LinkLost", "text": UNICODE}]
        path = tmp_path / "hostile.nxttrace"
        path.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
        return str(path)

    return replay


@pytest.mark.parametrize("json_", [[], ["--json"]], ids=["text", "json"])
@pytest.mark.parametrize(
    "words", [["info"], ["name"], ["files", "ls"], ["monitor", "--once"], ["doctor"], ["list"]], ids=" ".join
)
def test_names_on_a_brick(run, brick, monkeypatch, words, json_):
    port = ListPortInfo("/dev/rfcomm" + HOSTILE, skip_link_detection=True)
    port.description = UNICODE
    monkeypatch.setattr(serial.tools.list_ports, "comports", lambda: [port])
    address = {"list": [], "monitor": ["--nxt", "sim://open"]}.get(words[0], ["--nxt", brick])
    _, text = run(*words, *address, *json_)
    if json_:
        json.loads(text)


def test_a_name_with_a_line_feed_is_one_line_of_files_ls(run, brick):
    _, text = run("files", "ls", "--nxt", brick)
    assert len(text.splitlines()) == 2
    assert r"a\x1b[2J\nforged.rxe" in text


def test_the_running_program_and_its_message(run, replay):
    name = GetCurrentProgramName.encode_reply(GetCurrentProgramName.reply_type(name="\x1b[2J\nforged"))
    code, text = run("program", "status", "--nxt", "replay://" + replay((GetCurrentProgramName().encode(), name)))
    assert (code, text) == (DONE, "\\x1b[2J\\nforged is running\n")
    question = MessageRead(remote_box=10, local_box=0, remove=True)
    data = MessageRead.encode_reply(MessageRead.reply_type(local_box=0, size=10, data=b"\x1b[2Jhi\nfo\0"))
    code, text = run("message", "read", "1", "--nxt", "replay://" + replay((question.encode(), data)))
    assert (code, text) == (DONE, "\\x1b[2Jhi\\nfo\n")


@pytest.mark.parametrize("options", [[], ["--full"], ["--json"]], ids=str)
def test_a_recording(run, replay, options):
    code, text = run("trace", "show", replay(), *options)
    assert code == DONE
    assert (r"\u001b[2J" if options == ["--json"] else r"\x1b[2J") in text


def test_a_telegram(run):
    code, text = run("explain", "0x02", "0x9b", "0x00", SHORT.encode("latin-1").hex(" "), "00 " * 22)
    assert code == DONE
    assert r"\x1b[2J" in text


@pytest.mark.parametrize("options", [[], ["--json"], ["--profile", "adaptive"]], ids=str)
def test_a_run(run, tmp_path, options):
    path = tmp_path / "journal.jsonl"
    text = JOURNAL.read_text(encoding="utf-8")
    for word in ("lena", "behind a corner", "full_turn_without_sighting"):
        text = text.replace(f'"{word}"', json.dumps(word + HOSTILE))
    path.write_text(text, encoding="utf-8")
    code, text = run("explain-run", str(path), *options)
    assert code == DONE
    assert "[/]" in text


def test_mistakes_in_a_mission(run, tmp_path):
    path = tmp_path / "hostile.toml"
    path.write_text(f"[mission]\ntargets = [{json.dumps(SHORT)}]\n[{json.dumps(HOSTILE)}]\nx = {json.dumps(HOSTILE)}\n")
    for words in (
        ["mission", "check", str(path)],
        ["mission", "check", str(path), "--json"],
        ["mission", "show", str(path)],
    ):
        code, text = run(*words)
        assert code == USAGE
        assert "1b[2J" in text


def test_a_target_with_a_hostile_name(run, tmp_path):
    path = tmp_path / "hostile.toml"
    name = json.dumps(HOSTILE.replace("\x7f", "\x1b"))
    path.write_text(
        f'[mission]\nname = {name}\ntargets = [{name}]\n[target.{name}]\ndetector = "marker"\nid = 1\nheight_mm = 50\n'
    )
    for options in ([], ["--json"]):
        code, text = run("mission", "show", str(path), *options)
        assert code == DONE, text
        assert "1b[2J" in text


@pytest.mark.parametrize(
    "words",
    [
        ["mission", "check"],
        ["mission", "show"],
        ["explain-run"],
        ["trace", "show"],
        ["run"],
        ["files", "put"],
        ["sim", "check"],
        ["detect", "try", "0", "--picture"],
        ["info", "--nxt"],
    ],
    ids=" ".join,
)
def test_names_of_files_in_error_messages(run, words):
    code, text = run(*words, "nowhere/" + HOSTILE.replace("\x9b", "\u202e"))
    assert code in (USAGE, 3)
    assert r"\x1b[2J" in text


@pytest.mark.slow
def test_tables_of_a_sweep(capsys):
    result = evaluate(plan(["open"], range(100, 101), ["oracle"], "geometric")[0])
    hostile = result.model_copy(update={"kind": HOSTILE, "agent": HOSTILE})
    broken = hostile.model_copy(update={"ending": Ending.BROKEN, "error": UNICODE})
    with guarded_output():
        print_tables([hostile, broken], make_console(width=200))
    text = capsys.readouterr().out
    assert not FORBIDDEN.search(text)
    assert f"failed: {SHOWN}" in text
    assert text.count(SHOWN) > 5


# --- the nets ---


def test_a_forgotten_place_is_escaped(capsys):
    with guarded_output():
        print("\x1b[2J\x9b\tä\n\u202e\ud800")
        print("\x1b]0;title\x07", file=sys.stderr)
    captured = capsys.readouterr()
    assert captured.out == "\\x1b[2J\\x9b\tä\n\\u202e\\ud800\n"
    assert captured.err == "\\x1b]0;title\\x07\n"


def test_colours_of_a_console_stay_and_what_is_in_its_text_does_not(capsys):
    with guarded_output():
        make_console(force_terminal=True).print(Text("\x1b[2J", style="red"), "[/]")
    assert capsys.readouterr().out == "\x1b[31m\\x1b[2J\x1b[0m [/]\n"


def test_the_streams_are_given_back(capsys):
    before = sys.stdout, sys.stderr, sys.stdout.errors
    with guarded_output():
        assert sys.stdout is not before[0]
    assert (sys.stdout, sys.stderr, sys.stdout.errors) == before


ASCII = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}


@pytest.mark.slow
def test_every_output_can_be_written_in_ascii(tmp_path):
    (tmp_path / "é°.toml").write_text(
        '[mission]\ntargets = ["é"]\n[target."é"]\ndetector = "marker"\nid = 1\nheight_mm = 9\n'
    )
    commands = [
        ["info", "--nxt", "sim://open"],
        ["monitor", "--once", "--nxt", "sim://open"],
        ["doctor", "--nxt", "sim://open"],
        ["mission", "show", "é°.toml"],
        ["mission", "check", "é°.toml", "nowhere→.toml"],
        ["explain-run", str(JOURNAL)],
        ["sensor", "identify", "--nxt", "sim://open"],
        ["--help"],
    ]
    for words in commands:
        done = subprocess.run(
            [sys.executable, "-m", "nxtdrive", *words], cwd=tmp_path, env=ASCII, capture_output=True, check=False
        )
        assert b"Traceback" not in done.stderr, done.stderr.decode()
        assert (done.stdout + done.stderr).isascii()
        if words[0] == "monitor":
            assert b"0 deg" in done.stdout


@pytest.mark.slow
def test_what_a_client_sends_to_serve():
    command = [sys.executable, "-m", "nxtdrive", "serve", "--port", "0", "--nxt", "sim://open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as server:
        assert server.stdout is not None
        port = int(server.stdout.readline().rpartition(b":")[2])
        with socket.create_connection(("127.0.0.1", port), timeout=60) as client, client.makefile("rb") as replies:
            client.sendall("arrive \x1b[2J\x9b\u202e[/]x\r\nbye\n".encode())
            assert replies.read() == b"2\n1\n"
        server.terminate()
        said = server.stdout.read().decode()
    assert r"arrive \x1b[2J\x9b\u202e[/]x -> 2" in said
    assert not FORBIDDEN.search(said)
