"""``info``, ``explain`` and ``send``: a brick's replies and the meaning of their bytes."""

import contextlib
import io
import json
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.catalog import ALL_COMMANDS
from firmware_protocol.errors import ConfigError
from nxtdrive.cli.commands.explain import parse_hex
from nxtdrive.cli.main import DONE, REFUSED, main


def test_info_of_the_simulated_brick(printed):
    rows = dict(line.split("  ", 1) for line in printed("info", "--nxt", "sim://").splitlines())
    assert {label.strip() for label in rows} >= {"name", "firmware", "battery", "free flash", "sleeps"}


def test_info_as_json(answered):
    info = answered("info", "--nxt", "sim://")
    assert info["firmware"] == "1.29"
    assert info["bluetooth_address"].startswith("00:16:53:")
    assert 5000 < info["battery_mv"] < 10000
    assert info["free_flash"] > 0
    assert info["sleep_s"] == 600
    assert info["address"].startswith("sim://")


@pytest.mark.parametrize(
    "words",
    [["02", "0b", "00", "40", "1f"], ["020B00401F"], ["0x02,0x0b,0x00,0x40,0x1f"], [r"\x02\x0b\x00\x40\x1f"]],
)
def test_bytes_may_be_written_in_many_ways(words, printed):
    text = printed("explain", *words)
    assert "GetBatteryLevel" in text
    assert "8000 mV" in text


def test_explain_reads_one_telegram_a_line(monkeypatch, printed):
    monkeypatch.setattr(sys, "stdin", io.StringIO("00 0b\n\n02 0b 00 40 1f\n"))
    question, answer = map(json.loads, printed("explain", "-", "--json").splitlines())
    assert (question["kind"], question["want_reply"]) == ("direct command", True)
    assert answer["status"] == {"code": 0, "label": "ok"}
    assert answer["fields"] == [{"name": "voltage_mv", "value": 8000, "unit": "mV", "text": "8000 mV", "raw": "401f"}]


@given(st.binary(max_size=80))
def test_any_bytes_are_explained_as_json(telegram):
    from firmware_protocol.explain import explain
    from nxtdrive.cli.views.telegram import as_json

    assert json.loads(json.dumps(as_json(explain(telegram))))["telegram"] in telegram.hex()


@given(st.text(max_size=40))
def test_any_text_is_bytes_or_a_mistake_of_the_user(text):
    with contextlib.suppress(ConfigError):
        assert len(parse_hex(text)) <= len(text) / 2


@given(st.binary(max_size=40), st.sampled_from([" ", ":", "-", ", ", ""]))
def test_written_bytes_are_read_back(data, separator):
    assert parse_hex(separator.join(f"{byte:02x}" for byte in data)) == data


@pytest.mark.parametrize("text", ["0", "zz", "00 0"])
def test_what_is_not_hex_is_a_usage_error(text, refused):
    assert "two hex digits" in refused("explain", text)


def test_send_prints_the_reply_by_field(printed):
    assert "voltage_mv" in printed("send", "getbatterylevel", "--nxt", "sim://")


def test_send_takes_fields_and_answers_in_json(answered):
    reply = answered("send", "GetOutputState", "port=B", "--nxt", "sim://")
    values = {field["name"]: field["value"] for field in reply["fields"]}
    assert values["port"] == 1
    assert values["power"] == 0


def test_send_without_reply_shows_what_was_sent(capsys):
    assert main(["send", "StopSoundPlayback", "--no-reply", "--nxt", "sim://", "--json"]) == DONE
    assert json.loads(capsys.readouterr().out) == {"sent": "800c"}


def test_send_lists_every_command(printed, answered):
    assert len(printed("send", "--list").splitlines()) == len(ALL_COMMANDS)
    declared = {each["name"]: each for each in answered("send", "--list")}
    assert declared["PlayTone"]["opcode"] == 3
    assert [field["name"] for field in declared["PlayTone"]["fields"]] == ["frequency_hz", "duration_ms"]


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["PlayTon"], "PlayTone"),
        (["PlayTone"], "frequency_hz"),
        (["PlayTone", "frequency=440"], "frequency_hz"),
        (["PlayTone", "frequency_hz=70000", "duration_ms=1"], "65535"),
        ([], "--list"),
    ],
)
def test_a_mistake_shows_how_it_is_done(words, hint, refused):
    assert hint in refused("send", *words, "--nxt", "sim://")


def test_a_refusal_of_the_brick_is_exit_code_5(capsys):
    assert main(["send", "OpenRead", "name=nothing.rxe", "--nxt", "sim://"]) == REFUSED
    assert "0x87" in capsys.readouterr().err


def test_the_installed_program_works_and_survives_a_closed_pipe():
    done = subprocess.run(
        f"{sys.executable} -m nxtdrive send --list | head -1",
        shell=True,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert done.stdout.startswith("StartProgram")
    assert done.stderr == ""


@pytest.mark.parametrize(
    ("words", "firmware", "since"),
    [
        (["RenameFile", "name=a", "new_name=b"], "1.29", "1.32"),
        (["GetInterpreterState"], "1.29", "1.32"),
        (["UpdateResetCount", "port=A", "--no-reply"], "1.05", "1.28"),
    ],
)
def test_a_command_that_the_firmware_lacks_is_not_sent(words, firmware, since, refused):
    message = refused("send", *words, "--nxt", f"sim://?firmware={firmware}")
    assert f"firmware {firmware} does not have {words[0]}" in message
    assert f"Firmware {since} and later have it" in message


def test_a_command_of_the_communitys_firmware_is_sent_to_it(printed):
    assert "idle" in printed("send", "GetInterpreterState", "--nxt", "sim://?firmware=1.32").lower()
