"""``nxtdrive web``: mistakes are reported before anything is opened."""

from __future__ import annotations

import pytest

from nxtdrive.cli.main import main


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--classroom", "0"], "1 to 30 robots"),
        (["--classroom", "nosuch.toml"], "nosuch.toml"),
        (["--classroom", "2", "--camera", "0"], "for one robot"),
        (["--classroom", "2", "--nxt", "usb://"], "for one robot"),
        (["--mission", "nosuch.toml"], "nosuch.toml"),
        (["--folder", "nosuch"], "there is no folder nosuch"),
    ],
)
def test_mistakes_are_reported(arguments, says, capsys):
    assert main(["web", "--port", "0", *arguments]) == 2
    assert says in capsys.readouterr().err


def test_all_mistakes_of_a_classroom_are_reported_at_once(tmp_path, capsys):
    file = tmp_path / "classroom.toml"
    file.write_text('[[robot]]\nname = "Ada"\nnxt = "usv://"\n[[robot]]\nname = ""\ncolour = 3\n', encoding="utf-8")
    assert main(["web", "--port", "0", "--classroom", str(file)]) == 2
    error = capsys.readouterr().err
    assert "3 mistakes" in error
    for part in ("robot[0].nxt", "robot[1].name", "robot[1].colour"):
        assert part in error
