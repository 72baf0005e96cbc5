"""The file of a sweep: only its own lines count as results, and foreign content is not changed."""

import json
import sys

import pytest

from behaviors.executive import Ending
from firmware_protocol.errors import ConfigError
from nxtdrive.tools.sweep.mission_result import MissionResult
from nxtdrive.tools.sweep.result_file import ResultFile, read_results

TARGET = {
    **{"target": "lena", "reachable": True, "success": True, "wrong_stops": 0, "time_s": 5.0, "given_up_s": None},
    **{"pursuit_s": 5, "path_mm": 900.5, "shortest_mm": None, "spl": 1.0, "soft_spl": 1.0, "sct": 0.5},
}
CHOICE = {"cause": "missed", "choice": "rescan", "regret_s": None, "fits": True}
LINE = {
    **{"episode_index": 0, "class": "open", "seed": 100, "policy": "oracle", "vision": "geometric", "success": True},
    **{"sum_reward": 1.0, "max_reward": 1.0, "done": True, "ending": "achieved", "error": "", "duration_s": 9.5},
    **{"contacts": 0, "targets": [TARGET], "recognition_s": [0.5], "longest_run": 1},
    "choices": [CHOICE],
}
BROKEN = {
    **{name: LINE[name] for name in list(LINE)[:8]},
    "done": False,
    "ending": Ending.BROKEN,
    "error": "RuntimeError",
    "targets": [],
}

RESULT = MissionResult.model_validate_json(json.dumps(LINE))
RESUME = ("sweep", "--classes", "open", "--seeds", "100", "--profiles", "oracle", "--resume", "--out")


def _changed(**values):
    return json.dumps({**LINE, **values})


def _without(name):
    return json.dumps({key: value for key, value in LINE.items() if key != name})


BAD_LINES = {
    **{f"no {name}": _without(name) for name in ("class", "seed", "policy", "vision", "success", "targets", "ending")},
    **{f"no {name}": _without(name) for name in ("sum_reward", "duration_s", "contacts", "error")},
    "seed is a text": _changed(seed="100"),
    "class is a list": _changed(**{"class": ["open"]}),
    "targets are texts": _changed(targets=["lena"]),
    "target without success": _changed(targets=[{"reachable": True}]),
    "target reached at no time": _changed(targets=[{**TARGET, "time_s": None}]),
    "target not reached at a time": _changed(targets=[{**TARGET, "success": False}]),
    "unknown ending": _changed(ending="well"),
    "choice is a number": _changed(choices=[3]),
    "choice of no cause": _changed(choices=[{**CHOICE, "cause": "x"}]),
    "chance below 0": _changed(chances=[{"choice": "wait", "reason": "blocked", "chance": -0.1, "came_true": True}]),
    "not finite": _changed(duration_s=float("inf")),
    "deep": '{"episode_index": ' + "[" * 5000 + "]" * 5000 + "}",
    "a list": "[]",
    "empty": "",
    "another program's": '{"kind": "start"}',
}


def test_the_key_of_vision_in_files_of_earlier_versions_is_read(tmp_path):
    path = tmp_path / "x.jsonl"
    path.write_text(json.dumps({"eyes" if key == "vision" else key: value for key, value in LINE.items()}) + "\n")
    assert [result.vision for result in read_results(path)] == ["geometric"]


@pytest.mark.parametrize("text", BAD_LINES.values(), ids=BAD_LINES.keys())
def test_a_line_with_missing_or_mistyped_values_is_refused(tmp_path, refused, text):
    path = tmp_path / "x.jsonl"
    path.write_text(json.dumps(LINE) + "\n" + text + "\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"not the file of a sweep \(line 2"):
        read_results(path)
    assert "line 2" in refused(*RESUME, path)


def test_good_lines_are_written_as_they_were_read(tmp_path):
    path = tmp_path / "x.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in (LINE, BROKEN)), encoding="utf-8")
    assert [json.loads(result.to_json()) for result in read_results(path)] == [LINE, BROKEN]


@pytest.mark.parametrize("foreign", ["my only notes", '{"kind": "start"}', "\0", '{"episode'[:3] + "notes"])
@pytest.mark.parametrize("lines", ["", json.dumps(LINE) + "\n"], ids=["alone", "after results"])
def test_a_foreign_file_without_a_line_end_is_refused_and_kept(tmp_path, refused, lines, foreign):
    path = tmp_path / "notes.txt"
    path.write_text(lines + foreign, encoding="utf-8")
    assert "not the file of a sweep" in refused(*RESUME, path)
    assert path.read_text(encoding="utf-8") == lines + foreign


@pytest.mark.parametrize("length", [0, 1, 5, 17, 30, 200])
def test_a_line_that_was_cut_short_is_left_out_and_overwritten(tmp_path, length):
    path, whole = tmp_path / "x.jsonl", json.dumps(LINE) + "\n"
    path.write_text(whole + whole[:length], encoding="utf-8")
    assert read_results(path) == [RESULT]
    with ResultFile(path) as file:
        file.append(json.dumps(BROKEN))
    assert read_results(path) == [RESULT, MissionResult.model_validate_json(json.dumps(BROKEN))]


@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of the operating system")
def test_results_that_cannot_be_written_say_how_to_continue(tmp_path):
    import resource

    path, whole = tmp_path / "x.jsonl", json.dumps(LINE) + "\n"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    with ResultFile(path) as file:
        file.append(json.dumps(LINE))
        resource.setrlimit(resource.RLIMIT_FSIZE, (len(whole) + 100, limits[1]))
        try:
            with pytest.raises(ConfigError, match=r"cannot be written .*--resume"):
                file.append(json.dumps(LINE))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_text(encoding="utf-8") == whole + whole[:100], "a line cut short"
    assert read_results(path) == [RESULT]


@pytest.mark.skipif(sys.platform == "win32", reason="has no such locks")
def test_two_sweeps_do_not_write_one_file_at_once(tmp_path, refused):
    path = tmp_path / "r.jsonl"
    with ResultFile(path) as first:
        first.append(json.dumps(LINE))
        assert "another program is writing" in refused("sweep", "--classes", "open", "--out", path, "--resume")
    assert read_results(path) == [RESULT]
    with ResultFile(path) as second:
        second.append(json.dumps(LINE))
