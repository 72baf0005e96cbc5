"""The wheel, installed by pip from a local folder with the guest's own Python, without a network."""

import shutil
import subprocess
import sys

import pytest

from tests.hil.conftest import ROOT

PYTHONS = ["/usr/bin/python3", "python3.12", "python3.13", "python3.14"]
"""The distribution's, and newer ones where this computer has them."""


def pip(*arguments):
    """Run pip on this computer, as the README does."""
    done = subprocess.run([sys.executable, "-m", "pip", *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"pip cannot get the packages: {done.stderr[-300:]}")


@pytest.fixture(params=PYTHONS)
def python(request):
    """A Python of this computer, and so of the guest."""
    found = shutil.which(request.param)
    if found is None:
        pytest.skip(f"no {request.param} here")
    return found


def test_pip_installs_the_wheel_and_the_command_reaches_the_brick(bench, python, tmp_path_factory):
    version = subprocess.check_output([python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"], text=True)
    folder = tmp_path_factory.mktemp("wheels")
    pip("wheel", "-q", "--no-deps", "-w", str(folder), str(ROOT))
    [wheel] = folder.glob("nxtdrive-*.whl")
    only = ("--only-binary", ":all:", "--python-version", version.strip(), "-d", str(folder))
    pip("download", "-q", *only, str(wheel), "pip")
    done = bench.run(
        f"{python} -m venv --without-pip v && {python} {folder}/pip-*.whl/pip --python v/bin/python install -q "
        f"--no-index --find-links {folder} nxtdrive && v/bin/nxtdrive --version && v/bin/nxtdrive info --nxt usb://",
        timeout_s=240,
    )
    assert done.code == 0, done.err + done.out
    assert "NXT" in done.out
