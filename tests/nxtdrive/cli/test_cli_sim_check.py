"""``nxtdrive sim check``: recordings of many kinds, and files that are not recordings."""

import json
from pathlib import Path

import pytest

from nxtdrive.cli.commands.sim_check import FIRMWARES
from nxtdrive.cli.main import DONE, NOT_ACHIEVED, USAGE, main
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


def test_the_firmwares_are_those_of_the_simulated_brick():
    assert FIRMWARES == brick.FIRMWARES


@pytest.mark.parametrize("firmware", ["1.29", "1.05"])
def test_one_scenario_of_the_golden_recording(firmware, printed):
    lines = printed("sim", "check", GOLDEN, "--scenario", "program_lifecycle", "--firmware", firmware).splitlines()
    assert lines[0].split() == ["program_lifecycle", "48/48", "same"]
    assert lines[-1] == f"firmware {firmware}: 1 of 1 scenarios and 48 of 48 steps are the same"


def test_plain_exchanges_with_blank_lines_are_enough(recording, printed):
    assert "talk" in printed("sim", "check", recording(BATTERY, "", BATTERY, "   "))


def test_every_scenario_begins_at_power_on(recording):
    tick = {"control": "!tick 3", "reply": "ok t=6003"}
    assert check(recording({"scenario": "a", **tick}, {"scenario": "b", **tick})) == DONE


def test_a_difference_is_reported_in_words_and_the_rest_is_still_compared(recording, capsys):
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
    assert (scenario["scenario"], scenario["firmware"]) == ("talk", "1.29")
    assert (scenario["steps"], scenario["matched"]) == (2, 1)
    [difference] = scenario["differences"]
    assert difference["step"] == 1
    assert "status is 0xc0" in difference["text"]
    [category] = told["categories"]
    assert category == {"category": "talk", "same": 0, "scenarios": 1, "matched": 1, "steps": 2}
    [cause] = told["causes"]
    assert cause["cause"] == difference["cause"] == "StartProgram: status C0 out of range, not 00 ok"
    assert (cause["count"], cause["scenarios"]) == (1, ["talk"])
    assert "talk step 1" in cause["example"]


def battery(scenario, reply=BATTERY["reply"]):
    return {"scenario": scenario, **BATTERY, "reply": reply}


def test_results_are_counted_by_category(recording, capsys):
    names = ("g_motor_00", "g_motor_01", "g_fs_00", "i2c/states", "i2c/errors", "message_one", "message_two", "alone")
    assert check(recording(*(battery(name, "00" if name == "g_fs_00" else "020b004a1e") for name in names))) == 1
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    table = lines[lines.index(["category", "scenarios", "steps"]) + 1 : -2]
    assert table == [
        ["motor", "2/2", "2/2"],
        ["fs", "0/1", "0/1"],
        ["i2c", "2/2", "2/2"],
        ["message", "2/2", "2/2"],
        ["other", "1/1", "1/1"],
    ]


def test_of_many_scenarios_only_those_that_differ_are_listed(recording, capsys):
    many = [battery(f"g_motor_{number:02}") for number in range(60)]
    assert check(recording(*many, battery("g_fs_00", "020b004b1e"))) == NOT_ACHIEVED
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("g_fs_00")
    assert lines[1] == ""


def test_scenarios_are_chosen_by_a_pattern(recording, printed):
    path = recording(*map(battery, ("g_motor_00", "g_motor_01", "g_fs_00", "x[1]")))
    assert "3 of 3 scenarios" in printed("sim", "check", path, "--scenario", "g_motor_*", "--scenario", "x[1]")


def test_causes_count_all_differences_of_all_scenarios_and_show_one(recording, capsys):
    wrong = [battery("a", "020b004b1e"), battery("a", "020b00ff1e"), battery("b", "020b004b1f")]
    assert check(recording(*wrong, {"scenario": "b", "request": "0000", "reply": "020000"}), "--causes") == NOT_ACHIEVED
    first, example, second, *_ = capsys.readouterr().out.splitlines()[1:]
    assert first.split(maxsplit=2) == ["3", "2", "GetBatteryLevel: voltage_mv"]
    assert "a step 0: 000b: voltage_mv, byte 0 is 0x4a" in example
    assert second.split(maxsplit=2) == ["1", "1", "StartProgram: status C0 out of range, not 00 ok"]


@pytest.mark.parametrize("error", [KeyError, IndexError, ValueError])
@pytest.mark.parametrize(("line", "name"), [("000b", "GetBatteryLevel"), ("!tick 5", "!tick"), ("!bt 0200000b", "!bt")])
def test_an_exception_of_the_simulated_brick_is_a_difference_that_names_the_step(
    error, line, name, recording, capsys, monkeypatch
):
    def fail(_brick, *_):
        raise error("broken")

    for method in ("receive", "receive_bluetooth", "tick"):
        monkeypatch.setattr(brick.SimBrick, method, fail)
    exchange = {"control" if line.startswith("!") else "request": line, "reply": "00"}
    assert check(recording(exchange, {"control": "!btname", "reply": "4e5854" + "00" * 13}), "--causes") == NOT_ACHIEVED
    out = capsys.readouterr().out
    assert f"{name}: the simulated brick raised {error.__name__}" in out
    assert f"talk step 0: {line}: the simulated brick raised {error.__name__}: " in out
    assert "1 of 2 steps are the same" in out


VERSION = {"request": "0188", "reply": "0288007c010501"}


def test_a_recording_says_which_firmware_it_was_made_with(recording, capsys, printed):
    header = {"firmware": "1.05", "about": "my brick"}
    assert "firmware 1.05: 1 of 1" in printed("sim", "check", recording(header, VERSION))
    assert check(recording({**VERSION, "firmware": "1.05", "scenario": "old"}, battery("new"))) == DONE
    assert "firmware 1.05, 1.29: 2 of 2" in capsys.readouterr().out
    assert check(recording(header, VERSION), "--firmware", "1.29") == NOT_ACHIEVED


def test_a_firmware_that_is_not_simulated_is_refused_unless_another_one_is_named(recording, refused):
    path = recording({"firmware": "1.31"}, BATTERY)
    told = refused("sim", "check", path)
    assert "'1.31'" in told
    assert f"--firmware {' or '.join(FIRMWARES)}" in told
    assert check(path, "--firmware", "1.29") == DONE


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
        ({"firmware": "1.29"},),
        ({"firmware": 1.29}, BATTERY),
    ],
)
def test_a_file_that_is_not_a_recording_is_refused(lines, recording, refused):
    assert "talk.jsonl" in refused("sim", "check", recording(*lines))


def test_a_file_that_is_not_there_and_a_scenario_that_is_not_there(tmp_path, recording, refused):
    assert check(str(tmp_path / "none.jsonl")) == USAGE
    assert "'other'" in refused("sim", "check", recording(BATTERY), "--scenario", "other")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe")
    assert check(str(tmp_path / "bytes")) == USAGE
