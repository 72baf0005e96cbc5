"""``nxtdrive sim serve`` as a program of its own, without a terminal, ended by signals."""

import json
import signal
import subprocess
import sys

import cv2
import pytest
import serial

from firmware_protocol.framing import frame
from nxtdrive.cli.main import USAGE, main

GET_BATTERY = bytes.fromhex("00 0b")


@pytest.fixture
def server(tmp_path):
    command = [sys.executable, "-m", "nxtdrive.cli.main", "sim", "serve", "--pty", str(tmp_path / "nxt")]
    started = subprocess.Popen(
        [*command, "--world", "open", "--json", "--seed", "3", "--size", "160x120"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    yield started
    if started.poll() is None:
        started.kill()
    started.communicate(timeout=30)


def _serving(server):
    event = json.loads(server.stdout.readline())
    assert event["event"] == "serving"
    return event


def _end(server, number):
    """The events that were still to come, the exit code being good."""
    server.send_signal(number)
    out, err = server.communicate(timeout=30)
    assert (server.returncode, err) == (0, "")
    return [json.loads(line) for line in out.splitlines()]


def _ask(port):
    port.write(frame(GET_BATTERY))
    return port.read(int.from_bytes(port.read(2), "little"))


def test_brick_and_camera_are_there_and_both_are_named_in_the_command(server, tmp_path):
    event = _serving(server)
    assert event["nxt"] == f"serial://{tmp_path / 'nxt'}"
    assert event["command"] == f"nxtdrive run --nxt {event['nxt']} --camera {event['camera']}"
    for _ in range(2):
        with serial.Serial(str(tmp_path / "nxt"), timeout=20) as port:
            assert _ask(port)[:3] == bytes.fromhex("02 0b 00")
    capture = cv2.VideoCapture(
        event["camera"],
        cv2.CAP_FFMPEG,
        [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, 20_000, cv2.CAP_PROP_READ_TIMEOUT_MSEC, 20_000],
    )
    there, image = capture.read()
    capture.release()
    assert there
    assert image.shape == (120, 160, 3)
    ended = _end(server, signal.SIGTERM)[-1]
    assert (ended["event"], ended["telegrams"]) == ("ended", 2)
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_ends_it_as_well(server, tmp_path):
    _serving(server)
    assert _end(server, signal.SIGINT)[-1]["event"] == "ended"
    assert list(tmp_path.iterdir()) == []


def test_the_driver_runs_through_the_door(server, tmp_path, capsys):
    nxt = _serving(server)["nxt"]
    assert main(["info", "--nxt", nxt, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["firmware"] == "1.29"
    _end(server, signal.SIGTERM)


def test_it_reports_how_it_goes(server):
    _serving(server)
    status = json.loads(server.stdout.readline())
    assert status["event"] == "status"
    assert set(status) >= {"simulated_s", "telegrams_per_s", "frames_per_s", "real_time_factor"}
    _end(server, signal.SIGTERM)


@pytest.mark.parametrize(
    "words", [["--size", "big"], ["--size", "1x1"], ["--latency-ms", "-1"], ["--latency-ms", "nan"]], ids=" ".join
)
def test_wrong_numbers_are_refused_before_anything_is_opened(words, tmp_path):
    with pytest.raises(SystemExit) as left:
        main(["sim", "serve", "--pty", str(tmp_path / "nxt"), *words])
    assert left.value.code == USAGE
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "hint"), [(["--world", "atlantis"], "atlantis"), (["--camera-port", "99999"], "port")]
)
def test_what_cannot_be_served_is_one_sentence(words, hint, tmp_path, capsys):
    assert main(["sim", "serve", "--pty", str(tmp_path / "nxt"), *words]) == USAGE
    assert hint in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
