"""Sweeps: the same lines for any number of workers and after any interruption, even if a mission breaks."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from argparse import Namespace
from concurrent.futures import BrokenExecutor
from contextlib import suppress
from functools import partial

import numpy as np
import pytest
from sweep_results import broken_result, mission_result, target_result

from behaviors.executive import Executive
from behaviors.mission.robot import RobotFile, RobotTable
from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, main
from nxtdrive.cli.workers import open_workers
from nxtdrive.tools.sweep import agents, task
from nxtdrive.tools.sweep.causes import ChoiceEvaluation, FailureCause
from nxtdrive.tools.sweep.differences import difference
from nxtdrive.tools.sweep.result_file import read_results
from nxtdrive.tools.sweep.runner import InProcess, Workers, WorkersDied, local_workers, plan, sweep
from nxtdrive.tools.sweep.summary import (
    HEADLINE,
    aggregate,
    estimate,
    estimate_share,
    figures,
    reached_by,
    success_rate,
)
from nxtdrive.tools.sweep.tables import agent_rows, choice_rows, interval, reached_rows
from nxtdrive.tools.sweep.task import Task, evaluate, failed

TASKS = plan(["open", "absent"], [101], ["thesis", "oracle"], "geometric")

LONG_WORK = """
from nxtdrive.tools.sweep.runner import local_workers, plan
from nxtdrive.tools.sweep.task import evaluate
with local_workers(2) as workers:
    tasks = plan(["open"], range(100, 500), ["oracle"], "geometric")
    first, *_ = (workers.executor.submit(evaluate, task) for task in tasks)
    first.result()
    print("at work", flush=True)
