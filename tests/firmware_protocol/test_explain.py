import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.explain import explain
from firmware_protocol.framing import frame

GOLDEN = Path(__file__).parents[1] / "golden" / "firmware.jsonl"


def lines(text):
    return [" ".join(line.split()) for line in str(explain(bytes.fromhex(text))).splitlines()]


@given(st.binary(max_size=80) | st.binary(max_size=40).map(lambda rest: b"\x02" + rest))
def test_any_bytes_can_be_explained(telegram):
    explanation = explain(telegram)

    assert str(explanation)
    assert explanation.telegram in telegram


def test_every_recorded_telegram_is_fully_explained():
    for record in map(json.loads, GOLDEN.read_text().splitlines()):
        for text in (record.get("request", ""), record["reply"] if "request" in record else ""):
            telegram = bytes.fromhex(text)
            explanation = explain(telegram)
            header = 3 if explanation.kind == "reply" else 2
            body = b"".join(each.raw for each in explanation.fields) + explanation.leftover
            assert body == (telegram if explanation.kind == "unknown" else telegram[header:])
            assert str(explanation)


def test_a_request_has_names_and_units():
    assert lines("0004 01 b5 07 01 00 20 68010000") == [
        "SetOutputState (direct command 0x04, to the brick)",
        "port B (0x01)",
        "power -75 %",
        "mode MOTOR_ON|BRAKE|REGULATED (0x07)",
        "regulation SPEED (0x01)",
        "turn_ratio 0 %",
        "run_state RUNNING (0x20)",
        "tacho_limit 360 deg",
    ]


def test_a_reply_has_a_status_in_words():
    assert lines("020b004a1e") == [
        "reply to GetBatteryLevel 0x0B, from the brick",
        "status ok (0x00)",
        "voltage_mv 7754 mV",
    ]
    assert "The brick refused. Start a program on the brick first." in str(explain(bytes.fromhex("0201ec")))


def test_a_telegram_without_fields_is_not_cut():
    assert lines("000b") == ["GetBatteryLevel (direct command 0x0B, to the brick)"]
    assert lines("020100") == ["reply to StopProgram 0x01, from the brick", "status ok (0x00)"]


def test_bluetooths_length_is_seen_through():
    bare, framed = explain(bytes.fromhex("020b004a1e")), explain(frame(bytes.fromhex("020b004a1e")))

    assert framed.framed
    assert not bare.framed
    assert framed.fields == bare.fields
    assert "with Bluetooth's length in front" in framed.title


def test_a_length_that_is_also_a_reply_is_read_as_a_length_only_if_it_is_exact():
    assert explain(bytes.fromhex("0200 000b")).name == "GetBatteryLevel"
    assert explain(bytes.fromhex("0200 00")).name == "StartProgram"
    assert explain(bytes.fromhex("0200 007c")).name == "StartProgram"
    assert explain(bytes.fromhex("0400 007c0102")).framed, "4 begins no telegram"


@pytest.mark.parametrize(
    ("telegram", "expected"),
    [
        ("", "It is too short."),
        ("030b", "The brick ignores such a first byte."),
        ("0055", "No command with this opcode is known."),
        ("800d", "requests no reply"),
        ("0021 00", "Firmware before 1.28 does not know this command."),
        ("0006", "port  missing"),
        ("0003 b8", "cut off after b8"),
        ("0006 00 0102", "left over  01 02"),
        ("0209", "The telegram is cut"),
        ("0003 b80b 01", "The telegram is cut"),
        ("0194 01000c00 1a00 0100", "0x000C0001 (Ui.mod)"),
        ("0194 01000c00 1a00 0100", "Ui.mod: Flags."),
        ("0194 01000200 3900 0100", "Output.mod: RunState[1]."),
        ("0194 01007700 3900 0100", "0x00770001\n"),
        ("0002 05 00", "loop  5"),
        ("0002 01 00", "loop  yes"),
        ("0005 00 63 00", "unknown (0x63)"),
        ("0184 03", "handle  3"),
        ("0185 61" + "00" * 19, "name  'a'"),
        ("0183 03 6162", "data    61 62"),
        ("020e c0", "out of range (0xC0)"),
    ],
)
def test_what_is_reported(telegram, expected):
    assert expected in str(explain(bytes.fromhex(telegram)))
