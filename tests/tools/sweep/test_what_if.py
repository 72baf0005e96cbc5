"""What other candidates would have cost: missions repeat bit by bit, futures differ, and the regret has no bias."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from behaviors.journal import Record, RecordKind
from behaviors.mission import described_by
from behaviors.mission.robot import RobotFile
from nxtdrive.cli.main import main
from nxtdrive.mission.files import read_mission_file, with_profile
from nxtdrive.recording.decision_costs import DecisionCosts, decision_costs
from nxtdrive.recording.run_folder import new_run_folder
from nxtdrive.recording.run_reader import read_run
from nxtdrive.tools.sweep.forks import CAN_FORK, Forks
from nxtdrive.tools.sweep.regret import regret
from nxtdrive.tools.sweep.result_file import ResultFile
from nxtdrive.tools.sweep.what_if import (
    Branch,
    DecisionPoint,
    EpisodeOutcome,
    Futures,
    branch_costs,
    run_with_branch,
)
from nxtdrive.tools.sweep.what_if_file import ExaminedMission, read_missions
from nxtdrive.tools.sweep.what_if_result import keep, mean_figures
from nxtdrive.tools.sweep.what_if_source import GeneratedMission, read_recorded
from sim_backend.simulation import Simulation

WAIT = {"does": "wait", "chosen": True, "best": True, "cost_s": [1.0, 0.5, 1.5]}
LEAVE = {"does": "leave this target", "chosen": False, "best": False, "cost_s": [2.0, 1.5, 2.5]}
DECISION = {
    **{"decision": 1, "t": 1.0, "target": "a", "reason": "never_seen", "futures": 2, "regret_s": 2.0},
    **{"biased_regret_s": 2.5, "beyond_best_s": [0.0, 0.0, 0.0], "candidates": [WAIT, LEAVE]},
}
SOURCE = GeneratedMission("wall_start", 103, "adaptive")
ASKED = {"decision": None, "sample": None, "futures": 2}
"""What is asked of a mission by `WHAT_IF`."""
WHAT_IF = ("--futures", "2", "--workers", "1")


def _command_for(folder, decisions):
    """The command for a mission of which its file has the decisions already."""
    out = folder / "regret.jsonl"
    with ResultFile(out) as file:
        file.append(json.dumps({"run": "open:100", **ASKED, "decisions": decisions}))
    return ["what-if", "open:100", "--out", str(out), *WHAT_IF]


def _recorded_run(folder, target, table="", *words):
    """Run a mission with one picture, and return the folder of the run."""
    mission = folder / "short.toml"
    mission.write_text(
        f'[mission]\ntargets = ["{target}"]\n{table}\n'
        f'[target.{target}]\ndetector = "picture"\npictures = ["{target}.png"]\nheight_mm = 297\n'
    )
    main(["run", str(mission), *words, "--no-video", "--out", str(folder)])
    (run,) = folder.glob("*-001")
    return run


def test_the_regret_of_equal_candidates_is_nothing_on_average():
    random = np.random.default_rng(1)
    found = [regret(random.normal(30.0, 10.0, (4, 6))) for _ in range(300)]
    assert np.mean([each.seconds for each in found]) == pytest.approx(0.0, abs=1.2)
    assert np.mean([each.biased_s for each in found]) > 3.0


def test_the_regret_of_a_choice_that_is_worse_is_what_it_costs_more():
    random = np.random.default_rng(2)
    costs = random.normal(30.0, 1.0, (3, 6)) + np.array([[20.0], [8.0], [0.0]])
    found = regret(costs)
    assert found.best == 2
    assert found.seconds == pytest.approx(20.0, abs=2.0)
    assert found.interval.low <= found.biased_s <= found.interval.high


def test_figures_over_missions_count_decisions_and_resample_missions():
    missions = [
        ExaminedMission(run="open:100", decisions=[{**DECISION, "regret_s": regret_s} for regret_s in regrets_s])
        for regrets_s in ([0.0, 2.0], [10.0], [], [4.0])
    ]
    figures = mean_figures(missions)
    mean_s, low_s, high_s = figures["regret_s"]
    assert (mean_s, figures["nearly_best"][0]) == (4.0, 0.5)
    assert low_s < 4.0 < high_s


def test_missions_that_a_file_has_are_not_repeated(tmp_path, answered):
    out = tmp_path / "regret.jsonl"
    decisions = [{**DECISION, "regret_s": regret_s} for regret_s in (2, 6)]
    names = ["open:100", "flat:7"]
    out.write_text("".join(json.dumps({"run": name, **ASKED, "decisions": decisions}) + "\n" for name in names))
    before = out.read_bytes()
    asked_for = ["open:100", "open:100:adaptive", "open:0100", "flat:7:adaptive"]
    result = answered("what-if", *asked_for, "--out", out, *WHAT_IF)
    assert ([run["run"] for run in result["runs"]], result["regret_s"]) == (names, [4.0, 4.0, 4.0])
    assert out.read_bytes() == before


@pytest.mark.slow
def test_a_mission_of_which_something_else_was_asked_is_examined_again(tmp_path, printed):
    out, name = tmp_path / "regret.jsonl", "open:100"
    lines = [
        {"run": name, "decisions": [DECISION]},
        {"run": name, **ASKED, "decision": 1, "decisions": [DECISION]},
        {"run": name, **ASKED, "sample": 1, "decisions": [DECISION]},
        {"run": name, **ASKED, "futures": 3, "decisions": [DECISION]},
        {"run": name, **ASKED, "redraw_unseen": True, "decisions": [DECISION]},
    ]
    out.write_text("".join(json.dumps(line) + "\n" for line in lines))
    for _ in range(2):
        assert "the mission had no decision" in printed("what-if", name, "--out", out, *WHAT_IF)
        *before, added = map(json.loads, out.read_text().splitlines())
        assert before == lines
        assert added == {"run": name, **ASKED, "redraw_unseen": False, "decisions": []}


@pytest.mark.nightly
def test_a_sample_of_a_missions_decisions_is_added_to_a_file(tmp_path, capsys):
    out, name = tmp_path / "regret.jsonl", "wall_start:103:adaptive"
    for _ in range(2):
        assert main(["what-if", name, "--sample", "1", *WHAT_IF, "--out", str(out)]) == 0
        (line,) = out.read_text().splitlines()
        assert len(json.loads(line)["decisions"]) == 1
        assert "1 decision: mean regret" in capsys.readouterr().out


def test_the_command_ends_with_mean_regret_and_the_shares_of_good_choices_and_of_certainly_bad_ones(tmp_path, printed):
    """Of 6 s with an interval from 2 s on it is not certain that they are more than 3 s."""
    known = [(0.0, 0.0), (0.0, -1.0), (6.0, 2.0), (6.0, 4.0)]
    decisions = [{**DECISION, "regret_s": mean, "beyond_best_s": [6.0, low, 9.0]} for mean, low in known]
    said = printed(*_command_for(tmp_path, decisions))
    assert "4 decisions: mean regret 3.0 s; 50 % of them within 3 s of the best, 25 % certainly not\n" in said


def test_figures_are_also_given_for_the_decisions_after_each_failure(tmp_path, printed, answered):
    known = [("uncertain", 8.0), ("never_seen", 0.0), ("never_seen", 4.0), ("no_way", 0.0)]
    decisions = [{**DECISION, "reason": reason, "regret_s": seconds} for reason, seconds in known]
    decisions[-1]["candidates"] = [WAIT]
    command = _command_for(tmp_path, decisions)
    by_reason = answered(*command)["by_reason"]
    found = {reason: (each["decisions"], *each["regret_s"], *each["nearly_best"]) for reason, each in by_reason.items()}
    assert found == {"never_seen": (2, 2.0, 0.5), "uncertain": (1, 8.0, 0.0)}
    rows = [[cell.strip() for cell in line.split("│")] for line in printed(*command).splitlines()]
    assert [row[2:5] for row in rows if row[1:2] == ["uncertain"]] == [["1", "8.0 s", "0 %"]]


@pytest.mark.parametrize("made", [0, 3])
def test_what_had_no_other_candidate_is_no_decision_of_the_figures(tmp_path, printed, answered, made):
    alone = {**DECISION, "candidates": [WAIT], "regret_s": 0.0, "biased_regret_s": 0.0}
    decisions = [*[{**DECISION, "regret_s": seconds} for seconds in (0.0, 0.0, 6.0)[:made]], alone, alone]
    command = _command_for(tmp_path, decisions)
    told = answered(*command)
    assert (told.get("regret_s"), told.get("nearly_best")) == (([2.0], [0.667]) if made else (None, None))
    assert told["without_alternative"] == 2
    said = printed(*command)
    assert ("3 decisions: mean regret 2.0 s; 67 % of them within 3 s of the best, 0 % certainly not\n" in said) == bool(
        made
    )
    assert said.endswith("2 choices had no alternative and are not counted\n")
    assert said.count("there was no alternative\n") == 2
    assert said.count("> best") == made
    assert DecisionCosts.model_validate(alone).words() == (
        "the choice costs 1.0 s to a target on average; there was no alternative"
    )


def test_a_line_that_was_cut_short_is_written_again(tmp_path):
    out, mission = tmp_path / "regret.jsonl", {"run": "open:100", "decisions": [DECISION]}
    with ResultFile(out) as file:
        file.append(json.dumps(mission))
    whole = out.read_bytes()
    out.write_bytes(whole + whole.replace(b"100", b"101")[:40])
    assert [each.plain() for each in read_missions(out).values()] == [mission]
    with ResultFile(out) as file:
        file.append(json.dumps({"run": "open:101", "decisions": []}))
    assert [each.run for each in read_missions(out).values()] == ["open:100", "open:101"]


@pytest.mark.parametrize(
    "text",
    [
        "no JSON\n",
        "no line end",
        "{}\n",
        '{"run": "open:100", "decisions": 5}\nx\n',
        '{"run": "open:100", "decisions": [{}]}\n',
        '{"run": "open:100", "decisions": [3]}\n',
        json.dumps({"run": "open:100", "decisions": [{**DECISION, "candidates": [{}]}]}) + "\n",
        json.dumps({"run": "open:100", "decisions": [{**DECISION, "regret_s": 1e999}]}) + "\n",
    ],
)
def test_a_file_of_something_else_is_refused(tmp_path, text, refused):
    out = tmp_path / "other.jsonl"
    out.write_text(text)
    assert "is not from nxtdrive what-if" in refused("what-if", "open:100", "--out", out, "--workers", "1")
    assert out.read_text() == text


def test_a_file_that_cannot_be_written_is_refused_before_the_mission_runs(tmp_path, refused):
    said = refused("what-if", "open:100", "--out", tmp_path / "none" / "regret.jsonl", "--workers", "1")
    assert "cannot be written" in said
    assert "repeating the mission" not in said


def test_a_seed_that_no_scenario_can_have_is_refused(refused):
    assert "CLASS:SEED" in refused("what-if", "open:" + "9" * 5000)


def test_a_profile_that_cannot_be_loaded_is_refused_before_any_mission_runs(capsys):
    assert main(["what-if", "open:100", "open:101:no_such_profile"]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert "profile 'no_such_profile' cannot be loaded" in said.err


def test_more_futures_than_can_be_played_are_refused(capsys):
    with pytest.raises(SystemExit):
        main(["what-if", "clutter:100", "--futures", "1000000000000"])
    assert "futures must be a whole number from 2 to 1000" in capsys.readouterr().err


def test_one_decision_of_several_runs_is_refused(refused):
    assert "--decision is for one run" in refused("what-if", "open:100", "open:101", "--decision", "1")


def test_a_cost_counts_what_is_open_and_a_target_that_is_never_reached_by_the_time_that_is_left():
    outcome = EpisodeOutcome(100.0, ("a", "b", "c"), [DecisionPoint("a", "", (), 40.0)], reached={"a": 50.0, "b": 30.0})
    assert outcome.cost_s(0) == pytest.approx((10.0 + 60.0) / 2)
    assert EpisodeOutcome(100.0, ("b",), [DecisionPoint("b", "", (), 40.0)], reached={"b": 30.0}).cost_s(0) == 0.0


def test_chance_that_is_seeded_anew_differs_from_then_on():
    def later(seed):
        simulation = Simulation("open", seed=1)
        simulation.advance(100)
        if seed:
            simulation.reseed(seed)
        return [random.random() for random in (*simulation.world.generators, simulation.webcam.generator)]

    assert later("a") == later("a")
    assert all(one != other for one, other in zip(later("a"), later("b"), strict=True))
    assert all(one != other for one, other in zip(later("a"), later(""), strict=True))


@pytest.mark.nightly
def test_the_profiles_own_candidate_gives_the_mission_as_it_was_and_another_one_another():
    base = run_with_branch(SOURCE)
    assert run_with_branch(SOURCE, 0) == base
    assert len(base.decisions[0].candidates) > 1
    other = run_with_branch(SOURCE, 0, lambda: Branch(1))
    assert replace(other.decisions[0], chose="") == replace(base.decisions[0], chose="")
    assert other.reached != base.reached
    assert run_with_branch(SOURCE, 0, lambda: Branch(1, 1)) != run_with_branch(SOURCE, 0, lambda: Branch(1, 2))


def test_ctrl_c_ends_it_and_is_not_taken_for_another_end_of_the_mission():
    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_with_branch(SOURCE, 0, interrupt)


@pytest.mark.skipif(not CAN_FORK, reason="this system has no copies")
def test_a_copy_that_breaks_is_an_error_of_the_original(capfd):
    def half_in_the_first(forks):
        with forks:
            forks.send_result([0.5][forks.each(2)])

    forks = Forks()
    with pytest.raises(RuntimeError, match="without a result"):
        half_in_the_first(forks)
    assert forks.results == [0.5]
    assert "IndexError: list index" in capfd.readouterr().err


@pytest.mark.skipif(not CAN_FORK, reason="this system has no copies")
def test_a_copy_that_ctrl_c_ends_prints_no_traceback(capfd):
    def interrupted(forks):
        with forks:
            forks.each(1)
            raise KeyboardInterrupt

    with pytest.raises(RuntimeError, match="without a result"):
        interrupted(Forks())
    assert not capfd.readouterr().err


@pytest.mark.skipif(not CAN_FORK, reason="this system has no copies")
def test_a_copy_ends_with_the_original():
    script = (
        "import signal; from nxtdrive.tools.sweep.forks import Forks\n"
        "with Forks() as forks: forks.each(1); print('copied', flush=True); signal.pause()"
    )
    original = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE)
    assert original.stdout
    assert original.stdout.readline() == b"copied\n"
    original.kill()
    assert original.communicate(timeout=60) == (b"", None)  # nobody has the pipe any more


@pytest.mark.nightly
@pytest.mark.skipif(not CAN_FORK, reason="this system repeats the mission for each branch")
def test_copies_of_the_process_continue_as_a_repeated_mission_does(monkeypatch):
    copied = branch_costs(SOURCE, 0, range(2), Futures(1))
    monkeypatch.setattr("nxtdrive.tools.sweep.what_if.CAN_FORK", False)
    assert branch_costs(SOURCE, 0, range(2), Futures(1)) == copied
    assert copied[0] != copied[1]


@pytest.mark.slow
def test_a_run_is_repeated_and_its_explanation_shows_the_regret(tmp_path, capsys, printed, answered):
    where = ("--nxt", "sim://figure7?seed=3", "--camera", "geometric")
    folder = _recorded_run(tmp_path, "rilakkuma", 'time_limit_s = 20\nprofile = "thesis"', *where)
    capsys.readouterr()
    (result,) = answered("what-if", folder, "--decision", "1", *WHAT_IF)["runs"]
    told = result["decisions"]
    assert told == json.loads((folder / "what-if.json").read_text())["decisions"]
    assert [(each["decision"], each["futures"], len(each["candidates"])) for each in told] == [(1, 2, 3)]
    assert [each["chosen"] for each in told[0]["candidates"]] == [True, False, False]
    assert "regret" in printed("explain-run", folder)
    journal = folder / "journal.jsonl"
    journal.write_text(journal.read_text().replace('"choice": "', '"choice": "un', 1))
    assert main(["what-if", str(folder), "--workers", "1"]) != 0
    assert re.search(
        r"decision 1 is un\w+ at [\d.]+ s, and the same mission now leads to \w+ at", capsys.readouterr().err
    )
    (folder / "what-if.json").unlink()
    (folder / "what-if.json").mkdir()  # cannot be written, which is said before the mission is repeated
    assert main(["what-if", str(folder), "--workers", "1"]) == 2
    assert re.fullmatch(r"nxtdrive: \S+what-if\.json cannot be written .*\n", capsys.readouterr().err)


OTHERS = {
    "no number": {**DECISION, "decision": [1]},
    "no regret": {**DECISION, "regret_s": None},
    "no candidates": {**DECISION, "candidates": 5},
    "nothing chosen": {**DECISION, "candidates": [WAIT | {"chosen": False}]},
    "two are best": {**DECISION, "candidates": [WAIT, WAIT | {"chosen": False}]},
    "no cost": {**DECISION, "candidates": [WAIT | {"cost_s": []}]},
    "no words": {**DECISION, "candidates": [{"chosen": True, "best": True, "cost_s": [1.0, 0.5, 1.5]}]},
    "no object": "1",
}


def test_commands_that_examine_one_run_at_the_same_time_lose_no_decision(tmp_path):
    def examine(numbers):
        for number in numbers:
            keep(tmp_path, "run", DecisionCosts.model_validate({**DECISION, "decision": number}))

    with ThreadPoolExecutor() as both:
        list(both.map(examine, (range(1, 21), range(21, 41))))
    assert [*decision_costs(tmp_path)] == [*range(1, 41)]


def test_of_a_file_that_another_program_wrote_only_whole_decisions_are_read(tmp_path):
    costs = DecisionCosts.model_validate(DECISION)
    for decisions in ([*OTHERS.values(), DECISION], OTHERS, 5, None):
        (tmp_path / "what-if.json").write_text(json.dumps({"decisions": decisions}))
        assert decision_costs(tmp_path) == ({1: costs} if isinstance(decisions, list) else {})
    assert "regret 2.0 s" in costs.words()


CAMERAS = {"unmeasured": {}, "measured": {"height_mm": 200.0, "forward_mm": 60.0}}


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("calibration", [{}, {"camera": {"date": date(2026, 1, 2), "method": "sheet"}}])
def test_a_recorded_mission_reads_as_the_mission_that_ran(tmp_path, camera, calibration):
    described = RobotFile.model_validate({"camera": CAMERAS[camera], "calibration": calibration})
    mission = described_by(with_profile(read_mission_file(None), "adaptive"), described)
    folder = new_run_folder(tmp_path, "x")
    folder.write_mission(mission)
    folder(Record(0.0, RecordKind.START, "idle", "lena", {"format": 3}))
    folder.close()
    read = read_run(folder.path).mission
    assert read == mission
    assert read.sonar_ahead_mm == mission.sonar_ahead_mm
    said = CAMERAS[camera].keys()
    assert read.camera.model_fields_set & {"height_mm", "forward_mm"} == said, "a default is not a measured value"


@pytest.mark.nightly
def test_a_run_that_looked_with_the_camera_is_repeated(tmp_path):
    recorded = read_recorded(_recorded_run(tmp_path, "lena", "time_limit_s = 40"))
    assert recorded.choices
    assert tuple((each.time_s, each.chose) for each in run_with_branch(recorded).decisions) == recorded.choices


def test_the_room_of_a_run_that_was_made_in_another_folder_is_missed(tmp_path, refused):
    start = {
        "t": 0.0,
        "kind": "start",
        "state": "idle",
        "target": "box",
        "format": 3,
        "mission": "",
        "targets": ["box"],
    }
    mission = {"mission": {"targets": ["box"]}, "target": {"box": {"detector": "color", "color": "red"}}}
    summary = {"nxt": "sim://cellar.toml?seed=1", "camera": "sim"}
    for name, content in (("journal.jsonl", start), ("mission.json", mission), ("summary.json", summary)):
        (tmp_path / name).write_text(json.dumps(content) + "\n", encoding="utf-8")
    assert "in the folder in which the run was made" in refused("what-if", tmp_path)


@pytest.mark.parametrize("name", ["nowhere:1", "open:x", "runs/none"])
def test_anything_that_is_not_a_run_is_refused(name, refused):
    assert "neither a run folder" in refused("what-if", name)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("flatt:100", "Did you mean 'flat'?"),
        ("nowhere:1", "Write clutter:100, for example."),
        ("open:100:oracle", "oracle is an agent of sweeps, not a profile. Write open:100 or open:100:thesis."),
        ("open:100:adaptive-no-detour", "adaptive-no-detour is an agent of sweeps, not a profile."),
    ],
)
def test_a_mistyped_class_and_an_agent_that_is_no_profile_are_named(name, text, refused):
    assert text in refused("what-if", name)


class _InterruptedAt(io.StringIO):
    """A standard error at which Ctrl-C is pressed as soon as it has these words."""

    def __init__(self, words):
        super().__init__()
        self._words = words

    def write(self, text):
        super().write(text)
        if self._words in self.getvalue():
            raise KeyboardInterrupt
        return len(text)


@pytest.mark.nightly
def test_decisions_that_are_done_are_shown_and_kept_when_ctrl_c_ends_the_command(tmp_path, capsys, monkeypatch):
    where = ("--nxt", "sim://", "--camera", "geometric")
    folder = _recorded_run(tmp_path, "sunset", 'time_limit_s = 60\nprofile = "thesis"', *where)
    capsys.readouterr()
    monkeypatch.setattr("sys.stderr", _InterruptedAt("decision 2 is done"))
    assert main(["what-if", str(folder), *WHAT_IF]) == 130
    assert "12 missions to run" in sys.stderr.getvalue()
    assert "regret" in capsys.readouterr().out
    (kept,) = json.loads((folder / "what-if.json").read_text())["decisions"]
    assert kept["decision"] == 1