"""


# one process performs the missions that all tests look at
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("sweep")]


@pytest.fixture(scope="module", name="results")
def _results():
    return [evaluate(task) for task in TASKS]


@pytest.mark.parametrize("number", [pytest.param(1, marks=pytest.mark.nightly), 2])
def test_the_file_does_not_depend_on_the_number_of_workers(number, results, tmp_path):
    out = tmp_path / "out.jsonl"
    with local_workers(number) as workers:
        assert sweep(TASKS, out, workers).results == results
    assert read_results(out) == results


def test_an_interrupted_sweep_continues_where_it_was(results, tmp_path):
    out, done = tmp_path / "out.jsonl", []
    whole = "".join(result.to_json() + "\n" for result in results)
    out.write_text(whole[: whole.index("\n") + 30], encoding="utf-8")
    assert sweep(TASKS, out, Workers(), progress=done.append).results == results
    assert done == results[1:], "neither repeated nor lost"
    assert out.read_text(encoding="utf-8") == whole


def test_each_mission_is_in_the_file_before_the_next_one_begins(tmp_path):
    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(TASKS, tmp_path / "out.jsonl", Workers(), progress=interrupt)
    assert len(read_results(tmp_path / "out.jsonl")) == 1


def test_the_result_of_each_call_is_taken_before_the_next_one_begins_in_this_process():
    order = []
    for name, future in Workers().run((name, partial(order.append, f"{name} begins")) for name in "ab"):
        assert future.done()
        order.append(f"{name} is taken")
    assert order == ["a begins", "a is taken", "b begins", "b is taken"]


def test_only_so_many_calls_are_submitted_ahead():
    class Recorder(InProcess):
        submitted = 0

        def submit(self, *args, **kwargs):
            self.submitted += 1
            return super().submit(*args, **kwargs)

    recorder = Recorder()
    found = []
    for number, future in Workers(recorder, ahead=3).run((number, partial(pow, number, 2)) for number in range(5)):
        found.append((number, future.result(), recorder.submitted))
    assert found == [(0, 0, 3), (1, 1, 4), (2, 4, 5), (3, 9, 5), (4, 16, 5)]


def test_a_worker_that_dies_is_reported_with_what_to_do():
    def die():
        with open_workers(Namespace(dask=None, workers=2), "Use fewer.") as workers:
            workers.executor.submit(os._exit, 1).result()

    with pytest.raises(ConfigError, match=r"^a worker died \(.*\)\. Use fewer\.$"):
        die()


def test_a_call_that_kills_the_workers_of_a_cluster_is_reported_with_what_to_do():
    with (
        pytest.raises(ConfigError, match=r"^a worker died \(4 workers died over it\)\. Use fewer\.$"),
        open_workers(Namespace(dask=None, workers=1), "Use fewer."),
    ):
        raise WorkersDied("4 workers died over it")


def test_no_worker_outlives_a_sweep_that_is_killed():
    with subprocess.Popen(
        [sys.executable, "-c", LONG_WORK], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout.readline() == "at work\n"
        program.kill()
        # the stream ends when no process holds its other end any more
        program.communicate(timeout=30)


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_during_a_mission_ends_a_sweep_with_its_own_exit_code(tmp_path, monkeypatch, name):
    """The mission ends in good order, so that the sweep learns of it by the mission's ending alone."""
    (tmp_path / f"sends_{name}.py").write_text(
        "import signal\n"
        "from behaviors.profiles.adaptive import AdaptiveProfile\n\n\n"
        "class Sender(AdaptiveProfile):\n"
        "    def skill(self, state, choice):\n"
        f"        signal.raise_signal(signal.{name})\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    words = ("sweep", "--classes", "open", "--seeds", "100", "--agents", f"sends_{name}:Sender")
    assert main([*words, "--out", str(tmp_path / "sweep.jsonl")]) == 128 + getattr(signal, name)


def test_an_interrupted_sweep_does_not_wait_for_missions_whose_results_are_dropped():
    with suppress(KeyboardInterrupt), local_workers(2) as workers:
        missions = [workers.executor.submit(time.sleep, 3600.0) for _ in range(4)]
        raise KeyboardInterrupt
    assert all(isinstance(mission.exception(), BrokenExecutor) for mission in missions)


def test_a_mission_that_breaks_is_a_line_and_the_sweep_continues(results, tmp_path, monkeypatch):
    def stuck(_robot):
        raise RuntimeError("two decisions at the same moment")

    monkeypatch.setitem(agents.AGENTS, "thesis", stuck)
    found = sweep(TASKS, tmp_path / "out.jsonl", Workers()).results
    assert [result.broke for result in found] == [True, False, True, False]
    assert found[0].error == "RuntimeError: two decisions at the same moment"
    assert found[1] == results[1]
    assert aggregate([result for result in found if result.agent == "thesis"], 1.0)["n_broken"] == 2


@pytest.mark.parametrize(("kind", "targets"), [("open", 2), ("absent", 1), ("flat", 3), ("big", 6)])
def test_a_mission_that_broke_reached_none_of_the_targets_that_it_had(kind, targets):
    broken = failed(Task(0, kind, 100, "thesis", "geometric"), RuntimeError("lost"))
    assert json.loads(broken.to_json())["unreached"] == targets
    assert reached_by([broken, mission_result(target_result(9.0))], np.array([10.0])).tolist() == [1 / (targets + 1)]


def test_a_mission_whose_room_cannot_be_generated_had_the_usual_number_of_targets(monkeypatch):
    def broken(_kind, _seed):
        raise RuntimeError("no room")

    monkeypatch.setattr(task, "generate_scenario", broken)
    assert evaluate(Task(0, "flat", 100, "thesis", "geometric")).unreached == 2


def test_ctrl_c_ends_the_sweep_and_not_just_the_mission(tmp_path, monkeypatch):
    def interrupt(record):
        if record.time_s > 1.0:
            raise KeyboardInterrupt

    def interrupted(robot):
        return Executive(robot.mission, robot.ports, [*robot.observers, interrupt]).run()

    monkeypatch.setitem(agents.AGENTS, "thesis", interrupted)
    with pytest.raises(KeyboardInterrupt):
        sweep(TASKS, tmp_path / "out.jsonl", Workers())
    assert read_results(tmp_path / "out.jsonl") == []


def test_an_interrupted_command_says_how_to_continue(tmp_path, monkeypatch, capsys):
    def interrupt(_robot):
        raise KeyboardInterrupt

    monkeypatch.setitem(agents.AGENTS, "thesis", interrupt)
    out = tmp_path / "out.jsonl"
    words = ["--classes", "open", "--seeds", "100", "--profiles", "thesis", "--out", str(out)]
    assert main(["sweep", *words]) == 128 + signal.SIGINT
    said = "".join(capsys.readouterr().err.split())  # where lines are broken depends on the length of the path
    assert "".join(f"are in {out}: continue with --resume".split()) in said
    assert set(json.loads(out.with_suffix(".summary.json").read_text())) >= {"versions", "command"}


def test_another_file_is_not_taken_for_a_sweeps(tmp_path):
    (tmp_path / "x.jsonl").write_text('{"kind": "start"}\n', encoding="utf-8")
    with pytest.raises(ConfigError, match="not the file of a sweep"):
        read_results(tmp_path / "x.jsonl")


def test_lines_have_the_names_of_lerobot(results):
    for index, line in enumerate(json.loads(result.to_json()) for result in results):
        assert line["episode_index"] == index
        assert {"seed", "success", "sum_reward", "max_reward"} <= line.keys()
    figures = aggregate([result for result in results if result.agent == "oracle"], 4.0)
    assert figures["pc_success"] == 100.0
    assert figures["avg_sum_reward"] == 1.5, "the absent target cannot be reached"
    assert figures["eval_ep_s"] == 2.0


def test_the_interval_of_a_mean_holds_it_and_narrows_with_more_missions():
    few, many = (estimate([(i % 2, 1.0) for i in range(number)]) for number in (20, 2000))
    assert few.mean == many.mean == 0.5
    assert few.low < many.low < 0.5 < many.high < few.high
    assert many.high - many.low == pytest.approx(2 * 1.96 * 0.5 / math.sqrt(2000), rel=0.15)
    assert math.isnan(estimate([]).mean)


def test_one_mission_has_no_interval():
    all_reached = estimate([(2.0, 2.0), (0.0, 0.0)])
    assert (all_reached.mean, all_reached.number) == (1.0, 2)
    assert interval(all_reached) == interval(estimate_share([(2.0, 2.0), (0.0, 0.0)])) == "1.000"


def test_all_or_none_of_a_few_missions_are_not_certain():
    """Wilson's interval of 4 of 4 and 0 of 4 missions: targets of one mission are not independent."""
    assert interval(estimate_share([(2.0, 2.0)] * 4)) == "1.000 [0.510, 1.000]"
    assert interval(estimate_share([(0.0, 2.0)] * 4)) == "0.000 [0.000, 0.490]"
    some = [(1.0, 2.0), (2.0, 2.0)]
    assert estimate_share(some) == estimate(some)


def test_tables_and_summary_have_the_same_interval_of_all_reached():
    results = [mission_result(target_result(9.0), seed=seed) for seed in range(4)]
    assert aggregate(results, 1.0)["figures"]["success"] == pytest.approx([1.0, 0.5101, 1.0, 4], abs=1e-4)
    assert agent_rows(results)[0][1] == "1.000 [0.510, 1.000]"
    assert reached_rows(results)[0][1] == "1.000 [0.510, 1.000]"
    assert figures(results, HEADLINE)["by 60 s"].low == pytest.approx(0.5101, abs=1e-4)


def test_agents_are_compared_on_the_same_scenarios():
    def results(*times_s):
        return [mission_result(target_result(time_s), seed=seed) for seed, time_s in enumerate(times_s)]

    better = difference(results(9.0, 9.0, 9.0, None), results(None, 9.0, None, None))
    assert better.mean == 0.5
    assert success_rate(results(9.0)[0]) == (1.0, 1.0)


def test_a_mission_that_broke_counts_in_a_comparison_as_many_targets_as_there_are():
    reached, broken = mission_result(target_result(9.0)), broken_result()
    assert difference([reached], [broken]).mean == 1.0
    assert difference([broken], [reached]).mean == -1.0
    assert difference([broken], [reached]).number == 1


def test_tables_show_what_was_chosen_for_each_cause_and_how_soon_targets_were_reached():
    choices = [
        ChoiceEvaluation(FailureCause.MISSED, choice, None) for choice in ("rescan", "rescan", "move_to", "back_up")
    ]
    results = [mission_result(*map(target_result, (20.0, 59.0, None)), choices=choices)]
    columns, rows = choice_rows(results)
    assert [dict(zip(columns, row, strict=True)) for row in rows] == [
        {
            "agent": "adaptive",
            "cause": "missed",
            "fitting": "rescan",
            "wait": "0",
            "detour": "0",
            "move_to": "1",
            "rescan": "2",
            "other": "1",
        }
    ]
    (row,) = reached_rows(results)
    assert [cell.split()[0] for cell in row] == ["adaptive", "0.333", "0.667", "0.667", "0.667"]


def test_the_command_prints_tables_and_draws_maps(here, refused, printed):
    words = ["sweep", "--classes", "open", "--seeds", "100", "--profiles", "oracle", "--out", "out.jsonl"]
    shown = printed(*words)
    assert "oracle" in shown
    assert "path efficiency" in shown
    assert "SoftSPL" not in shown
    assert "--resume" in refused(*words)
    shown = printed(*words, "--resume", "--tables")
    assert "SoftSPL" in shown
    assert "targets reached by [95 %]" in shown
    shown = printed(*words, "--resume", "--json")
    assert json.loads(shown)["policies"]["oracle"]["pc_success"] == 100.0
    assert "NaN" not in shown  # JSON has none
    assert main(["sweep", "--map", "open:100:oracle"]) == DONE
    assert (here / "open-100-oracle.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["--classes", "opne"], "open"),
        (["--policies", "nobody"], "random-walk"),
        (["--map", "open:oracle"], "CLASS:SEED:AGENT"),
        (["--map", "open:100:oracle", "--robot", "nowhere.toml"], "nowhere.toml"),
    ],
)
def test_usage_errors_list_the_valid_choices(words, hint, here, refused):
    assert hint in refused("sweep", *words)


def test_missions_with_another_robot_file_are_other_missions(tmp_path):
    out, done = tmp_path / "out.jsonl", []
    askew, askew_again, straight = (RobotFile(robot=RobotTable(axle_track_mm=mm)) for mm in (150.0, 150.0, 112.0))
    for robot in (RobotFile(), askew, askew_again, straight, RobotFile()):
        tasks = plan(["open"], [100], ["oracle"], "geometric", robot)
        swept = sweep(tasks, out, Workers(), progress=done.append)
        assert swept.results == [evaluate(task) for task in tasks]
    assert len(done) == 3
    assert "robot" not in json.loads(done[0].to_json()), "lines of earlier versions have no robot file"
    assert len({result.robot for result in done}) == 3


def test_missions_use_the_dimensions_of_the_robot_file():
    plain, askew = (
        evaluate(plan(["open"], [100], ["adaptive"], "geometric", robot)[0])
        for robot in (RobotFile(), RobotFile(robot=RobotTable(axle_track_mm=150.0)))
    )
    assert plain != askew


def test_figures_without_values_are_null_and_no_nan():
    values = aggregate([], 1.0)
    assert values["figures"]["success"][0] is None
    json.dumps(values, allow_nan=False)
