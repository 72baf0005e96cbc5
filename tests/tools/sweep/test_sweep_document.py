"""The pages on evaluation and reality name every class and policy."""

from pathlib import Path

import pytest

from nxtdrive.tools.sweep.policies import ALL_NAMES
from sim_backend.scenarios.classes import ALL_CLASSES

DOCS = Path(__file__).parents[3] / "docs"
PAGES = "".join((DOCS / page).read_text(encoding="utf-8") for page in ("evaluation.md", "reality.md"))


@pytest.mark.parametrize("name", [*ALL_CLASSES, *ALL_NAMES])
def test_every_class_and_policy_has_its_row(name):
    assert f"| `{name}` |" in PAGES
