"""Questions at the terminal before something happens: only a yes lets it."""

import os
import sys

import pytest

from nxtdrive.cli.main import DONE, USAGE, main

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")
CTRL_D = b"\x04"


@pytest.fixture
def types(monkeypatch):
    """Types at a terminal that is standard input and looks like standard error."""
    keyboard, terminal = os.openpty()
    with open(terminal, encoding="utf-8") as typed, open(keyboard, "wb", buffering=0) as keys:

        def types(answer: bytes) -> None:
            monkeypatch.setattr("sys.stdin", typed)
            monkeypatch.setattr("sys.stderr.isatty", lambda: True)
            keys.write(answer)

        yield types


@pytest.mark.parametrize("answer", [CTRL_D, b"\n", b"n\n", b"\xff\n", b"yes" + 2 * CTRL_D + b"no\n"])
@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["calibrate", "--nxt", "usb://"], USAGE),
        (["calibrate", "wheels", "--ruler", "--nxt", "usb://"], USAGE),
        (["doctor", "--wiggle", "--nxt", "sim://"], DONE),
        (["files", "rm", "NVConfig.sys", "--nxt", "sim://"], USAGE),
    ],
    ids=lambda words: words[0] if isinstance(words, list) else None,
)
def test_what_is_not_a_yes_is_a_no(types, capsys, words, code, answer):
    types(answer)
    assert main(words) == code
    said = capsys.readouterr()
    assert "[y/N]" in said.err
    assert "Traceback" not in said.err
    assert not any(word in said.out for word in ("motor B", "deleted"))


def test_a_yes_is_a_yes(types, capsys):
    types(b"Yes\n")
    assert main(["files", "rm", "NVConfig.sys", "--nxt", "sim://"]) == DONE


@pytest.mark.parametrize(
    "words", [["calibrate", "--nxt", "usb://"], ["files", "rm", "NVConfig.sys", "--nxt", "sim://"]]
)
def test_a_closed_standard_input_cannot_be_asked(monkeypatch, refused, words):
    monkeypatch.setattr("sys.stdin", None)
    assert "Add --" in refused(*words)


def test_a_line_that_is_not_in_utf_8_is_a_wrong_line(types, tmp_path, refused):
    types(b"\n\xff\n" + CTRL_D)
    assert "is not a number" in refused("calibrate", "wheels", "--ruler", "--robot", tmp_path / "robot.toml")


def test_a_file_on_standard_input_that_is_not_in_utf_8_holds_no_telegrams(tmp_path, monkeypatch, capsys):
    (tmp_path / "telegrams.txt").write_bytes(b"\xff\xfe\n")
    with open(tmp_path / "telegrams.txt", encoding="utf-8") as telegrams:
        monkeypatch.setattr("sys.stdin", telegrams)
        assert main(["explain", "-"]) == USAGE
    assert "is not hexadecimal" in capsys.readouterr().err
