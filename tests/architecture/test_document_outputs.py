"""What documents show as the output of a command is its output."""

from __future__ import annotations

import pytest

from nxtdrive.cli.main import DONE, main
from tests.architecture.document_blocks import blocks, make_home

SHOWN = {
    "docs/first-mission.md": (["run", "my-mission.toml", "--no-video"],),
    "docs/calibration.md": (["calibrate"],),
    "docs/adaptive.md": (
        ["run", "--profile", "adaptive", "--no-video"],
        ["explain-run", "runs/lena-then-rilakkuma-001"],
    ),
}
"""Pages, and the commands whose output they show; the last one's, if there are several."""

FIRST_LINES = ("connecting to sim://", "turning each wheel", "╭─ 1 ")


@pytest.mark.nightly
@pytest.mark.parametrize("page", SHOWN)
def test_an_output_that_is_shown_is_right(page, tmp_path, monkeypatch, capsys):
    make_home(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("COLUMNS", raising=False)
    for command in SHOWN[page]:
        capsys.readouterr()
        assert main(command) == DONE
    (shown,) = (text for where, _, text in blocks("") if where == page and text.startswith(FIRST_LINES))
    assert shown in capsys.readouterr().out
