"""docs/journal.md names everything that a journal may hold."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from behaviors.chart import MISSION_STATES
from behaviors.events import Reason
from behaviors.evidence import AlternativeTarget, Detour, Evidence, Viewpoint
from behaviors.failures import Blocker
from behaviors.journal import RecordKind
from behaviors.recoveries import RECOVERIES, Choice

DOCUMENT = (Path(__file__).parents[2] / "docs" / "journal.md").read_text(encoding="utf-8")
KEYS = {
    field.name
    for values in (Blocker, Choice, Detour, Evidence, AlternativeTarget, Viewpoint)
    for field in dataclasses.fields(values)
}


@pytest.mark.parametrize("name", [*RecordKind, *Reason, *sorted(KEYS - {"kind"})])
def test_every_kind_reason_and_key_is_explained(name):
    assert f"`{name}`" in DOCUMENT


@pytest.mark.parametrize("name", [*MISSION_STATES, *RECOVERIES])
def test_every_state_and_choice_is_named(name):
    assert name in DOCUMENT
