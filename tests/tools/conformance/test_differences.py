"""Causes of differences: the same for all of one kind, different for different kinds."""

import pytest

from nxtdrive.tools.conformance.differences import compare
from nxtdrive.tools.conformance.recording import Step

VERSIONS = "07000288007c011d01"
SCREEN = "019401000a0077000200"
POINTERS = "019401000a0064000200"
BEHIND_POINTERS = "019401000a006c000100"
UI_FLAGS, UI_END = "019401000c001a000100", "019401000c002c000100"


def cause(sent, ours, theirs):
    line, telegram = (sent, "") if sent.startswith("!") else ("", sent)
    difference = compare(Step(3, telegram, line, theirs, theirs, ""), ours)
    assert difference.step == 3
    assert sent in difference.text
    return difference.cause


@pytest.mark.parametrize(
    ("request_", "ours", "theirs", "expected"),
    [
        ("000b", "020b004a1e", "020b004b1e", "GetBatteryLevel: voltage_mv"),
        ("800b", "020b004a1e", "020b004aff", "GetBatteryLevel: voltage_mv"),
        ("000b", "020b004a1e", "020b00", "GetBatteryLevel: reply of 5 bytes, not 3"),
        ("000b", "020b004a1e", "", "GetBatteryLevel: reply of 5 bytes, not 0"),
        ("000b", "", "020b004a1e", "GetBatteryLevel: reply of 0 bytes, not 5"),
        ("000b", "020b004a1e", "020bdd4a1e", "GetBatteryLevel: status 00 ok, not DD bus error"),
        ("000b", "020b004a1e", "020bdd", "GetBatteryLevel: status 00 ok, not DD bus error"),
        ("000b", "020c004a1e", "020b004a1e", "GetBatteryLevel: opcode"),
        ("0011", "0211ec41", "0211ec42", "GetCurrentProgramName: name at status EC no active program"),
        (UI_FLAGS, "02940001000c00010040", "02940001000c00010041", "IOMapRead: Ui.Flags"),
        (UI_END, "02940001000c00010040", "02940001000c00010041", "IOMapRead: Ui offset 44"),
        (SCREEN, "02940001000a0002000000", "02940001000a0002002214", "LEGO's icons are not drawn"),
        (SCREEN, "02940001000a0002000001", "02940001000a0002002214", "IOMapRead: Display.Normal"),
        (POINTERS, "02940001000a0002000000", "02940001000a000200e0c7", "addresses in the firmware's memory"),
        (BEHIND_POINTERS, "02940001000a0001000000", "02940001000a0001000001", "IOMapRead: Display.StatusIcons"),
        ("019401770c001a000100", "02940001770c00010040", "02940001770c00010041", "IOMapRead: data"),
        ("0194", "02940001770c00010040", "02940001770c00010041", "IOMapRead: data"),
        ("0199", "0299", "029900", "telegram 01 99: reply of 2 bytes, not 3"),
        ("0199", "02990001", "02990002", "telegram 01 99: byte 3"),
        ("07", "", "02", "telegram 07: reply of 0 bytes, not 1"),
        ("0707", "", "02", "telegram 07 07: reply of 0 bytes, not 1"),
    ],
)
def test_a_telegrams_cause_names_the_command_and_the_first_field_that_differs(request_, ours, theirs, expected):
    assert cause(request_, ours, theirs) == expected


@pytest.mark.parametrize(
    ("line", "ours", "theirs", "expected"),
    [
        ("!motors", "0/0/0 0/0/5 0/0/0", "0/0/0 0/0/6 0/0/0", "!motors: count"),
        ("!motors", "0/0/0 0/0/5 0/0/0", "0/0/0 0/1/6 0/0/0", "!motors: brake"),
        ("!motors", "0/0/0 0/0/0 0/0/0", "idle", "!motors: #/#/# #/#/# #/#/#, not idle"),
        ("!trace 2 1", "1,0,0,0;2,0,0,0", "1,0,0,0;2,-7,0,0", "!trace: pwm"),
        ("!trace 2 1", "1,0,0,0;2,0,0,0", "1,0,0,0;3,-7,0,0", "!trace: time"),
        ("!trace 2 1", "1,0,0,0;2,0,0,0", "1,0,0,0", "!trace: number of entries"),
        ("!tick 1", "ok t=6001", "ok t=7", "!tick: other numbers"),
        (
            "!also 000b 0011",
            "020b00 0211ec",
            "020b00 021100",
            "!also GetCurrentProgramName: status EC no active program, not 00 ok",
        ),
        ("!also 000b 0011", "020b00", "020b00 021100", "!also: 1 replies, not 2"),
        ("!also 000b 0011", "020b00 ", "020b00 0211ec", "!also GetCurrentProgramName: reply of 0 bytes, not 3"),
        ("!i2c 1 log", "S [10]a P  clocks=9", "  clocks=0", "!i2c log: S [#]a P  clocks=#, not   clocks=#"),
        ("!i2c 1 log", "S [10]a P" * 9, "", "!i2c log: other events"),
        ("!bt 0200000b", "0500020b004a1e", "0500020b004b1e", "!bt GetBatteryLevel: voltage_mv"),
        ("!bt 0200000b", "0500020b004a1e", "0600020b004a1e", "!bt GetBatteryLevel: length"),
        ("!bt 00", VERSIONS + "0500020b004a1e", VERSIONS + "0500020b004a1f", "!bt GetBatteryLevel: voltage_mv"),
        (
            "!bt 00",
            VERSIONS + "0500020bdd4a1e",
            VERSIONS + "0300020b00",
            "!bt GetBatteryLevel: reply of 16 bytes, not 14",
        ),
        ("!bt 00", VERSIONS, VERSIONS + "0500020b004a1f", "!bt GetBatteryLevel: reply of 9 bytes, not 16"),
        ("!bt 00", VERSIONS + "0500020b004a1f", VERSIONS, "!bt GetVersions: reply of 16 bytes, not 9"),
        ("!bt 00", "0500020b004a1e", "", "!bt: reply of 7 bytes, not 0"),
        ("!bt 00", "0500", "ok", "!bt: #, not ok"),
        ("!also 000b", "020b", "ok", "!also: #, not ok"),
        ("!bt 00", "", "0100", "!bt: reply of 0 bytes, not 2"),
    ],
)
def test_a_control_lines_cause_names_the_line_and_what_differs(line, ours, theirs, expected):
    assert cause(line, ours, theirs) == expected


@pytest.mark.parametrize(("ours", "theirs"), [("020b004a1e", "020b004a1f"), ("020b004a1e00", "020b004a1f00")])
def test_masked_bytes_are_not_compared(ours, theirs):
    assert compare(Step(0, "000b", "", theirs, theirs, "ffffffff00"), ours) is None
