"""The pip commands of remedies work in the environment that they are printed in."""

import shlex
import subprocess
import sys
import types
import venv
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

from firmware_protocol.errors import ConfigError
from nxtdrive.host.environment import install_extra, require

ROOT = Path(__file__).parents[2]
PRINT = "from nxtdrive.host.environment import pip_command; print(pip_command('debug'))"
MAKER = getattr(sys, "_base_executable", sys.executable)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="the shell is POSIX's here")
@pytest.mark.parametrize("with_pip", [pytest.param(True, marks=pytest.mark.nightly), False])
def test_the_printed_command_works_on_the_environment_that_printed_it(tmp_path, with_pip):
    if not with_pip and subprocess.run([MAKER, "-c", "import pip"], capture_output=True, check=False).returncode:
        pytest.skip(f"{MAKER} has no pip")
    folder = tmp_path / "my env"
    venv.create(folder, with_pip=with_pip)
    python = folder / "bin" / "python3"
    printed = subprocess.run([python, "-c", PRINT], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    done = subprocess.run(shlex.split(printed), capture_output=True, text=True, check=True)
    assert f"sys.executable: {python}" in done.stdout


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="the shell is POSIX's here")
def test_an_environment_of_uv_is_uv_s_to_install_in(tmp_path):
    venv.create(tmp_path, with_pip=False)
    with (tmp_path / "pyvenv.cfg").open("a") as settings:
        settings.write("uv = 0.9.7\n")
    python = tmp_path / "bin" / "python3"
    printed = subprocess.run([python, "-c", PRINT], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert shlex.split(printed) == ["uv", "pip", "debug", "--python", str(python)]


def test_an_extra_is_that_of_the_installed_package(monkeypatch):
    assert shlex.split(install_extra("tui"))[-1] == "nxtdrive[tui]"


def test_without_an_installation_the_extra_is_the_checkout_s_and_no_index_is_asked_for_the_name(monkeypatch):
    def missing(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr("nxtdrive.host.environment.distribution", missing)
    assert shlex.split(install_extra("tui"))[-1] == f"{ROOT}[tui]"


def test_a_remedy_is_printed_without_a_warning_of_setuptools(monkeypatch):
    """Its hook warns when pip is looked for after distutils was imported; warnings are errors here."""
    monkeypatch.setitem(sys.modules, "distutils", types.ModuleType("distutils"))
    assert install_extra("tui")


def test_a_missing_package_is_named_by_its_extra():
    require("tui", "json", what="teleop")
    with pytest.raises(ConfigError, match=r"^teleop needs the extra nxtdrive\[tui\], .*: .*nxtdrive\[tui\]"):
        require("tui", "json", "nosuchpackage", what="teleop")
