"""The keys of a sweep's lines are those that docs/sweep.md explains, and its lines of Python read them."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from nxtdrive.cli.main import DONE, main
from nxtdrive.tools.sweep.task import Task, failed
from sim_backend.bundled import PICTURES

SECTION = re.compile(r"^## The keys of a line\n(.*?)^## ", re.DOTALL | re.MULTILINE)
ROW = re.compile(r"^\| (`.*?`) \|", re.MULTILINE)
PAGE = Path(__file__).parents[3] / "docs" / "sweep.md"

pytestmark = pytest.mark.slow


@pytest.fixture(name="folder", scope="module")
def _folder(tmp_path_factory):
    """A folder with the file of a sweep, with a mission that broke."""
    folder = tmp_path_factory.mktemp("sweep")
    command = ["sweep", "--classes", "clutter", "--seeds", "100", "--profiles", "adaptive,oracle"]
    assert main([*command, "--out", str(folder / "full.jsonl")]) == DONE
    with (folder / "full.jsonl").open("a", encoding="utf-8") as file:
        file.write(failed(Task(2, "clutter", 101, "oracle", "geometric"), RuntimeError("lost")).to_json() + "\n")
    return folder


def _section():
    return SECTION.search(PAGE.read_text(encoding="utf-8"))[1]


def test_the_keys_of_a_line_are_explained(folder):
    mission, *_, broken = map(json.loads, (folder / "full.jsonl").read_text(encoding="utf-8").splitlines())
    explained = re.findall(r"`(\w+)`", " ".join(ROW.findall(_section())))
    assert set(explained) == {*mission, *mission["targets"][0], "robot", "unreached"}
    of_whole_missions = explained[explained.index("duration_s") : explained.index("target")]
    assert not set(of_whole_missions) & set(broken), "a mission that broke has none of them"
    parts = " ".join(re.findall(r"^\| `(?:choices|chances)` .*$", _section(), re.MULTILINE))
    assert all(f"`{key}`" in parts for name in ("choices", "chances") for key in mission[name][0])


def test_the_documented_lines_read_it_by_pandas(folder, monkeypatch, capsys):
    pytest.importorskip("pandas")
    monkeypatch.chdir(folder)
    program = re.search(r"```python\n(.*?)```", _section(), re.DOTALL)[1]
    names: dict[str, object] = {}
    exec(compile(program, "docs/sweep.md", "exec"), names)
    assert len(names["targets"]) == 4
    assert "wrong_stops" in capsys.readouterr().out


def test_the_documented_program_repeats_a_mission_with_several_profiles(here, capsys):
    pytest.importorskip("pandas")
    shutil.copy(PICTURES / "fox.png", "my-cat.jpg")
    assert main(["mission", "new", "--picture", "my-cat.jpg", "--height-mm", "297", "my-mission.toml"]) == DONE
    section = re.search(r"^## Your own mission.*?```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.M | re.S)
    program = section[1].replace("range(5)", "range(2)")
    names: dict[str, object] = {}
    exec(compile(program, "docs/sweep.md", "exec"), names)
    assert len(names["repeated"]) == 4
    assert names["repeated"].groupby("profile")["time_s"].mean().nunique() == 2
    assert "adaptive" in capsys.readouterr().out
