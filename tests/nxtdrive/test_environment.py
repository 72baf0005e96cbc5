"""The pip commands of remedies work in the environment that they are printed in."""

import shlex
import subprocess
import sys
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PRINT = "from nxtdrive.host.environment import pip_command; print(pip_command('debug'))"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="the shell is POSIX's here")
@pytest.mark.parametrize("with_pip", [True, False])
def test_the_printed_command_works_on_the_environment_that_printed_it(tmp_path, with_pip):
    folder = tmp_path / "my env"
    venv.create(folder, with_pip=with_pip)
    python = folder / "bin" / "python3"
    printed = subprocess.run([python, "-c", PRINT], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    done = subprocess.run(shlex.split(printed), capture_output=True, text=True, check=True)
    assert f"sys.executable: {python}" in done.stdout
