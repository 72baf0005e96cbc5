"""The agent's lines, from records alone; whole consoles are in tests/missions."""

import pytest

from behaviors.journal import Record, RecordKind
from behaviors.recoveries import RECOVERIES
from behaviors.thesis.console import Console

SILENT = [
    *(
        Record(1.0, RecordKind.CHOICE, "select", "lena", {"choice": name, "why": "it pays"})
        for name in sorted(RECOVERIES)
    ),
    Record(1.0, RecordKind.SENSOR, "search", "lena", {"sensor": "sonar", "answers": False, "error": "no cable"}),
    Record(1.0, RecordKind.TRANSITION, "search", "lena", {"source": "up", "to": "down", "reason": "camera_lost"}),
    Record(1.0, RecordKind.OUTAGE, "suspended", "lena", {"part": "camera", "left_s": 60.0}),
]


@pytest.mark.parametrize("record", SILENT, ids=str)
def test_the_thesiss_agent_says_nothing_of_choices_and_outages(record):
    lines = []
    Console(lines.append)(record)
    assert lines == []
