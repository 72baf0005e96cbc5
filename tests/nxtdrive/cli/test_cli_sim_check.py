"""``nxtdrive sim check``: recordings of many kinds, and files that are none."""

import json
from pathlib import Path

import pytest

from nxtdrive.cli.main import DONE, NOT_ACHIEVED, USAGE, main
from nxtdrive.cli.sim_check import FIRMWARES
from sim_backend.firmware import brick

GOLDEN = Path(__file__).parents[2] / "golden" / "firmware.jsonl"
BATTERY = {"request": "000b", "reply": "020b004a1e"}


@pytest.fixture
def recording(tmp_path):
    def write(*lines):
        path = tmp_path / "talk.jsonl"
        path.write_text("\n".join(line if isinstance(line, str) else json.dumps(line) for line in lines))
        return str(path)

    return write


def check(*arguments):
    return main(["sim", "check", *arguments])


def test_it_knows_the_firmwares_of_the_simulated_brick():
    assert FIRMWARES == brick.FIRMWARES


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_one_scenario_of_the_golden_recording(firmware, capsys):
    assert check(str(GOLDEN), "--scenario", "program_lifecycle", "--firmware", firmware) == DONE
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["program_lifecycle", "48/48", "same"]
    assert lines[-1] == f"firmware {firmware}: 1 of 1 scenarios and 48 of 48 steps are the same"


def test_plain_exchanges_with_blank_lines_are_enough(recording, capsys):
    assert check(recording(BATTERY, "", BATTERY, "   ")) == DONE
    assert "talk" in capsys.readouterr().out


def test_every_scenario_begins_at_power_on(recording):
    tick = {"control": "!tick 3", "reply": "ok t=6003"}
    assert check(recording({"scenario": "a", **tick}, {"scenario": "b", **tick})) == DONE


def test_a_difference_is_told_in_words_and_the_rest_is_still_compared(recording, capsys):
    wrong = {"request": "000b", "reply": "020b004b1e"}
    assert check(recording(BATTERY, wrong, BATTERY)) == NOT_ACHIEVED
    out = capsys.readouterr().out
    assert "2/3" in out
    assert "step 1: 000b: voltage_mv, byte 0 is 0x4a, the firmware's is 0x4b" in out


def test_other_fields_matter_only_for_the_other_firmware(recording):
    path = recording({"request": "001b", "reply": "021b001e", "reply_lego105": "021bbe"})
    assert check(path) == DONE
    assert check(path, "--firmware", "1.05") == DONE
    assert check(recording({"request": "001b", "reply": "021bbe"}), "--firmware", "1.05") == DONE


@pytest.mark.parametrize(
    "line", ["!levitate 3", "!tick", "!tick soon", "!sensor 9 1", "!fill", "!fill zz 3", "!also 0"]
)
def test_a_control_line_that_cannot_be_carried_out_is_a_difference(line, recording, capsys):
    assert check(recording({"control": line, "reply": "ok"}, BATTERY)) == NOT_ACHIEVED
    out = capsys.readouterr().out
    assert f"the control line {line!r}" in out
    assert "1/2" in out


def test_json_holds_the_same(recording, capsys):
    assert check(recording(BATTERY, {"request": "0000", "reply": "020000"}), "--json") == NOT_ACHIEVED
    told = json.loads(capsys.readouterr().out)
    assert (told["firmware"], told["same"], told["of"]) == ("1.29", 0, 1)
    [scenario] = told["scenarios"]
    assert (scenario["scenario"], scenario["steps"], scenario["matched"], scenario["step"]) == ("talk", 2, 1, 1)
    assert "status is 0xc0" in scenario["difference"]


@pytest.mark.parametrize(
    "lines",
    [
        (),
        ("",),
        ("no json",),
        ("[1, 2]",),
        ({"request": "000b"},),
        ({"reply": "00"},),
        ({"request": "0", "reply": ""},),
        ({"request": "000b", "reply": "xyz"},),
        ({"request": "000b", "reply": 5},),
        ({"request": "000b", "control": "!tick 1", "reply": ""},),
        ({"control": "!bt", "reply": "ok", "mask": "ff"},),
    ],
)
def test_a_file_that_is_no_recording_is_refused(lines, recording, capsys):
    assert check(recording(*lines)) == USAGE
    assert "talk.jsonl" in capsys.readouterr().err


def test_a_file_that_is_not_there_and_a_scenario_that_is_not_there(tmp_path, recording, capsys):
    assert check(str(tmp_path / "none.jsonl")) == USAGE
    assert check(recording(BATTERY), "--scenario", "other") == USAGE
    assert "'other'" in capsys.readouterr().err
    (tmp_path / "bytes").write_bytes(b"\xff\xfe")
    assert check(str(tmp_path / "bytes")) == USAGE
