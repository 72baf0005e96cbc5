"""The wheel, installed by pip from a local folder with the guest's own Python, without a network."""

import contextlib
import subprocess
import sys
from pathlib import Path

import pytest

from tests.architecture.environments import copy_sources
from tests.hil.conftest import MISSION_S

DISTRIBUTION, NEWEST = "the distribution's", "the newest"
NEWER = ["3.14", "3.13", "3.12"]
"""Newer ones, of which the first is taken that this computer has, built by pyenv or by name."""

NEW_FILES = "echo 2 > /proc/sys/vm/drop_caches"
"""Makes the guest forget which files its host does not have."""


def pip(*arguments):
    """Run pip of the Python that made this environment, which may have none itself."""
    done = subprocess.run(
        [getattr(sys, "_base_executable", sys.executable), "-m", "pip", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        pytest.skip(f"pip cannot get the packages: {done.stderr[-300:]}")


def works(name):
    """Whether there is such a Python."""
    with contextlib.suppress(OSError, subprocess.CalledProcessError):
        subprocess.run([name, "-c", "import venv"], check=True, capture_output=True)
        return True
    return False


def candidates(version):
    """Return the names under which a Python may be found."""
    return [*map(str, sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python3"))), f"python{version}"]


@pytest.fixture(params=[DISTRIBUTION, NEWEST])
def python(request):
    """A Python of this computer, and so of the guest."""
    newer = [name for version in NEWER for name in candidates(version)]
    names = ["/usr/bin/python3"] if request.param == DISTRIBUTION else newer
    return next(filter(works, names), None) or pytest.skip(f"no Python here of {names}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the wheel."""
    folder = tmp_path_factory.mktemp("wheels")
    pip("wheel", "-q", "--no-deps", "-w", str(folder), str(copy_sources(tmp_path_factory.mktemp("source"))))
    return folder


def test_pip_installs_the_wheel_and_the_command_reaches_the_brick(bench, python, folder):
    version = subprocess.check_output([python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"], text=True)
    [wheel] = folder.glob("nxtdrive-*.whl")
    only = ("--only-binary", ":all:", "--python-version", version.strip(), "-d", str(folder))
    pip("download", "-q", *only, str(wheel), "pip")
    [pip_wheel] = folder.glob("pip-*.whl")
    done = bench.run(
        f"{NEW_FILES}; rm -rf v; {python} -m venv --without-pip v && {python} {pip_wheel}/pip --python v/bin/python "
        f"install -q --no-compile --no-index --find-links {folder} nxtdrive && v/bin/nxtdrive info --nxt usb://; "
        "code=$?; rm -rf v; exit $code",
        timeout_s=MISSION_S,
    )
    assert done.code == 0, done.err + done.out
    assert "NXT" in done.out
