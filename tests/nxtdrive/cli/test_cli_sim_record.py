"""``nxtdrive sim record``: what is sent, what is refused, and what does not get into a recording."""

import json
import signal
from pathlib import Path

import pytest

from firmware_protocol.catalog import ALL_COMMANDS, DESTRUCTIVE
from firmware_protocol.direct import SetProperty
from firmware_protocol.enhanced import RenameFile, SetInterpreterState
from firmware_protocol.errors import LinkLost, RemoteProtocolError
from firmware_protocol.system import SetBrickName
from nxtdrive.cli.main import DONE, LINK_LOST, SIGNALLED, USAGE, main
from nxtdrive.tools.conformance.recorder import Anonymizer, TransportPeer, ask_identity, record_conversation
from nxtdrive.tools.conformance.script import WRITING, read_script
from nxtdrive.transports.sim import SimTransport, shared
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation

QUESTIONS = """\
# who is there
GetDeviceInfo
00 0b

# beeps twice
PlayTone frequency_hz=440 duration_ms=200
!tick 50
0194010008001a000400
PlayTone frequency_hz=880 duration_ms=100 --no-reply
!tick 300
SetInputMode port=IN_1 type=SWITCH mode=BOOLEAN
GetInputValues port=IN_1
SetOutputState port=B power=75 mode=MOTOR_ON|BRAKE regulation=IDLE turn_ratio=0 run_state=RUNNING tacho_limit=360
!tick 700
GetOutputState port=B
# no command that anything knows
00 99
02 13
"""


@pytest.fixture
def script(here):

    def write(text, name="questions.txt"):
        path = here / name
        path.write_text(text)
        return str(path)

    return write


def record(*words):
    return main(["sim", "record", *words])


def steps(path="questions.jsonl"):
    with open(path, encoding="utf-8") as file:
        return [json.loads(line) for line in file]


@pytest.mark.parametrize("firmware", ["1.29", "1.05"])
def test_a_recording_of_the_simulated_brick_is_the_same_in_a_check(firmware, script, capsys):
    path = script(QUESTIONS)
    assert record(path, "--nxt", f"sim://?firmware={firmware}") == DONE
    assert f"questions.jsonl: 15 steps with firmware {firmware}" in capsys.readouterr().out
    assert main(["sim", "check", "questions.jsonl"]) == DONE
    assert f"firmware {firmware}: 1 of 1 scenarios and 15 of 15 steps are the same" in capsys.readouterr().out


def test_a_recording_is_what_the_golden_ones_are(script):
    assert (
        record(script("# first\n# and second\nGetBatteryLevel\n!tick 20\n"), "--about", "mine", "--scenario", "x") == 0
    )
    version, battery, tick = steps()
    assert version == {
        "scenario": "x",
        "step": 0,
        "about": "mine",
        "firmware": "1.29",
        "request": "0188",
        "reply": "0288007c011d01",
    }
    assert battery == {"scenario": "x", "step": 1, "request": "000b", "reply": "020b004a1e", "note": "first and second"}
    assert tick == {"scenario": "x", "step": 2, "control": "!tick 20", "reply": "ok"}


def test_a_recording_that_is_traced_says_over_what_it_was(script):
    assert record(script("GetBatteryLevel\n"), "--nxt", "sim://open", "--trace", "talk.nxttrace") == DONE
    assert steps()[0]["about"] == "a brick over sim"


def test_the_bench_has_no_link_to_trace(script, refused):
    """With one, another brick would be recorded: that in the room of ``sim://``, which a check does not repeat."""
    assert "--trace" in refused("sim", "record", script("GetBatteryLevel\n"), "--trace", "talk.nxttrace")
    assert not Path("questions.jsonl").exists()


def test_time_that_an_exchange_took_is_recorded_as_a_wait(script):
    assert record(script("GetBatteryLevel\n"), "--nxt", "sim://open?latency_ms=30") == DONE
    assert [step.get("control") or step["request"] for step in steps()] == ["0188", "000b", "!tick 29"]


REFUSED = [
    ("Delete name=x.rxe", "Delete changes what the brick stores"),
    ("01 85 78", "Delete changes"),
    ("81 85 78", "Delete changes"),
    ("DeleteUserFlash", "DeleteUserFlash changes"),
    ("0197", "Boot changes"),
    ("SetBrickName name=Robot", "SetBrickName changes"),
    ("01 8100", "OpenWrite changes"),
    ("01 a7", "system command 0xa7"),
    ("01", "one byte"),
    ("00 0b" + " 00" * 64, "more than 64 bytes"),
]


@pytest.mark.parametrize(("line", "reason"), REFUSED)
def test_what_changes_the_brick_is_refused_unless_it_is_allowed(line, reason, script, refused):
    path = script(f"GetBatteryLevel\n{line}\n")
    said = refused("sim", "record", path)
    assert "line 2" in said
    assert reason in said
    assert "--allow-writes" in said
    assert len(read_script(Path(path), allow_writes=True)) == 2


def test_every_command_that_writes_or_erases_counts():
    writing = {each for each in ALL_COMMANDS if each.__name__.startswith(("Write", "OpenWrite", "OpenAppend"))}
    assert writing | DESTRUCTIVE | {RenameFile, SetBrickName, SetInterpreterState, SetProperty} == WRITING


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "has no telegrams"),
        ("# nothing\n", "has no telegrams"),
        ("GetBattery\n", "line 1"),
        ("PlayTone frequency_hz=x\n", "line 1"),
        ("000\n", "two hex digits"),
        ("!motor 0 590 60 12 150 5 0\n", "a real brick lacks"),
        ("!bt 0200000b\n", "a real brick lacks"),
        ("!tick\n", "not a valid wait"),
        ("!tick 0\n", "not a valid wait"),
        ("!tick 1000001\n", "not a valid wait"),
        ("!tick x\n", "not a valid wait"),
        ('GetBatteryLevel "\n', "line 1"),
    ],
)
def test_a_script_with_a_mistake_is_refused_before_the_brick_is_opened(text, reason, script, refused):
    assert reason in refused("sim", "record", script(text), "--nxt", "tcp://127.0.0.1:1")


