"""docs/reliability.md states every campaign with its guarantee and its full number of trials."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from nxtdrive.tools.dev.faults.__main__ import CAMPAIGNS, load

DOCUMENT = (Path(__file__).parents[2] / "docs" / "reliability.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_each_campaign_has_its_guarantee_and_its_figures(name):
    campaign = load(name)
    assert f"(`{name}`)" in DOCUMENT
    assert re.search(rf"^\| `{name}` \| {campaign.count:,} [a-z ]+\| \d+ \| \d+", DOCUMENT, flags=re.MULTILINE)
