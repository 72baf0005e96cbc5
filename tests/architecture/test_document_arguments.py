"""The programs of commands that documents show and no test runs accept the arguments.

test_documents.py does the same for all commands of nxtdrive.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.architecture.document_blocks import EXAMPLES, IN_A_SHELL, PARSED, ROOT, blocks, commands, reason
from tests.architecture.environments import FILES

OTHERS = sorted(
    {
        each
        for _, _, text in blocks("", "sh")
        for each in commands(text)
        if reason(each) in PARSED.values() and not each.startswith("nxtdrive ")
    }
)
SHELL_BLOCKS = [
    pytest.param(page, said, id=f"{page}-{number}")
    for page, number, text in blocks("", "sh")
    if (said := [each for each in commands(text) if IN_A_SHELL.search(each) and not reason(each)])
]
PYTHON = getattr(sys, "_base_executable", sys.executable)
WHOLE_SUITE = ".venv/bin/pytest"
"""What a page outside the examples says to run the suite, of which this test is a part."""

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("command", OTHERS)
def test_other_programs_accept_the_arguments(command):
    program, *words = shlex.split(command, comments=True)
    if program == "dask":
        from distributed.cli import dask_scheduler, dask_worker

        {"scheduler": dask_scheduler, "worker": dask_worker}[words[0]].main.make_context(program, words[1:])
    else:
        from tools.dev.faults import __main__ as faults
        from tools.rig import __main__ as rig

        {"tools.rig": rig, "tools.dev.faults": faults}[words[1]]._arguments(words[2:])


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """What of a checkout pip and the examples' tests need, with the environment of the README's first command."""
    if subprocess.run([PYTHON, "-m", "pip", "--version"], capture_output=True, check=False).returncode:
        pytest.skip("no pip")
    folder = tmp_path_factory.mktemp("checkout")
    for name in (*FILES, "nxtdrive/drawing/fonts/LICENSE_DEJAVU"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    shutil.copytree(EXAMPLES, folder / "examples", ignore=shutil.ignore_patterns(".venv", "__pycache__"))
    shutil.copytree(EXAMPLES / "lesson" / "solutions", folder / "examples" / "lesson" / "pupils" / "ann")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / ".venv"], check=True, timeout=60)
    return folder


@pytest.mark.skipif(sys.platform == "win32", reason="needs a POSIX shell")
@pytest.mark.parametrize(("page", "said"), SHELL_BLOCKS)
def test_a_shell_accepts_what_sets_up_an_environment_or_tests(page, said, checkout):
    """Pip resolves and installs nothing, pytest collects and runs nothing; the suite's packages count as installed."""
    folder = (checkout / page).parent if page.startswith("examples/") else checkout
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")} | {
        "PATH": os.pathsep.join((os.path.dirname(sys.executable), os.environ["PATH"])),
        "PYTHONPATH": os.pathsep.join((str(ROOT), sysconfig.get_path("purelib"))),
        "PIP_DRY_RUN": "1",
        "PIP_NO_INDEX": "1",
        "PIP_NO_DEPS": "1",
        "PIP_NO_BUILD_ISOLATION": "0",  # pip reads it as the value of "isolation"
        "PYTEST_ADDOPTS": "--collect-only -p no:cacheprovider -p nxtdrive.pytest_plugin",
    }
    lines = [_here(each, checkout) for each in said if folder != checkout or each != WHOLE_SUITE]
    ended = subprocess.run(
        ["bash", "-eo", "pipefail", "-c", "\n".join(lines)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    collecting = [each for each in lines if "pytest" in each and "-m pip" not in each]
    assert len(re.findall(r"\d tests? collected", ended.stdout)) == len(collecting), ended.stdout


def _here(line: str, checkout: Path) -> str:
    """Return a command with this computer's interpreters and folders, and those of Windows as they are called here."""
    line = line.replace(".venv\\Scripts\\python -m pip", "python3 -m pip --python .venv").replace("\\", "/")
    line = line.replace("py -m venv", "python3 -m venv --without-pip").replace("path/to/nxtdrive", str(checkout))
    line = line.replace("python3 -m", f"{shlex.quote(PYTHON)} -m").replace(".venv/bin/pytest", "pytest")
    if line.startswith("pip3 "):
        return f"(cd {checkout} && {shlex.quote(PYTHON)} -m pip {line.removeprefix('pip3 ')}\n)"
    return f"(cd {ROOT} && {line.removeprefix('.venv/bin/')}\n)" if "tests/hil" in line else line
