"""Completion, by the shells themselves: a test is skipped where its shell is not installed."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys

import pytest
import shtab

from nxtdrive.cli.commands.completion import SHELLS
from nxtdrive.cli.main import COMMANDS, DONE, main, make_parser

PROBE = """
source {script}
function=$(complete -p nxtdrive | sed 's/.*-F \\([^ ]*\\).*/\\1/')
COMP_WORDS=({words}) COMP_CWORD={at}
$function nxtdrive '{last}' x
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


def _script(shell, capsys, tmp_path):
    assert main(["completion", shell]) == DONE
    path = tmp_path / f"nxtdrive.{shell}"
    path.write_text(capsys.readouterr().out, encoding="utf-8")
    return path


@pytest.mark.parametrize("shell", SHELLS)
def test_all_commands_are_in_the_script_as_it_was_made(shell, capsys, tmp_path):
    text = _script(shell, capsys, tmp_path).read_text(encoding="utf-8")
    assert all(command in text for command in COMMANDS)
    assert not any(ord(sign) < 32 and sign not in "\n\t" for sign in text)
    raw = shtab.complete(make_parser(COMMANDS), shell=shell)
    assert text.count("\\x") == raw.count("\\x"), "nothing of it was escaped for a terminal"


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (["mis"], ["mission"]),
        (["mission", "ch"], ["check"]),
        (["export", "--h"], ["--help", "--html"]),
        (["web", "--cla"], ["--classroom"]),
        (["run", "--profile", "''"], ["adaptive", "thesis"]),
    ],
    ids=str,
)
def test_bash_completes(words, wanted, capsys, tmp_path):
    script = _script("bash", capsys, tmp_path)
    line = " ".join(["nxtdrive", *words])
    probe = PROBE.format(script=script, words=line, at=len(words), last=words[-1])
    said = subprocess.run(["bash", "-c", probe], capture_output=True, text=True, check=True, timeout=30)
    assert sorted(said.stdout.split()) == wanted


BEGUN = {
    "mis": "mission",
    "mission ch": "mission check",
    "mission check roo": "mission check room.toml",
    "export --ht": "export --html",
    "web --cla": "web --classroom",
    "run --profile ad": "run --profile adaptive",
}
"""Words of a command line, and the same with the last one completed; `room.toml` is a file of the current folder."""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("zsh") is None or sys.platform == "win32", reason="no zsh")
def test_zsh_completes(capsys, tmp_path):
    import pty

    _script("zsh", capsys, tmp_path).rename(tmp_path / "_nxtdrive")
    (tmp_path / "room.toml").touch()
    start = 'PS1=; fpath=($PWD $fpath); autoload -Uz compinit; compinit -D -u; nxtdrive() { print -r "done:$*" }'
    lines = [start, *(f"nxtdrive {begun}\t" for begun in BEGUN), "exit", ""]
    terminal, end = pty.openpty()
    with subprocess.Popen(["zsh", "-f", "-i"], stdin=end, stdout=end, stderr=end, cwd=tmp_path) as shell:
        os.close(end)
        os.write(terminal, "\n".join(lines).encode())
        said = _read_all(terminal)
        shell.wait(timeout=30)
    assert [line[5:] for line in said.splitlines() if line.startswith("done:")] == list(BEGUN.values())


def _read_all(terminal):
    """What is written to a terminal until the last program there has ended, which closes it with an error."""
    said = b""
    with os.fdopen(terminal, "rb", buffering=0) as file, contextlib.suppress(OSError):
        while part := file.read(4096):
            said += part
    return said.decode()


@pytest.mark.skipif(shutil.which("fish") is None, reason="no fish")
@pytest.mark.parametrize("begun", sorted(BEGUN))
def test_fish_completes(begun, capsys, tmp_path):
    script = _script("fish", capsys, tmp_path)
    (tmp_path / "room.toml").touch()
    probe = ["fish", "--no-config", "-c", f"source {script}; complete -C 'nxtdrive {begun}'"]
    said = subprocess.run(probe, capture_output=True, text=True, check=True, timeout=30, cwd=tmp_path).stdout
    assert [line.partition("\t")[0] for line in said.splitlines()] == [BEGUN[begun].rpartition(" ")[2]]


@pytest.mark.parametrize("shell", SHELLS)
def test_the_shell_itself_finds_no_mistake_in_the_script(shell, capsys, tmp_path):
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    script = _script(shell, capsys, tmp_path)
    checked = subprocess.run([shell, "-n", str(script)], capture_output=True, text=True, check=False, timeout=30)
    assert (checked.returncode, checked.stderr) == (0, "")
