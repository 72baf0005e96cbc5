"""Outputs of commands that documents show are the actual outputs."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from nxtdrive.cli.main import DONE, main
from sim_backend.bundled import PICTURES
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
def test_an_output_that_is_shown_is_right(page, here, monkeypatch, capsys):
    make_home(here)
    monkeypatch.delenv("COLUMNS", raising=False)
    for command in SHOWN[page]:
        capsys.readouterr()
        assert main(command) == DONE
    (shown,) = (text for where, _, text in blocks("") if where == page and text.startswith(FIRST_LINES))
    assert shown in capsys.readouterr().out


@pytest.mark.slow
def test_the_second_target_of_the_first_mission_is_reached_in_the_second_room(here, capsys):
    make_home(here)
    shutil.copy(PICTURES / "rilakkuma.png", "my-dog.jpg")
    target, room = (text for page, _, text in blocks("toml") if page == "docs/first-mission.md")
    mission, world = Path("my-mission.toml"), Path("my-mission-world.toml")
    text = mission.read_text(encoding="utf-8")
    mission.write_text(text.replace('["my-cat"]', '["my-cat", "my-dog"]') + target, encoding="utf-8")
    text = re.sub(r"(?<=\[floor\]\nsize_mm = )\S+ \S+", "[5200, 2400]", world.read_text(encoding="utf-8"))
    world.write_text(text + room, encoding="utf-8")
    assert main(["run", "my-mission.toml", "--no-video"]) == DONE
    assert re.search(
        "my-cat reached.*my-dog: a scan did not bring it into view.*my-dog reached", capsys.readouterr().out, re.DOTALL
    )
