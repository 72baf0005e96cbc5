"""The pages on evaluation and reality name every class and agent."""

from pathlib import Path

import pytest

from nxtdrive.tools.sweep.agents import ALL_NAMES
from sim_backend.scenarios.classes import ALL_CLASSES

DOCS = Path(__file__).parents[3] / "docs"
PAGES = "".join((DOCS / page).read_text(encoding="utf-8") for page in ("evaluation.md", "reality.md"))


@pytest.mark.parametrize("name", [*ALL_CLASSES, *ALL_NAMES])
def test_every_class_and_agent_has_its_row(name):
    assert f"| `{name}` |" in PAGES
