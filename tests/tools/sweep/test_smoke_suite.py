"""What must hold for the smoke suite's missions of both profiles, performed as ``nxtdrive sweep --workers 2`` does.

The missions of some classes; those of all classes every night.
"""

import pytest

from nxtdrive.cli.commands.sweep import SUITES
from nxtdrive.tools.sweep.chart_coverage import transitions
from nxtdrive.tools.sweep.runner import local_workers, plan, sweep
from nxtdrive.tools.sweep.task import evaluate
from sim_backend.scenarios.classes import CLASSES

# one process performs the missions that all tests look at
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("smoke suite")]

WORKERS = 2
PROFILES = ("thesis", "adaptive")
(FIRST, LAST), AGENTS = SUITES["smoke"]
TASKS = plan(list(CLASSES), range(FIRST, LAST + 1), PROFILES, "geometric")
REPEATED = {("link", "adaptive"), ("moved", "thesis")}
"""A link with outages, the other profile."""
SAMPLE = {kind for kind, _ in REPEATED}


@pytest.fixture(scope="module", name="results", params=["some", pytest.param("all", marks=pytest.mark.nightly)])
def _results(request, tmp_path_factory):
    out = tmp_path_factory.mktemp("smoke") / "smoke.jsonl"
    tasks = TASKS if request.param == "all" else [task for task in TASKS if task.kind in SAMPLE]
    with local_workers(WORKERS) as workers:
        return sweep(tasks, out, workers).results


def _targets(results, agent):
    return [target for result in results if result.agent == agent for target in result.targets]


def test_the_tasks_are_those_of_the_smoke_suite():
    assert set(PROFILES) <= set(AGENTS)
    assert len(plan(list(CLASSES), range(FIRST, LAST + 1), AGENTS, "geometric")) >= 60
    assert {task.kind for task in TASKS} > SAMPLE


def test_no_mission_broke(results):
    assert [(result.kind, result.agent, result.error) for result in results if result.broke] == []


def test_the_missions_take_only_transitions_of_the_chart(results):
    names = set(transitions())
    assert [result.kind for result in results if not {"idle: start"} <= {*result.transitions} <= names] == []


def test_the_adaptive_profile_reaches_at_least_as_many_targets_as_the_thesis(results):
    thesis, adaptive = (sum(target.success for target in _targets(results, agent)) for agent in PROFILES)
    assert adaptive >= thesis > 0


def test_the_adaptive_profile_never_stops_at_something_else(results):
    assert [target for target in _targets(results, "adaptive") if target.wrong_stops] == []


@pytest.mark.parametrize(("kind", "agent"), sorted(REPEATED))
def test_the_same_mission_gives_the_same_line_in_another_process(kind, agent, results):
    (task,) = (task for task in TASKS if (task.kind, task.agent) == (kind, agent))
    (result,) = (result for result in results if (result.kind, result.agent) == (kind, agent))
    assert evaluate(task) == result