def test_places_that_cannot_be_written_are_refused_before_the_brick_is_opened(script, refused, tmp_path):
    path = script("GetBatteryLevel\n")
    (tmp_path / "link.jsonl").symlink_to(path)
    (tmp_path / "folder").mkdir()
    same = tmp_path / "folder" / ".." / "questions.txt"
    for out in (tmp_path, tmp_path / "nowhere" / "x.jsonl", path, tmp_path / "link.jsonl", same):
        assert "cannot be written" in refused("sim", "record", path, "--out", out, "--nxt", "tcp://127.0.0.1:1")
    assert Path(path).read_text() == "GetBatteryLevel\n"
    assert record(path, "--nxt", "sim://?firmware=9.9") == USAGE
    assert not list(tmp_path.glob("questions.jsonl"))
    assert record(str(tmp_path / "none.txt")) == USAGE


SECRET = b"Ann's NXT"


class Owned(SimTransport):
    """The simulated brick behind a transport that passes for a real one."""

    simulated = False


@pytest.fixture
def owned():
    simulation = Simulation("open")
    simulation.brick.radio.name = SECRET.ljust(16, b"\0")
    return Owned(simulation)


def conversation(transport, path, anonymizer):
    lines = read_script(path, allow_writes=False)
    return list(record_conversation(TransportPeer(transport), lines, "s", "a", anonymizer))


@pytest.mark.parametrize("keep", [False, True])
def test_name_and_address_of_a_real_brick_are_blanked_and_masked(keep, owned, script, tmp_path):
    script("GetDeviceInfo\nGetBluetoothAddress\n01940100050066043000\n019401000100\nGetBatteryLevel\n")
    peer = TransportPeer(owned)
    address = ask_identity(peer).address[:6].hex()
    anonymizer = None if keep else Anonymizer(ask_identity(peer))
    records = conversation(owned, tmp_path / "questions.txt", anonymizer)
    text = json.dumps(records)
    assert (SECRET.hex() in text) is keep
    assert (address in text) is keep
    masked = [each for each in records if "mask" in each]
    if not keep:
        info = next(each for each in masked if each["request"] == "019b")
        assert info["mask"] == "ffffff" + "00" * 26 + "ff" * 4
        assert len(info["reply"]) == len(info["mask"])
        assert not any("mask" in each for each in records if each.get("request") == "000b")


DRIVE = """\
SetOutputState port=B power=75 mode=MOTOR_ON regulation=IDLE turn_ratio=0 run_state=RUNNING tacho_limit=0
SetOutputState port=C power=75 mode=MOTOR_ON regulation=IDLE turn_ratio=0 run_state=RUNNING tacho_limit=0
!tick 700
GetOutputState port=B
!tick 5000
"""


class Interrupted(SimTransport):
    """Ctrl-C comes in the last wait."""

    def sleep(self, duration_s):
        if duration_s >= 5:
            signal.raise_signal(signal.SIGINT)
        super().sleep(duration_s)


class Lost(SimTransport):
    """The cable is pulled before the fourth telegram."""

    sent = 0

    def send(self, telegram):
        Lost.sent += 1
        if Lost.sent == 4:
            raise LinkLost("The cable is gone.")
        super().send(telegram)


class Garbled(SimTransport):
    """From the fourth reply on bytes arrive that are no telegrams."""

    received = 0

    def receive(self, timeout_s):
        Garbled.received += 1
        if Garbled.received >= 4:
            raise RemoteProtocolError("a telegram of 0 bytes was announced")
        return super().receive(timeout_s)


@pytest.mark.parametrize(
    ("kind", "code", "kept"),
    [
        (SimTransport, DONE, 9),
        (Interrupted, SIGNALLED + signal.SIGINT, 8),
        (Lost, LINK_LOST, 6),
        (Garbled, LINK_LOST, 6),
    ],
)
def test_the_motors_stop_at_the_end_and_what_was_recorded_is_kept(kind, code, kept, script):
    simulation = Simulation("open")
    start = simulation.truth.pose.x_mm
    with shared("robot", lambda: kind(simulation)) as address:
        assert record(script(DRIVE), "--nxt", address) == code
    assert simulation.truth.pose.x_mm > start + 50
    assert len(steps()) == kept
    simulation.advance(500)
    rest = simulation.truth.pose
    simulation.advance(1000)
    assert simulation.truth.pose == rest


def test_a_brick_that_does_not_answer_leaves_no_recording(script, capsys):
    silent = LinkFaults(silent_ms=((0, 10**9),))
    with shared("robot", lambda: SimTransport(Simulation("open"), faults=silent)) as address:
        assert record(script("GetBatteryLevel\n"), "--nxt", address) == LINK_LOST
    assert "does not answer" in capsys.readouterr().err
    assert not Path("questions.jsonl").exists()


def test_a_late_reply_is_not_taken_for_the_next_one(script):
    late = LinkFaults(delay_replies_ms={1: 2500})
    with shared("robot", lambda: SimTransport(Simulation("open"), faults=late)) as address:
        assert record(script("GetBatteryLevel\nKeepAlive\nGetCurrentProgramName\n"), "--nxt", address) == DONE
    assert {each["request"]: each["reply"][:6] for each in steps() if "request" in each} == {
        "0188": "028800",
        "000b": "",
        "000d": "020d00",
        "0011": "0211ec",
    }
