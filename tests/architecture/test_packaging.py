"""nxtdrive runs in a bare checkout, and from a plain installation inside a checkout or elsewhere."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

from tests.architecture.environments import PACKAGES, ROOT, make_environment, python_of
from tests.small_mission import MISSION

DOORS = """
from nxtdrive.tools.dev.bench_doors import measure_doors
print(*(figure.name for figure in measure_doors(round_trips=3, repeats=1, passes=50)), sep="\\n")
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("packaging"),
    pytest.mark.skipif(sys.platform == "win32", reason="needs symbolic links"),
]


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """A Python that has the dependencies of nxtdrive and not nxtdrive itself."""
    home = tmp_path_factory.mktemp("bare")
    make_environment(home)
    return python_of(home)


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """A fresh checkout without traces of an installation."""
    root = tmp_path_factory.mktemp("checkout")
    for package in (*PACKAGES, "tools"):
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("__pycache__"))
    return root


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A Python into which ``pip install .`` has put nxtdrive."""
    home = tmp_path_factory.mktemp("installed")
    packages = make_environment(home)
    for package in PACKAGES:
        shutil.copytree(ROOT / package, packages / package, ignore=shutil.ignore_patterns("tools", "__pycache__"))
    shutil.copytree(
        ROOT / "tools", packages / "nxtdrive" / "tools", ignore=shutil.ignore_patterns("dev", "__pycache__")
    )
    return python_of(home)


def _run(python, *words, cwd, code=0):
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    ended = subprocess.run(
        [python, *words], cwd=cwd, env=environment, capture_output=True, text=True, check=False, timeout=120
    )
    assert ended.returncode == code, ended.stdout + ended.stderr
    return ended.stdout if code == 0 else ended.stderr


def test_a_bare_checkout_runs_missions(bare, checkout, tmp_path):
    mission = tmp_path / "small.toml"
    mission.write_text(MISSION, encoding="utf-8")
    words = ("run", mission, "--nxt", "sim://open", "--no-video", "--out", tmp_path)
    assert "summary.json" in _run(bare, "-m", "nxtdrive", *words, cwd=checkout)
    assert _run(bare, "-m", "nxtdrive", "--version", cwd=checkout) == "nxtdrive 0+checkout\n"


@pytest.mark.nightly
def test_a_bare_checkout_measures(bare, checkout):
    assert "import nxtdrive, CPU" in _run(bare, "-m", "nxtdrive", "bench", "import", cwd=checkout)
    assert "requests over USB" in _run(bare, "-c", DOORS, cwd=checkout), "in processes of its own, too"


@pytest.mark.nightly
def test_the_plain_installation_measures_with_the_checkout_it_is_called_in(installed, checkout):
    # -P as in the script `nxtdrive`: the current folder is not searched for modules
    assert "import nxtdrive, CPU" in _run(installed, "-P", "-m", "nxtdrive", "bench", "import", cwd=checkout)
    assert "requests over USB" in _run(installed, "-c", DOORS, cwd=checkout), "in processes of its own, too"


def test_elsewhere_the_plain_installation_says_that_measuring_needs_a_checkout(installed, tmp_path):
    assert "needs a checkout" in _run(installed, "-m", "nxtdrive", "bench", cwd=tmp_path, code=2)


def test_a_checkout_and_its_installation_count_as_the_same_nxtdrive(bare, checkout, installed, tmp_path):
    same = "from nxtdrive.tools.sweep.cluster import installed; print(installed().sources)"
    assert _run(bare, "-c", same, cwd=checkout) == _run(installed, "-c", same, cwd=tmp_path)
