"""The page on evaluation names every class and policy."""

from pathlib import Path

import pytest

from nxtdrive.tools.sweep.policies import ALL_NAMES
from sim_backend.scenarios.classes import CLASSES

PAGE = (Path(__file__).parents[3] / "docs" / "evaluation.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [*CLASSES, *ALL_NAMES])
def test_every_class_and_policy_has_its_row(name):
    assert f"| `{name}` |" in PAGE
