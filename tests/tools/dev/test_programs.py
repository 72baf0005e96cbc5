"""The programs of tools/dev explain themselves."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PROGRAMS = sorted(
    path.stem for path in (ROOT / "tools" / "dev").glob("*.py") if '"__main__"' in path.read_text(encoding="utf-8")
)


@pytest.mark.slow
@pytest.mark.parametrize("name", PROGRAMS)
def test_help_is_printed_and_nothing_is_done(name, tmp_path):
    command = [sys.executable, "-m", f"tools.dev.{name}", "--help"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout[:6]) == (0, "usage:"), done.stderr
    assert not list(tmp_path.iterdir())
