"""The published packages: the wheel and the source distribution pass the index's checks and run outside a checkout."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

from tests.architecture.environments import FILES, PACKAGES, ROOT, copy_sources, make_environment, python_of
from tests.small_mission import MISSION

MAX_MB = 2.0
"""A file that is published by mistake would show; the goal of 1 MB is missed (docs/releasing.md)."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("packaging"),
    pytest.mark.skipif(sys.platform == "win32", reason="needs symbolic links"),
]


def _tool(*words: object, cwd: Path | None = None) -> str:
    done = subprocess.run(
        [sys.executable, "-m", *map(str, words)], cwd=cwd, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    """The wheel and the source distribution, built from a copy of this checkout."""
    for module in ("build", "twine", "check_wheel_contents", "hatchling"):
        pytest.importorskip(module, reason=f"{module} builds or checks what is published")
    folder = tmp_path_factory.mktemp("dist")
    _tool("build", "--no-isolation", "--outdir", folder, copy_sources(tmp_path_factory.mktemp("source")))
    return folder


def test_the_index_would_take_both(published):
    _tool("twine", "check", "--strict", *sorted(published.iterdir()))


def test_the_wheel_has_what_it_should(published):
    (wheel,) = published.glob("*.whl")
    _tool("check_wheel_contents", "--config", ROOT / "pyproject.toml", wheel)
    names = zipfile.ZipFile(wheel).namelist()
    for package in PACKAGES:
        assert f"{package}/py.typed" in names
    assert {"nxtdrive/tools/__init__.py", "nxtdrive/tools/web/static/app.js"} <= set(names)
    assert not [name for name in names if "tests/" in name or "tools/dev/" in name or "/rig/" in name]


def test_an_update_leaves_no_module_that_is_gone(tmp_path):
    """`pip install .` after `git pull` builds the wheel in the same folder as before."""
    sources = copy_sources(tmp_path / "sources")
    gone = sources / "tools" / "gone.py"
    for exists in (True, False):
        gone.touch() if exists else gone.unlink()
        _tool("build", "--no-isolation", "--wheel", "--outdir", tmp_path, sources)
        (wheel,) = tmp_path.glob("*.whl")
        assert ("nxtdrive/tools/gone.py" in zipfile.ZipFile(wheel).namelist()) is exists


def test_they_are_small(published):
    for path in published.iterdir():
        assert path.stat().st_size < MAX_MB * 1e6, path.name


def test_the_source_distribution_has_the_licences(published):
    (path,) = published.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {*FILES, "nxtdrive/drawing/fonts/LICENSE_DEJAVU"} <= names


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """A Python with this suite's packages except nxtdrive."""
    home = tmp_path_factory.mktemp("bare")
    make_environment(home)
    return python_of(home)


@pytest.fixture(scope="module")
def installed(published, bare):
    """A Python outside a checkout, into which pip has put the wheel; its dependencies are those of this suite."""
    (wheel,) = published.glob("*.whl")
    maker = getattr(sys, "_base_executable", sys.executable)
    pip = [maker, "-m", "pip", "--python", bare, "install", "--no-deps", "--no-index", "--quiet", wheel]
    done = subprocess.run(pip, capture_output=True, text=True, check=False, timeout=120)
    if "No module named pip" in done.stderr:
        pytest.skip("no pip")
    assert done.returncode == 0, done.stderr
    return bare


def test_the_wheel_runs_a_mission_outside_a_checkout(installed, tmp_path):
    (tmp_path / "small.toml").write_text(MISSION, encoding="utf-8")
    command = installed.with_name("nxtdrive")
    words = ("run", "small.toml", "--nxt", "sim://open", "--no-video")
    done = subprocess.run([command, *words], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads((tmp_path / "runs" / "small-001" / "summary.json").read_text(encoding="utf-8"))["achieved"]


@pytest.mark.nightly
@pytest.mark.parametrize(
    "words",
    [
        ("uv", "tool", "run", "--from"),
        ("uv", "tool", "run", "--resolution", "lowest-direct", "--from"),
        ("pipx", "run", "--spec"),
    ],
    ids=["uv", "uv-oldest-dependencies", "pipx"],
)
def test_the_wheel_runs_a_mission_without_being_installed(words, published, tmp_path):
    """These tools fetch its dependencies from the index."""
    pytest.importorskip(words[0], reason=f"{words[0]} is not installed")
    (wheel,) = published.glob("*.whl")
    (tmp_path / "small.toml").write_text(MISSION, encoding="utf-8")
    _tool(*words, wheel, "nxtdrive", "run", "small.toml", "--nxt", "sim://open", "--no-video", cwd=tmp_path)
    assert json.loads((tmp_path / "runs" / "small-001" / "summary.json").read_text(encoding="utf-8"))["achieved"]


def test_only_pythons_that_ran_the_suite_are_named():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = [each.rpartition(" ")[2] for each in project["classifiers"] if " :: 3." in each]
    assert named, "the classifiers name no Python"
    table = (ROOT / "docs" / "releasing.md").read_text(encoding="utf-8")
    assert set(named) == set(re.findall(r"^\| (3\.\d+) \| yes \|", table, re.MULTILINE))
