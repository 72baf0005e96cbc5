"""A sweep's tables can be read on a terminal of any usual width."""

import io

import pytest
from rich.console import Console
from sweep_results import mission_result, target_result

from nxtdrive.tools.sweep.agents import ALL_NAMES
from nxtdrive.tools.sweep.causes import ChoiceEvaluation, FailureCause
from nxtdrive.tools.sweep.tables import AGENT_COLUMNS, print_tables
from sim_backend.scenarios.classes import CLASSES

CHOICES = [ChoiceEvaluation(cause, "wait", 1.0) for cause in FailureCause]
TARGET = target_result(5.0, wrong_stops=1, sct=0.5)
RESULTS = [
    mission_result(
        TARGET, kind=kind, agent=agent, duration_s=900.5, contacts=12, recognition_s=[123.5], choices=CHOICES
    )
    for kind, agent in [*((kind, "thesis") for kind in CLASSES), *(("open", agent) for agent in ALL_NAMES[1:])]
]


def _printed(width):
    out = io.StringIO()
    print_tables(RESULTS, Console(file=out, width=width))
    return out.getvalue()


@pytest.mark.parametrize("width", [60, 80, 100, 180])
def test_every_word_of_the_tables_is_shown_whole(width):
    text = _printed(width)
    assert "…" not in text
    for word in (*ALL_NAMES, *CLASSES, *AGENT_COLUMNS, *FailureCause, "contact-free", "0.500"):
        assert word in text
    assert max(map(len, text.splitlines())) <= width


def test_a_table_that_fits_is_one_table():
    assert "agents, continued" not in _printed(180)
    assert "agents, continued" in _printed(80)
