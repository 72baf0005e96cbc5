"""``nxtdrive sim serve`` as a program of its own, without a terminal, ended by signals."""

import errno
import json
import os
import signal
import socket

import cv2
import pytest
import serial

from firmware_protocol.framing import frame
from firmware_protocol.system import IOMapWrite
from nxtdrive import open_brick
from nxtdrive.cli.main import USAGE, main

GET_BATTERY = bytes.fromhex("00 0b")


@pytest.fixture
def server(started, tmp_path):
    doors = ("--pty", tmp_path / "nxt", "--tcp", "0", "--nxt-server", "0")
    return started("sim", "serve", *doors, "--world", "open", "--json", "--seed", "3", "--size", "160x120")


def _serving(server):
    event = json.loads(server.stdout.readline())
    assert event["event"] == "serving"
    return event


def _event(server, name):
    """The next event of that name."""
    return next(event for line in server.stdout if (event := json.loads(line))["event"] == name)


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


def test_the_firmware_may_be_chosen(started):
    server = started("sim", "serve", "--tcp", "0", "--json", "--firmware", "1.32")
    with open_brick(_serving(server)["nxt"]) as brick:
        assert brick.info().firmware == "1.32"


@pytest.mark.slow
def test_a_webcam_that_is_to_be_attached_is_named(started):
    server = started("sim", "serve", "--usbip", "0", "--uvc", "0", "--world", "open")
    lines = [server.stdout.readline() for _ in range(12)]
    text = "".join(lines)
    brick, *cameras = (line.split()[1] for line in lines[:3])
    assert brick.startswith("usbip://127.0.0.1:")
    assert [camera.split("://")[0] for camera in cameras] == ["http", "usbip"]
    assert text.count("attach -r 127.0.0.1") == 2
    assert "--camera 0" in text


@pytest.mark.slow
def test_ctrl_c_ends_it_as_well(server, tmp_path):
    _serving(server)
    assert _end(server, signal.SIGINT)[-1]["event"] == "ended"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["serial", "tcp", "nxt-server"])
def test_the_driver_runs_through_the_door(server, scheme, answered):
    (nxt,) = (door for door in _serving(server)["doors"] if door.startswith(scheme))
    assert answered("info", "--nxt", nxt)["firmware"] == "1.29"
    _end(server, signal.SIGTERM)


@pytest.mark.slow
def test_programs_that_connect_and_disconnect_are_reported(server):
    (address,) = (door for door in _serving(server)["doors"] if door.startswith("nxt-server"))
    with socket.create_connection(("127.0.0.1", int(address.rpartition(":")[2])), timeout=20) as line:
        assert _event(server, "connected")["door"] == address
        line.sendall(GET_BATTERY)
        assert line.recv(100)[:3] == bytes.fromhex("02 0b 00")
    gone = _event(server, "disconnected")
    assert (gone["client"], gone["telegrams"]) == (1, 1)
    _end(server, signal.SIGTERM)


@pytest.mark.slow
def test_a_brick_that_switches_itself_off_is_reported_and_accepts_no_connection(server):
    (address,) = (door for door in _serving(server)["doors"] if door.startswith("nxt-server"))
    place = "127.0.0.1", int(address.rpartition(":")[2])
    with socket.create_connection(place, timeout=20) as line:
        line.sendall(IOMapWrite.put(0x00060001, 0, b"\x00\x5a").encode())
        assert _event(server, "switched_off")
    with socket.create_connection(place, timeout=20) as line:
        assert line.recv(1) == b""
    _end(server, signal.SIGTERM)


@pytest.mark.slow
def test_it_reports_how_it_goes(server):
    _serving(server)
    status = json.loads(server.stdout.readline())
    assert status["event"] == "status"
    assert set(status) >= {"simulated_s", "telegrams_per_s", "frames_per_s", "real_time_factor"}
    _end(server, signal.SIGTERM)


@pytest.mark.parametrize(
    "words",
    [["--size", "big"], ["--size", "1x1"], ["--latency-ms", "-1"], ["--latency-ms", "nan"], ["--tcp", "70000"]],
    ids=" ".join,
)
def test_wrong_numbers_are_refused_before_anything_is_opened(words, tmp_path):
    with pytest.raises(SystemExit) as left:
        main(["sim", "serve", "--pty", str(tmp_path / "nxt"), *words])
    assert left.value.code == USAGE
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["--world", "atlantis"], "atlantis"),
        (["--host", "192.0.2.1", "--tcp", "0"], "192.0.2.1"),
        (["--faults", "/nowhere.toml"], "/nowhere.toml"),
        (["--pty", "/nowhere/nxt"], "/nowhere/nxt"),
    ],
)
def test_what_cannot_be_served_gives_one_sentence(words, hint, tmp_path, refused):
    assert hint in refused("sim", "serve", "--pty", tmp_path / "nxt", *words)
    assert list(tmp_path.iterdir()) == []


def test_a_port_in_use_is_one_sentence(capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        assert main(["sim", "serve", "--nxt-server", str(taken.getsockname()[1])]) == USAGE
    assert capsys.readouterr().err.count("\n") == 1


def test_without_a_door_there_is_nothing_to_serve(refused):
    assert "say how programs connect: --pty LINK, --tcp PORT, --nxt-server" in refused("sim", "serve")


@pytest.mark.slow
def test_doors_to_the_network_are_warned_of(started):
    server = started("sim", "serve", "--tcp", "0", "--host", "0.0.0.0", "--json")
    _serving(server)
    server.terminate()
    assert "anyone" in server.communicate(timeout=30)[1]


@pytest.mark.parametrize("door", ["--tcp", "--nxt-server", "--usbip", "--uvc", "--camera-port"])
def test_a_port_in_use_is_reported_in_the_systems_words(door, capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["sim", "serve", "--tcp", "0", door, str(port)]) == USAGE
    errors = capsys.readouterr().err
    assert f"port {port}: {os.strerror(errno.EADDRINUSE)}. Take another" in errors
    assert errors.count("\n") == 1


def test_a_host_that_is_not_known_is_reported_in_the_systems_words(refused):
    errors = refused("sim", "serve", "--tcp", "0", "--host", "nowhere.invalid")
    assert errors.startswith("nxtdrive: cannot listen on nowhere.invalid, port 0: ")
    assert "bind" not in errors
