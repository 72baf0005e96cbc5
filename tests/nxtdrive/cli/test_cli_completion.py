"""Completion: the script for bash is tried, those for zsh and fish are checked by these shells where there are any."""

from __future__ import annotations

import shutil
import subprocess

import pytest
import shtab

from nxtdrive.cli.completion import SHELLS
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
    ],
    ids=str,
)
def test_bash_completes(words, wanted, capsys, tmp_path):
    script = _script("bash", capsys, tmp_path)
    line = " ".join(["nxtdrive", *words])
    probe = PROBE.format(script=script, words=line, at=len(words), last=words[-1])
    said = subprocess.run(["bash", "-c", probe], capture_output=True, text=True, check=True, timeout=30)
    assert sorted(said.stdout.split()) == wanted


@pytest.mark.parametrize("shell", SHELLS)
def test_the_shell_itself_finds_no_mistake_in_the_script(shell, capsys, tmp_path):
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    script = _script(shell, capsys, tmp_path)
    checked = subprocess.run([shell, "-n", str(script)], capture_output=True, text=True, check=False, timeout=30)
    assert (checked.returncode, checked.stderr) == (0, "")
